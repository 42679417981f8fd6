"""What can be told of a pose from observations: likelihoods that score hypotheses, and simple agents."""

from motionenv.estimation.observation import ObservationModel

__all__ = ["ObservationModel"]
