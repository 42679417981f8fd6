"""Metrics of estimates: errors of points, proper scores and calibration of beliefs."""

from motionenv.metrics.beliefs import coverage, credible_level, energy_score
from motionenv.metrics.points import aligned_mpjpe, mpjpe, pelvis_mpjpe
from motionenv.metrics.walkers import (
    cycle_mpjpe,
    joint_error,
    missing_variance,
    relative_joint_error,
    relative_walker_error,
    walker_error,
)

__all__ = [
    "aligned_mpjpe", "coverage", "credible_level", "cycle_mpjpe", "energy_score", "joint_error", "missing_variance",
    "mpjpe", "pelvis_mpjpe", "relative_joint_error", "relative_walker_error", "walker_error",
]  # fmt: skip
