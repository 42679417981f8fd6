"""Agents in environments: what an agent is, and how well it plays."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from motionenv.estimation.numeric import checked_whole


class Agent(Protocol):
    """Plays one environment, or all of a vector of them at a time."""

    def reset(self, observation, began=None) -> None:
        """Episodes begin.

        Args:
            observation: their first; in a vector environment, that of all.
            began: in a vector environment which of them begin, bool (n,); None is all.
        """

    def act(self, observation) -> np.ndarray:
        """The action, an estimate for the frame just observed.

        Args:
            observation: as the environment gives it.
        """


@dataclass(frozen=True, eq=False)
class Scores:
    """How well an agent played.

    Attributes:
        errors: (episodes,) mean over each episode of the error per joint [m].
        returns: (episodes,) sums of rewards.
        lengths: (episodes,) estimates made.
    """

    errors: np.ndarray
    returns: np.ndarray
    lengths: np.ndarray


def play(env, agent: Agent, episodes: int, seed: int | None = None) -> Scores:
    """Let `agent` play whole episodes.

    Args:
        env: a tracking environment of Gymnasium, single or vector, in any autoreset mode, wrapped or not.
        agent: who plays.
        episodes: how many, from 1; the sub-environments of a vector share them evenly, whatever their lengths.
        seed: of the environment.

    Raises:
        MotionError: `episodes` isn't a whole number from 1.
    """
    tally = _Tally(getattr(env, "num_envs", 1), checked_whole(episodes, "episodes", 1))
    (_play_vector if hasattr(env, "num_envs") else _play_single)(env, agent, tally, seed)
    return tally.scores()


class _Tally:
    """Sums over the estimates of running episodes, and those of ended ones.

    Args:
        n: episodes that run at a time.
        episodes: how many in all.
    """

    def __init__(self, n: int, episodes: int):
        self._due = episodes // n + (np.arange(n) < episodes % n)
        self._running = np.zeros((n, 3))
        self._ended: list[list[np.ndarray]] = [[] for _ in range(n)]

    def add(self, errors, rewards, made: np.ndarray, over: np.ndarray) -> None:
        """Errors and rewards (n,) of the estimates `made` (n,), and which episodes are `over` (n,) with them."""
        self._running[made] += np.stack([errors, rewards, np.ones(len(made))], axis=-1)[made]
        for slot in np.flatnonzero(over):
            if len(self._ended[slot]) < self._due[slot]:
                self._ended[slot].append(self._running[slot].copy())
            self._running[slot] = 0.0

    def complete(self) -> bool:
        """Whether all episodes that are due have ended."""
        return all(len(ended) == due for ended, due in zip(self._ended, self._due, strict=True))

    def scores(self) -> Scores:
        """Of the episodes that have ended."""
        errors, returns, lengths = np.array([row for ended in self._ended for row in ended]).T
        return Scores(errors / lengths, returns, lengths.astype(np.intp))


def _play_single(env, agent: Agent, tally: _Tally, seed: int | None) -> None:
    """`play` in one environment."""
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
    """`play` in a vector environment."""
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
