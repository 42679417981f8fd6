"""The simulated world of the environments: motion, cameras, images, and scoring."""

from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.stage import Stage

__all__ = ["Estimates", "Source", "Stage"]
