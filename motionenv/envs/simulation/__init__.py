"""The simulated world of the environments: motion, cameras, images, and scoring."""

from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.marker_world import MarkerWorld
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.picture_world import PictureWorld
from motionenv.envs.simulation.stage import Stage

__all__ = ["Estimates", "MarkerWorld", "PictureWorld", "Source", "Stage"]
