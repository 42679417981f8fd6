"""The agent protocol, evaluation of agents in environments, and reports by which agents are compared."""

import platform
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from motionenv._core.validation import checked_whole
from motionenv.envs import active
from motionenv.envs.agents.baselines import Blob, Kalman, MeanPose, Oracle
from motionenv.envs.agents.particle_filter import TrackingAgent
from motionenv.envs.base import Observation
from motionenv.envs.tasks import TASKS, settings
from motionenv.errors import ExtrapolationWarning, MotionError


class Agent(Protocol):
    """Acts in a single or a vector environment."""

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Begin episodes with their first `observation`; `began` (n,) tells which ones of a vector begin, None all."""

    def act(self, observation: Observation) -> np.ndarray:
        """The action: an estimate for the frame just observed, from an `observation` of the environment."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Each episode's mean error per joint [m] (`errors`), sum of rewards (`returns`) and estimates (`lengths`)."""

    errors: np.ndarray
    returns: np.ndarray
    lengths: np.ndarray

    def __repr__(self) -> str:
        mean = f"{self.errors.mean():.3f} m, return {self.returns.mean():.2f}"
        return f"Scores({len(self.errors)} episodes, mean error {mean})"


def evaluate(env: Any, agent: Agent, episodes: int, seed: int | None = None) -> Scores:
    """Run `agent` for whole episodes.

    Args:
        env: a tracking environment of Gymnasium, single or vector, in any autoreset mode, wrapped or not.
        agent, seed: who acts, and the environment's seed.
        episodes: at least 1, distributed evenly over the sub-environments of a vector, whatever their lengths.

    Raises:
        MotionError: `episodes` isn't a whole number of at least 1.
    """
    vector, episodes = isinstance(env, VectorEnv), checked_whole(episodes, "episodes", 1)
    tally = _Tally(env.num_envs if vector else 1, episodes)
    (_play_vector if vector else _play_single)(env, agent, tally, seed)
    return tally.scores()


class _Tally:
    """Sums over the estimates of `n` simultaneous episodes, and results of ended ones, `episodes` in all."""

    def __init__(self, n: int, episodes: int):
        self._due = episodes // n + (np.arange(n) < episodes % n)
        self._running = np.zeros((n, 3))
        self._ended: list[list[np.ndarray]] = [[] for _ in range(n)]

    def add(self, errors, rewards, made: np.ndarray, over: np.ndarray) -> None:
        """Add errors and rewards (n,) of the estimates `made` (n,); `over` (n,) marks ended episodes."""
        self._running[made] += np.stack([errors, rewards, np.ones(len(made))], axis=-1)[made]
        for slot in np.flatnonzero(over):
            if len(self._ended[slot]) < self._due[slot]:
                self._ended[slot].append(self._running[slot].copy())
            self._running[slot] = 0.0

    def complete(self) -> bool:
        return all(len(ended) == due for ended, due in zip(self._ended, self._due, strict=True))

    def scores(self) -> Scores:
        errors, returns, lengths = np.array([row for ended in self._ended for row in ended]).T
        return Scores(errors / lengths, returns, lengths.astype(np.intp))


def _play_single(env, agent: Agent, tally: _Tally, seed: int | None) -> None:
    one = np.ones(1, dtype=bool)
    while not tally.complete():
        observation, _ = env.reset(seed=seed)
        seed, over = None, False
        agent.reset(observation)
        while not over:
            observation, reward, terminated, truncated, info = env.step(agent.act(observation))
            over = terminated or truncated
            tally.add([info["error"]], [reward], one, np.array([over]))


def _play_vector(env, agent: Agent, tally: _Tally, seed: int | None) -> None:
    mode = env.metadata["autoreset_mode"].name
    observation, _ = env.reset(seed=seed)
    agent.reset(observation)
    over = np.zeros(env.num_envs, dtype=bool)
    while True:
        idle = over if mode == "NEXT_STEP" else np.zeros_like(over)  # a step that only resets
        observation, rewards, terminated, truncated, info = env.step(agent.act(observation))
        over = (terminated | truncated) & ~idle
        errors = info.get("error", 0.0) + info.get("final_info", {}).get("error", np.zeros(len(over)))
        tally.add(errors, rewards, ~idle, over)
        if tally.complete():
            return
        if mode == "DISABLED" and over.any():
            observation, _ = env.reset(options={"reset_mask": over})
        began = idle if mode == "NEXT_STEP" else over
        if began.any():
            agent.reset(observation, began)
        if mode == "DISABLED":
            over = np.zeros_like(over)


def _oracle(env: Any) -> Agent:
    """The oracle of the family to which `env` belongs."""
    return (active.Oracle if isinstance(env.unwrapped, active.ActiveTrackingVector) else Oracle)(env)


#: Shipped agents by name; the last four play ActiveTracking, and "oracle" plays everything.
AGENTS: dict[str, Callable[[Any], Agent]] = {
    "mean-pose": MeanPose, "blob": Blob, "kalman": Kalman,
    "particle-filter": lambda env: TrackingAgent(env, seed=0, threads=1), "oracle": _oracle,
    "still": active.Still, "sweep": active.Sweep, "greedy": active.Greedy, "planner": active.Planner,
}  # fmt: skip
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
    task: str, agent: str | Callable[[Any], Agent], episodes: int = 100, *, split: str = "eval",
    motion: str | None = None, file_fps: float | None = None, unit: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Score an agent on a task.

    Args:
        task, split: an id of `motionenv.envs.tasks.TASKS`, and one of its `SPLITS`.
        agent: a name for `agent_of`, or a factory that makes an agent from a native vector environment.
        episodes: number of episodes, with seeds from `FIRST_SEED`.
        motion, file_fps, unit: see `motionenv.envs.tasks.settings`.

    Returns:
        What JSON can hold: task, split, agent, settings, seeds, mean error [m] and return of each episode, their means
        with 95 % bootstrap intervals over episodes, the normalised return, where 0 is the mean return of `MeanPose` (in
        ActiveTracking, of `Still`) in the same episodes and 1 that of the oracle, the seconds it took, and versions.

    Raises:
        MotionError: no such task, split or agent, or a number of episodes below 1.
    """
    changed = settings(task, split, motion=motion, file_fps=file_fps, unit=unit)
    episodes = checked_whole(episodes, "episodes", 1)
    make, name = (agent_of(agent), agent) if isinstance(agent, str) else (agent, getattr(agent, "__name__", "agent"))
    began = time.perf_counter()
    played = _played(task, changed, make, episodes)
    errors, returns = played.errors, played.returns
    return {
        "task": task, "split": split, "agent": name, "settings": {**TASKS[task].settings, **changed},
        "seeds": list(range(FIRST_SEED, FIRST_SEED + episodes)),
        "errors": errors.tolist(), "mean_error": errors.mean(), "error_interval": interval(errors),
        "returns": returns.tolist(), "mean_return": returns.mean(), "return_interval": interval(returns),
        **_normalised(task, changed, returns), "seconds": time.perf_counter() - began,
        "versions": {name: version(name) for name in ("motionenv", "gymnasium", "numpy")}
        | {"python": platform.python_version(), "platform": sys.platform},
    }  # fmt: skip


def _played(task: str, changed: dict[str, Any], make: Callable[[Any], Agent], episodes: int) -> Scores:
    """Scores of the first `episodes` of a task with `changed` settings, a few at a time."""
    n, parts = min(episodes, _TOGETHER), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)  # "ood" is beyond what was learned on purpose
        env = gymnasium.make_vec(task, num_envs=n, vectorization_mode="vector_entry_point", **changed)
        player = make(env)
        for first in range(0, episodes, n):
            parts.append(evaluate(env, player, min(n, episodes - first), seed=FIRST_SEED + first))
        env.close()
    errors, returns, lengths = zip(*((part.errors, part.returns, part.lengths) for part in parts), strict=True)
    return Scores(np.concatenate(errors), np.concatenate(returns), np.concatenate(lengths))


def interval(values: np.ndarray, *bounds: np.ndarray) -> list[float]:
    """The 95 % bootstrap interval [low, high] of the mean of `values` (n,), always the same.

    With `bounds` (n,), the worst and the best, of the normalised mean: 0 where it is the mean of the worst, 1 the best.
    """
    drawn = np.random.default_rng(0).integers(len(values), size=(_RESAMPLED, len(values)))
    means = values[drawn].mean(axis=1)
    if bounds:
        worst, best = (bound[drawn].mean(axis=1) for bound in bounds)
        means = (means - worst) / (best - worst)
    return np.percentile(means, [2.5, 97.5]).tolist()


def _normalised(task: str, changed: dict[str, Any], returns: np.ndarray) -> dict[str, Any]:
    """The normalised return of `returns` (n,) and its interval; a fully observable twin has the same episodes."""
    full = TASKS[task].full
    twin, least = (full, MeanPose) if full else (task, active.Still)
    worst, best = (_played(twin, changed, make, len(returns)).returns for make in (least, _oracle))
    return {
        "normalised_return": (returns.mean() - worst.mean()) / (best.mean() - worst.mean()),
        "normalised_interval": interval(returns, worst, best),
    }
