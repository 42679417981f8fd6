"""Figures of the papers, as matplotlib `Figure`s: `figure.savefig("snr.png")`. Needs the `plots` extra."""

from motionenv.plots.lifting import lifted_walk
from motionenv.plots.models import coefficient_histograms, components, snr_curve, variance_curve
from motionenv.plots.motion import pose_samples, trajectories
from motionenv.plots.views import error_over_variance, over_views, recovered_views

__all__ = [
    "coefficient_histograms",
    "components",
    "error_over_variance",
    "lifted_walk",
    "over_views",
    "pose_samples",
    "recovered_views",
    "snr_curve",
    "trajectories",
    "variance_curve",
]
