r"""Prior about a motion that is known approximately, such as one lifted from detections; elsewhere another prior.

With the motion's pose g_t in frame t and standard deviations σ, bodies deviate by an Ornstein-Uhlenbeck process:

    θ_t = g_t + d_t,    d_t = a d_t-1 + √(1 - a²) η_t,    η_t ~ N(0, diag(σ²)),    a = exp(-1 / (memory · fps))

which is N(g_t, diag(σ²)) in every frame. Where the motion isn't known, bodies go on by the other prior, from where they
are and as fast as they were.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.tracking.priors.base import Prior, Start
from motionenv.types import POSE, frozen


@dataclass(frozen=True, eq=False)
class GuidedState:
    """N bodies in a frame.

    Attributes:
        poses: (N, 25) [m, rad].
        before: (N, 25) one frame earlier; NaN if unknown.
        frame: number of the frame in the guiding motion.
        other: the state of the other prior; None while the motion guides.
    """

    poses: np.ndarray
    before: np.ndarray
    frame: int
    other: Any

    def take(self, which: np.ndarray) -> "GuidedState":
        """The bodies with indices `which` (n,)."""
        other = None if self.other is None else self.other.take(which)
        return GuidedState(self.poses[which], self.before[which], self.frame, other)


class GuidedPrior:
    """Bodies near a known motion, and of another prior where it has gaps.

    Args:
        other: prior of the gaps, with the skeleton and frame rate.
        guide: (T, 25) [m, rad]; rows with NaN are gaps.
        deviation: (25,) σ [m, rad].
        memory: correlation time of the deviations [s].
        first: frame of the guide in which the filter starts.
        step: 1, or -1 if frames come in reverse order.

    Raises:
        MotionError: wrong shapes, or numbers out of range.
    """

    def __init__(self, other: Prior, guide, deviation, memory: float = 0.3, *, first: int = 0, step: int = 1):
        self.skeleton, self.fps, self.other = other.skeleton, other.fps, other
        self.guide, self.deviation = (
            frozen(guide, (None, len(POSE)), "guide"),
            frozen(deviation, (len(POSE),), "deviation"),
        )
        if not ((self.deviation >= 0) & np.isfinite(self.deviation)).all():
            raise MotionError("deviation must be finite standard deviations of at least 0")
        self._keep = float(np.exp(-1 / (checked_number(memory, "memory", above=0) * self.fps)))
        self._guides = np.isfinite(self.guide).all(axis=1)
        self.first, self.step = first, step

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> GuidedState:
        """Draw `n` bodies of the frame `first` from `start`, with `rng`."""
        if not self.guides(self.first):
            other = self.other.initial(start, n, rng)
            return GuidedState(other.poses, np.full(other.poses.shape, np.nan), self.first, other)
        _, poses, before = start.draw(n, rng)
        return GuidedState(poses, before, self.first, None)

    def propagate(self, state: GuidedState, rng: np.random.Generator) -> GuidedState:
        """The bodies of `state` one frame later, with noise of `rng`."""
        now, frame = state.poses, state.frame + self.step
        if self.guides(frame):
            noise = self.deviation * rng.standard_normal(now.shape)
            if self.guides(state.frame):
                off = now - self.guide[state.frame]
                noise = self._keep * off + np.sqrt(1 - self._keep**2) * noise
            return GuidedState(self.guide[frame] + noise, now, frame, None)
        other = state.other
        if other is None:
            here = Start(now, np.zeros(len(now)), state.before, np.zeros(now.shape[1]))
            other = self.other.initial(here, len(now), rng)
        other = self.other.propagate(other, rng)
        return GuidedState(other.poses, now, frame, other)

    def diffuse(self, state: GuidedState, share: float, rng: np.random.Generator) -> GuidedState:
        """The bodies of `state` in the same frame, with a `share`, 0 to 1, of the process noise, from `rng`."""
        if state.other is not None:
            other = self.other.diffuse(state.other, share, rng)
            return replace(state, poses=other.poses, other=other)
        noise = share * np.sqrt(1 - self._keep**2) * self.deviation
        return replace(state, poses=state.poses + noise * rng.standard_normal(state.poses.shape))

    def moved(self, state: GuidedState, poses: np.ndarray) -> GuidedState:
        """The bodies of `state` with other `poses` (N, 25) [m, rad]."""
        if state.other is not None:
            other = self.other.moved(state.other, poses)
            return replace(state, poses=other.poses, other=other)
        return replace(state, poses=np.array(poses))

    def guides(self, frame: int) -> bool:
        """Whether the motion is known in a `frame`."""
        return 0 <= frame < len(self.guide) and bool(self._guides[frame])
