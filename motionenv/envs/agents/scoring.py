"""The protocol by which agents are compared: a task, a split, fixed seeds, and a report with intervals."""

import platform
import sys
import time
import warnings
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from typing import Any

import gymnasium
import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.envs.agents.baselines import Blob, ConstantVelocity, MeanPose, Oracle
from motionenv.envs.agents.evaluation import Agent, evaluate
from motionenv.envs.agents.particle_filter import TrackingAgent
from motionenv.envs.tasks import TASKS, settings
from motionenv.errors import ExtrapolationWarning, MotionError

#: Shipped agents by name.
AGENTS: dict[str, Callable[[Any], Agent]] = {
    "mean-pose": MeanPose,
    "blob": Blob,
    "constant-velocity": ConstantVelocity,
    "particle-filter": lambda env: TrackingAgent(env, seed=0, threads=1),
    "oracle": Oracle,
}
#: Seed of an evaluation's first episode; those that follow have the next ones.
FIRST_SEED = 1_000_000

_TOGETHER = 16  # episodes at a time
_RESAMPLED = 2000  # bootstrap samples


def agent_of(name: str) -> Callable[[Any], Agent]:
    """The factory (env) -> agent with a `name`: one of `AGENTS`, or "module:factory".

    Raises:
        MotionError: there is none.
    """
    if name in AGENTS:
        return AGENTS[name]
    module, _, factory = name.partition(":")
    try:
        return getattr(import_module(module), factory)
    except (ModuleNotFoundError, AttributeError, TypeError, ValueError) as error:
        raise MotionError(
            f"agent must be one of {', '.join(AGENTS)}, or module:factory, such as mine:Follower for a class Follower "
            f"of mine.py in this folder, made from an environment; got {name!r}, and there is no "
            f"{getattr(error, 'name', None) or 'such name'}"
        ) from None


def score(
    task: str, agent: str | Callable[[Any], Agent], episodes: int = 100, *, split: str = "eval", **capture: Any
) -> dict[str, Any]:
    """Score an agent on a task.

    Args:
        task, split: an id of `motionenv.envs.tasks.TASKS`, and one of its `SPLITS`.
        agent: a name for `agent_of`, or a factory that makes an agent from a native vector environment.
        episodes: number of episodes, with seeds from `FIRST_SEED`.
        capture: see `motionenv.envs.tasks.settings`.

    Returns:
        What JSON can hold: task, split, agent, settings, seeds, mean error [m] and return of each episode, their means
        with 95 % bootstrap intervals over episodes, the seconds it took, and versions.

    Raises:
        MotionError: no such task, split or agent, or a number of episodes below 1.
    """
    changed = settings(task, split, **capture)
    episodes = checked_whole(episodes, "episodes", 1)
    make, name = (agent_of(agent), agent) if isinstance(agent, str) else (agent, getattr(agent, "__name__", "agent"))
    began, parts = time.perf_counter(), []
    n = min(episodes, _TOGETHER)
    env = gymnasium.make_vec(task, num_envs=n, vectorization_mode="vector_entry_point", **changed)
    player = make(env)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)  # "ood" is beyond what was learned on purpose
        for first in range(0, episodes, n):
            parts.append(evaluate(env, player, min(n, episodes - first), seed=FIRST_SEED + first))
    env.close()
    errors, returns = (np.concatenate([getattr(part, what) for part in parts]) for what in ("errors", "returns"))
    return {
        "task": task, "split": split, "agent": name, "settings": {**TASKS[task].settings, **changed},
        "seeds": list(range(FIRST_SEED, FIRST_SEED + episodes)),
        "errors": errors.tolist(), "mean_error": errors.mean(), "error_interval": interval(errors),
        "returns": returns.tolist(), "mean_return": returns.mean(), "return_interval": interval(returns),
        "seconds": time.perf_counter() - began,
        "versions": {name: version(name) for name in ("motionenv", "gymnasium", "numpy")}
        | {"python": platform.python_version(), "platform": sys.platform},
    }  # fmt: skip


def interval(values: np.ndarray) -> list[float]:
    """The 95 % bootstrap interval [low, high] of the mean of `values` (n,), always the same."""
    drawn = np.random.default_rng(0).integers(len(values), size=(_RESAMPLED, len(values)))
    return np.percentile(values[drawn].mean(axis=1), [2.5, 97.5]).tolist()
