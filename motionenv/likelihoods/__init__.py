"""Observation models: likelihoods of images and 2D markers given a pose."""

from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.likelihoods.base import ImageLikelihood, Likelihood
from motionenv.likelihoods.markers import MarkerLikelihood
from motionenv.likelihoods.pixel_history import PixelHistory
from motionenv.likelihoods.silhouette import SilhouetteLikelihood

__all__ = [
    "Background", "ImageLikelihood", "Likelihood", "MarkerLikelihood", "PixelHistory", "SilhouetteLikelihood",
    "foreground_probability",
]  # fmt: skip
