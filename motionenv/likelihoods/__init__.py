"""Observation models: likelihoods of images and 2D markers given a pose, and their product."""

from motionenv.likelihoods.appearance import AppearanceLikelihood
from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.likelihoods.base import ImageLikelihood, Likelihood
from motionenv.likelihoods.markers import MarkerLikelihood
from motionenv.likelihoods.product import ProductLikelihood
from motionenv.likelihoods.silhouette import SilhouetteLikelihood

__all__ = [
    "AppearanceLikelihood", "Background", "ImageLikelihood", "Likelihood", "MarkerLikelihood", "ProductLikelihood",
    "SilhouetteLikelihood", "foreground_probability",
]  # fmt: skip
