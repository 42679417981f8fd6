"""Search of a motion database: the tree of paper C (section 4), and exact draws."""

from motionenv.models.motion_tree.search.basis import Basis, fit_basis
from motionenv.models.motion_tree.search.exact import ExactSampler
from motionenv.models.motion_tree.search.tree import CoefficientTree

__all__ = ["Basis", "CoefficientTree", "ExactSampler", "fit_basis"]
