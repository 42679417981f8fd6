"""Metrics of estimates: errors of points, proper scores and calibration of beliefs."""

from motionenv.metrics.beliefs import coverage, credible_level, energy_score
from motionenv.metrics.points import aligned_mpjpe, mpjpe, pelvis_mpjpe

__all__ = ["aligned_mpjpe", "coverage", "credible_level", "energy_score", "mpjpe", "pelvis_mpjpe"]
