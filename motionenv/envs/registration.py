"""The environments' ids in Gymnasium's registry."""

import gymnasium

from motionenv.envs.tasks import TASKS

#: Ids and the classes of the single environments; a vector environment's class has the same name followed by Vector.
ENVIRONMENTS = {
    "motionenv/WalkerTracking-v1": "motionenv.envs.walker:WalkerTracking",
    "motionenv/MarkerTracking-v1": "motionenv.envs.markers:MarkerTracking",
    "motionenv/ArmTracking-v1": "motionenv.envs.arm:ArmTracking",
    "motionenv/ActiveTracking-v0": "motionenv.envs.active.tracking:ActiveTracking",
}


def register() -> None:
    """Register the environments and the named tasks with Gymnasium; importing `motionenv.envs` does so."""
    for name, entry_point in ENVIRONMENTS.items():
        gymnasium.register(name, entry_point=entry_point, vector_entry_point=f"{entry_point}Vector")
    for name, task in TASKS.items():
        entry_point = ENVIRONMENTS[task.env]
        vector, kwargs = f"{entry_point}Vector", dict(task.settings)
        gymnasium.register(name, entry_point=entry_point, vector_entry_point=vector, kwargs=kwargs)
