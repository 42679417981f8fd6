"""Human tracking: particle filters with learned motion priors (papers A and C).

`ParticleFilter` follows one person with a `Prior` of motion and a likelihood of `motionenv.likelihoods`; `track_video`
does it for a film.
"""

from motionenv.tracking.particle_filter import Belief, ParticleFilter
from motionenv.tracking.priors.base import Prior, SizedPrior, Start
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.tree import TreePrior
from motionenv.tracking.priors.velocity import VelocityPrior
from motionenv.tracking.video import Film, VideoTrack, find_people, track_video

__all__ = [
    "Belief", "FPCAPrior", "Film", "ParticleFilter", "Prior", "SizedPrior", "Start", "TreePrior", "VelocityPrior",
    "VideoTrack", "find_people", "track_video",
]  # fmt: skip
