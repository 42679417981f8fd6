"""How good an estimate is: errors of points, proper scores of beliefs, and whether beliefs are calibrated."""

from motionenv.metrics.beliefs import coverage, credible_level, energy_score
from motionenv.metrics.points import aligned_mpjpe, mpjpe, pelvis_mpjpe

__all__ = ["aligned_mpjpe", "coverage", "credible_level", "energy_score", "mpjpe", "pelvis_mpjpe"]
