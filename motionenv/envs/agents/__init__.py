"""Agents for the environments: baselines, a particle filter agent, and evaluation."""

from motionenv.envs.agents.baselines import Blob, Kalman, MeanPose, Oracle
from motionenv.envs.agents.evaluation import Scores, evaluate, score
from motionenv.envs.agents.particle_filter import TrackingAgent, truth_start

__all__ = [
    "Blob", "Kalman", "MeanPose", "Oracle", "Scores", "TrackingAgent", "evaluate", "score", "truth_start",
]  # fmt: skip
