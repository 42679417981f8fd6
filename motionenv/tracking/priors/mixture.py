"""Mixture of a learned and a general prior (paper C, section 7).

p(φ_t | φ_t-1) = (1 - share) p_learned(φ_t | φ_t-1) + share p_general(φ_t | φ_t-1)

A body that the general prior moves keeps the learned prior's other state variables (a walker's phase, pace and scores),
which continue to evolve by the learned prior.
"""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.tracking.priors.base import Prior, SizedPrior, Start


@dataclass(frozen=True, eq=False)
class MixtureState:
    """N bodies in the representations of the learned and of the general prior, with equal poses."""

    learned: Any
    general: Any

    @property
    def poses(self) -> np.ndarray:
        return self.learned.poses

    @property
    def sizes(self) -> np.ndarray | None:
        return self.learned.sizes

    def take(self, which: np.ndarray) -> "MixtureState":
        return MixtureState(self.learned.take(which), self.general.take(which))


class MixturePrior(SizedPrior):
    """Bodies that move, in each frame, by one of two priors.

    Args:
        learned: the main prior; pose entries that it can't move stay as they are.
        general: the other prior, such as a `VelocityPrior`.
        share: fraction of the particles that `general` moves.

    Raises:
        MotionError: priors of different bodies or frame rates, or `share` out of range.
    """

    def __init__(self, learned: Prior, general: Prior, share: float = 0.1) -> None:
        if learned.fps != general.fps:
            raise MotionError(f"both priors must have the same fps, got {learned.fps:g} and {general.fps:g}")
        if not np.allclose(learned.skeleton.offsets, general.skeleton.offsets, atol=1e-9):
            raise MotionError("both priors must have the same skeleton")
        self.learned, self.general, self.share = learned, general, checked_number(share, "share", 0, 1)
        self.skeleton, self.fps, self.size = learned.skeleton, learned.fps, learned.size

    def __repr__(self) -> str:
        return f"MixturePrior({self.learned!r}, {self.general!r}, share {self.share:g})"

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> MixtureState:
        """Draw `n` bodies at `start` from the learned prior, with `rng`."""
        learned = self.learned.initial(start, n, rng)
        before = np.where(np.isnan(start.previous), np.nan, start.previous - start.poses)
        squared = (start.poses**2).sum(1) - 2 * np.einsum("ni,mi->nm", learned.poses, start.poses)
        nearest = squared.argmin(axis=1)  # of the candidates
        each = Start(learned.poses, np.zeros(n), learned.poses + before[nearest], np.zeros(learned.poses.shape[1]))
        return MixtureState(learned, self.general.initial(each, n, rng))

    def propagate(self, state: MixtureState, rng: np.random.Generator) -> MixtureState:
        learned, general = self.learned.propagate(state.learned, rng), self.general.propagate(state.general, rng)
        helped = rng.random((len(learned.poses), 1)) < self.share
        return self.moved(MixtureState(learned, general), np.where(helped, general.poses, learned.poses))

    def diffuse(self, state: MixtureState, share: float, rng: np.random.Generator) -> MixtureState:
        """The bodies of `state` in the same frame, with a `share`, 0 to 1, of the learned prior's noise, by `rng`."""
        learned = self.learned.diffuse(state.learned, share, rng)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def moved(self, state: MixtureState, poses: np.ndarray) -> MixtureState:
        """The bodies of `state` with other `poses` (N, 25) [m, rad], as far as the learned prior can represent them."""
        learned = self.learned.moved(state.learned, poses)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def resized(self, state: MixtureState, sizes: np.ndarray, centre: np.ndarray) -> MixtureState:
        learned = cast(SizedPrior, self.learned).resized(state.learned, sizes, centre)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))
