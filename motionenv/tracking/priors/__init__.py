"""Motion priors for particle filters (papers A and C)."""

from motionenv.tracking.priors.base import Prior, SizedPrior, Start, State
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.tree import TreePrior
from motionenv.tracking.priors.velocity import VelocityPrior

__all__ = [
    "FPCAPrior", "Prior", "SizedPrior", "Start", "State", "TreePrior", "VelocityPrior",
]  # fmt: skip
