"""ActiveTracking: the task in which the agent also moves the camera it sees with."""

from motionenv.envs.active.tracking import ActiveTracking, ActiveTrackingVector

__all__ = ["ActiveTracking", "ActiveTrackingVector"]
