"""Human tracking: particle filters with learned motion priors (papers A and C)."""

from motionenv.tracking.particle_filter import Belief, ParticleFilter
from motionenv.tracking.priors.base import Start
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.mixture import MixturePrior
from motionenv.tracking.priors.tree import TreePrior, reaching_tree
from motionenv.tracking.priors.velocity import VelocityPrior
from motionenv.tracking.smoothing import smooth

__all__ = [
    "Belief",
    "FPCAPrior",
    "MixturePrior",
    "ParticleFilter",
    "Start",
    "TreePrior",
    "VelocityPrior",
    "reaching_tree",
    "smooth",
]
