"""What can be told of a pose from observations: likelihoods that score hypotheses, and simple agents."""

from motionenv.estimation.agents import ConstantVelocity, MeanPose, Oracle
from motionenv.estimation.appearance import AppearanceModel
from motionenv.estimation.background import Background, foreground_probability
from motionenv.estimation.edges import EdgeModel
from motionenv.estimation.observation import ObservationModel
from motionenv.estimation.playing import Scores, play
from motionenv.estimation.points import MarkerModel
from motionenv.estimation.product import Product

__all__ = [
    "AppearanceModel",
    "Background",
    "ConstantVelocity",
    "EdgeModel",
    "MarkerModel",
    "MeanPose",
    "ObservationModel",
    "Oracle",
    "Product",
    "Scores",
    "foreground_probability",
    "play",
]
