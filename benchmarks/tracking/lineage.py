"""Ancestors of a particle filter's particles: a prior whose particles know their indices in the frames before."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from motionenv.tracking import Belief, Prior, Start


@dataclass(frozen=True, eq=False)
class TracedState:
    """Particles of another prior, and indices (N, 1 + frames) of their ancestors 0, 1, 2, … frames ago.

    Before the first frame, everybody is his own ancestor.
    """

    state: Any
    ancestors: np.ndarray

    @property
    def poses(self) -> np.ndarray:
        return self.state.poses

    @property
    def sizes(self) -> np.ndarray | None:
        return self.state.sizes

    def take(self, which: np.ndarray) -> "TracedState":
        return TracedState(self.state.take(which), self.ancestors[which])


class TracedPrior:
    """A `prior` whose particles remember their ancestors of as many `frames`; otherwise the same, to the bit."""

    def __init__(self, prior: Prior, frames: int) -> None:
        self._prior, self._frames = prior, frames
        self.skeleton, self.fps, self.size = prior.skeleton, prior.fps, prior.size

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> TracedState:
        alone = np.repeat(np.arange(n, dtype=np.int32)[:, None], 1 + self._frames, axis=1)
        return TracedState(self._prior.initial(start, n, rng), alone)

    def propagate(self, state: TracedState, rng: np.random.Generator) -> TracedState:
        now = np.arange(len(state.ancestors), dtype=np.int32)[:, None]
        return TracedState(self._prior.propagate(state.state, rng), np.hstack([now, state.ancestors[:, :-1]]))

    def diffuse(self, state: TracedState, share: float, rng: np.random.Generator) -> TracedState:
        return TracedState(self._prior.diffuse(state.state, share, rng), state.ancestors)

    def moved(self, state: TracedState, poses: np.ndarray) -> TracedState:
        return TracedState(self._prior.moved(state.state, poses), state.ancestors)

    def resized(self, state: TracedState, sizes: np.ndarray, centre: np.ndarray) -> TracedState:
        return TracedState(self._prior.resized(state.state, sizes, centre), state.ancestors)


def distinct(belief: Belief, frames: int) -> float:
    """Effective number 1 / Σ W² of a belief's ancestors so many `frames` ago; W is the weight of all that descend."""
    ancestors = belief.state.ancestors[:, frames]
    return max(1.0, float(1 / (np.bincount(ancestors, np.exp(belief.log_weights)) ** 2).sum()))
