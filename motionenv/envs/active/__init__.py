"""ActiveTracking: the task in which the agent also moves the camera it sees with, and agents that do."""

from motionenv.envs.active.beliefs import Beliefs
from motionenv.envs.active.policies import Greedy, Oracle, Planner, Still, Sweep
from motionenv.envs.active.tracking import ActiveTracking, ActiveTrackingVector

__all__ = ["ActiveTracking", "ActiveTrackingVector", "Beliefs", "Greedy", "Oracle", "Planner", "Still", "Sweep"]
