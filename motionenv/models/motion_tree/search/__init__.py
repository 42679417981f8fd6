"""Search of a motion database: the tree of paper C (section 4), and exact draws."""

from motionenv.models.motion_tree.search.basis import Basis, fit_basis
from motionenv.models.motion_tree.search.kernel_index import KernelIndex
from motionenv.models.motion_tree.search.tree import CoefficientTree

__all__ = ["Basis", "CoefficientTree", "KernelIndex", "fit_basis"]
