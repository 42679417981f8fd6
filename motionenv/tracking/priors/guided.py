r"""Prior about a motion that is known approximately, such as one lifted from detections.

With the motion's pose g_t in frame t and standard deviations σ, bodies deviate by an Ornstein-Uhlenbeck process:

    θ_t = g_t + d_t,    d_t = a d_t-1 + √(1 - a²) η_t,    η_t ~ N(0, diag(σ²)),    a = exp(-1 / (memory · fps))

which is N(g_t, diag(σ²)) in every frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_fps, checked_number
from motionenv.errors import MotionError
from motionenv.tracking.priors.base import Prior, Start, deviations
from motionenv.types import POSE, Skeleton, frozen


@dataclass(frozen=True, eq=False)
class GuidedState:
    """Poses (N, 25) [m, rad] of N bodies in a `frame` of the motion."""

    poses: np.ndarray
    frame: int
    sizes = None

    def take(self, which: np.ndarray) -> GuidedState:
        return GuidedState(self.poses[which], self.frame)


class GuidedPrior(Prior):
    """Bodies near a known motion.

    Args:
        guide: (T, 25) [m, rad]; rows may be NaN in frames that aren't reached.
        deviation: (25,) σ [m, rad].
        skeleton, fps: body and frame rate [Hz].
        first: frame of the guide in which the filter starts.
        memory: correlation time of the deviations [s].

    Raises:
        MotionError: wrong shapes, or numbers out of range.
    """

    def __init__(
        self, guide: ArrayLike, deviation: ArrayLike, *, skeleton: Skeleton, fps: float = 30.0, first: int = 0,
        memory: float = 0.3,
    ) -> None:  # fmt: skip
        self.skeleton, self.fps, self.size, self._first = skeleton, checked_fps(fps), 0.0, first
        self._guide, self._deviation = frozen(guide, (None, len(POSE)), "guide"), deviations(deviation, "deviation")
        self._keep = float(np.exp(-1 / (checked_number(memory, "memory", above=0) * self.fps)))
        self._noise = self._deviation * np.sqrt(1 - self._keep**2)

    def __repr__(self) -> str:
        return f"GuidedPrior({len(self._guide)} frames, {self.fps:g} fps)"

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> GuidedState:
        return GuidedState(start.draw(n, rng)[1], self._first)

    def propagate(self, state: GuidedState, rng: np.random.Generator) -> GuidedState:
        """The bodies of `state` one frame later, with noise of `rng`; raises MotionError after the guide's end."""
        if not state.frame + 1 < len(self._guide):
            raise MotionError(f"the guiding motion ends with frame {state.frame}: follow it by another prior")
        off = self._keep * (state.poses - self._guide[state.frame])
        noise = self._noise * rng.standard_normal(off.shape)
        return GuidedState(self._guide[state.frame + 1] + off + noise, state.frame + 1)

    def diffuse(self, state: GuidedState, share: float, rng: np.random.Generator) -> GuidedState:
        return replace(state, poses=state.poses + share * self._noise * rng.standard_normal(state.poses.shape))

    def moved(self, state: GuidedState, poses: np.ndarray) -> GuidedState:
        return replace(state, poses=np.array(poses))
