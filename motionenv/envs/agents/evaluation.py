"""The agent protocol, and evaluation of agents in environments."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium.vector import VectorEnv

from motionenv._core.validation import checked_whole
from motionenv.envs.base import Observation


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
        """Whether all requested episodes have ended."""
        return all(len(ended) == due for ended, due in zip(self._ended, self._due, strict=True))

    def scores(self) -> Scores:
        """Results of the ended episodes."""
        errors, returns, lengths = np.array([row for ended in self._ended for row in ended]).T
        return Scores(errors / lengths, returns, lengths.astype(np.intp))


def _play_single(env, agent: Agent, tally: _Tally, seed: int | None) -> None:
    """`evaluate` in a single environment."""
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
    """`evaluate` in a vector environment."""
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
