"""Following a person through observations: particle filters with learned priors (papers A and C)."""

from motionenv.estimation.tracking.agent import TrackingAgent, told
from motionenv.estimation.tracking.filters import Belief, ParticleFilter
from motionenv.estimation.tracking.fpca_prior import FPCAPrior
from motionenv.estimation.tracking.priors import Start

__all__ = ["Belief", "FPCAPrior", "ParticleFilter", "Start", "TrackingAgent", "told"]
