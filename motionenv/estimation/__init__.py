"""What can be told of a pose from observations: likelihoods that score hypotheses, and simple agents."""

from motionenv.estimation.agents import ConstantVelocity, MeanPose, Oracle
from motionenv.estimation.background import Background, foreground_probability
from motionenv.estimation.observation import ObservationModel
from motionenv.estimation.playing import Scores, play
from motionenv.estimation.points import MarkerModel

__all__ = [
    "Background",
    "ConstantVelocity",
    "MarkerModel",
    "MeanPose",
    "ObservationModel",
    "Oracle",
    "Scores",
    "foreground_probability",
    "play",
]
