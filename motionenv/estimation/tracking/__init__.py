"""Following a person through observations: particle filters with learned priors (papers A and C)."""

from motionenv.estimation.tracking.agent import TrackingAgent, told
from motionenv.estimation.tracking.filters import Belief, ParticleFilter
from motionenv.estimation.tracking.fpca_prior import FPCAPrior
from motionenv.estimation.tracking.mixture import MixturePrior
from motionenv.estimation.tracking.priors import Start
from motionenv.estimation.tracking.smoothing import smooth
from motionenv.estimation.tracking.tree_prior import TreePrior, reaching_tree
from motionenv.estimation.tracking.velocity_prior import VelocityPrior

__all__ = [
    "Belief",
    "FPCAPrior",
    "MixturePrior",
    "ParticleFilter",
    "Start",
    "TrackingAgent",
    "TreePrior",
    "VelocityPrior",
    "reaching_tree",
    "smooth",
    "told",
]
