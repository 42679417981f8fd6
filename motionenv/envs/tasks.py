"""Named tasks: every family of environments at three levels, on which agents are compared.

`gymnasium.make("motionenv/WalkerTracking-Hard-v2", split="train")` makes one for training; `settings` are those of an
evaluation, and `motionenv.envs.agents.score` runs it:

- "train": walkers for training and for choosing an agent's settings.
- "eval": the same task, with walkers that "train" doesn't have. This is what leaderboards report.
- "ood": smaller and faster people, moved by another model, in front of another camera. With a folder of motion capture
  as `motion`, its people who are for evaluation instead.

A task in which only estimates count has a twin, `motionenv/WalkerTracking-Hard-Full-v2`, that shows the true joints in
the same episodes: the difference between an agent's scores is what not seeing costs. Its `reward_threshold` is the
return at a normalised return of 0.9 on split "train" (`motionenv.envs.agents.score`): a tenth of the mean pose's.
"""

import tomllib
from importlib.resources import files
from typing import Any, NamedTuple

import gymnasium

from motionenv._core.validation import checked_choice
from motionenv.errors import MotionError

#: Splits of a task.
SPLITS = ("train", "eval", "ood")


class Task(NamedTuple):
    """A named task.

    Attributes:
        env, settings, ood: id of its environment, arguments, and those that differ in the split "ood".
        full: id of its fully observable twin, its own if it is one; None if it has none.
        reward_threshold: return at which it counts as solved; None if none was chosen.
    """

    env: str
    settings: dict[str, Any]
    ood: dict[str, Any]
    full: str | None = None
    reward_threshold: float | None = None


#: By environment: what all levels have in common, what is out of distribution ("ood"), and the levels, with what
#: `motionenv bench envs.tasks.thresholds` prints, and a version of their own if they changed since the environment did.
_FAMILIES = tomllib.loads(files(__package__).joinpath("tasks.toml").read_text(encoding="utf-8"))


def _tasks() -> dict[str, Task]:
    made = {}
    for env, tables in _FAMILIES.items():
        common, ood, levels = _arguments(tables["common"]), _arguments(tables["ood"]), tables["levels"]
        family, usual = env.split("-")
        for level, changed in levels.items():
            version, threshold = changed.pop("version", usual), changed.pop("reward_threshold", None)
            task = f"motionenv/{family}-{level}-{version}"
            full = None if family == "ActiveTracking" else f"motionenv/{family}-{level}-Full-{version}"
            made[task] = Task(f"motionenv/{env}", common | _arguments(changed), ood, full, threshold)
            if full:
                made[full] = made[task]._replace(settings={**made[task].settings, "observation": "joints"})
    return made


def _arguments(table: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in table.items()}


#: The tasks by id.
TASKS = _tasks()


def settings(
    task: str, split: str = "eval", *, motion: str | None = None, file_fps: float | None = None, unit: str | None = None
) -> dict[str, Any]:
    """Arguments for `gymnasium.make(task, ...)` that make a split.

    Args:
        task: an id of `TASKS`.
        split: one of `SPLITS`.
        motion, file_fps, unit: a folder or file of motion capture, with frame rate and unit if its files don't state
            them; only of "ood".

    Raises:
        MotionError: no such task or split, or motion capture for another split.
    """
    checked_choice(task, "task", TASKS)
    checked_choice(split, "split", SPLITS)
    given = {"motion": motion, "file_fps": file_fps, "unit": unit}
    capture = {name: value for name, value in given.items() if value is not None}
    if capture and split != "ood":
        raise MotionError(f"motion capture is out of distribution: use it with split 'ood', got {split!r}")
    return {"split": "eval", **(capture or TASKS[task].ood)} if split == "ood" else {"split": split}


#: Ids and the classes of the single environments; a vector environment's class has the same name followed by Vector.
ENVIRONMENTS = {
    "motionenv/WalkerTracking-v1": "motionenv.envs.walker:WalkerTracking",
    "motionenv/MarkerTracking-v1": "motionenv.envs.markers:MarkerTracking",
    "motionenv/ArmTracking-v1": "motionenv.envs.arm:ArmTracking",
    "motionenv/ActiveTracking-v1": "motionenv.envs.active.tracking:ActiveTracking",
}


def register() -> None:
    """Register the environments and the named tasks with Gymnasium; importing `motionenv.envs` does so."""
    for name, entry_point in ENVIRONMENTS.items():
        gymnasium.register(name, entry_point=entry_point, vector_entry_point=f"{entry_point}Vector")
    for name, task in TASKS.items():
        entry, threshold = ENVIRONMENTS[task.env], task.reward_threshold
        gymnasium.register(name, entry, threshold, vector_entry_point=f"{entry}Vector", kwargs=dict(task.settings))
