"""ActiveTracking: the task in which the agent also moves the camera it sees with."""

from motionenv.envs.active.tracking import DIFFICULTIES, ActiveTracking, ActiveTrackingVector
from motionenv.envs.active.world import packed

__all__ = ["DIFFICULTIES", "ActiveTracking", "ActiveTrackingVector", "packed"]
