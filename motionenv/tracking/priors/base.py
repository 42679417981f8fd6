"""The motion prior protocol of particle filters: initial distribution and transition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from motionenv.errors import MotionError
from motionenv.types import POSE, Skeleton, frozen

#: Default standard deviations (25,) of a given pose: positions [m], then angles [rad].
SPREAD = np.concatenate([np.full(3, 0.02), np.full(22, 0.03)])

_FINE = 2.0**-30  # of powers of weights


class State(Protocol):
    """N particles: a frozen dataclass of arrays with leading axis N."""

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""

    @property
    def sizes(self) -> np.ndarray | None:
        """(N,) body sizes relative to the prior's skeleton; None if all bodies have its size."""

    def take(self, which: np.ndarray) -> Any:
        """The particles with indices `which` (n,), repetitions allowed."""


class Prior(Protocol):
    """p(φ_0) and p(φ_t | φ_t-1) of papers A and C, vectorised over particles.

    Filters use the following; `state` is a `State` of the prior's own:

    - `initial(start, n, rng)` draws n particles of the first frame.
    - `propagate(state, rng)` draws the next frame of each particle.
    - `diffuse(state, share, rng)` perturbs the particles within a frame by a share of the process noise.
    - `moved(state, poses)` replaces the particles' poses.

    Attributes:
        skeleton, fps: the body, and the frame rate [Hz].
        size: standard deviation of the log of the body's size relative to the skeleton; 0 if the size is known.
            Others are those of a `SizedPrior`.
    """

    skeleton: Skeleton
    fps: float
    size: float

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> Any:
        """Draw `n` particles of the first frame from `start`, with `rng`."""

    def propagate(self, state: Any, rng: np.random.Generator) -> Any:
        """Draw the next frame of each particle of `state`, with `rng`."""

    def diffuse(self, state: Any, share: float, rng: np.random.Generator) -> Any:
        """Perturb the particles of `state` within a frame by a fraction `share` of the process noise from `rng`."""

    def moved(self, state: Any, poses: np.ndarray) -> Any:
        """The particles of `state` with `poses` (N, 25) instead of their own; other variables are kept."""


class SizedPrior(Prior, Protocol):
    """A prior that can have a `size` above 0: particles of bodies of different sizes, and one method more.

    - `resized(state, sizes, centre)` changes sizes and distances alike.
    """

    def resized(self, state: Any, sizes: np.ndarray, centre: np.ndarray) -> Any:
        """The particles of `state` with other `sizes` (N,), and as much farther from the point `centre` (2,) [m]."""


@dataclass(frozen=True, eq=False)
class Start:
    """What is known of the first frame: weighted candidate poses and their uncertainty.

    Attributes:
        poses: (n, 25) [m, rad], candidates.
        log_weights: (n,), up to a constant.
        previous: (n, 25) one frame earlier; NaN if unknown.
        spread: (25,) standard deviation of each pose entry [m, rad].
        heights: (n,) standing heights of the candidates' bodies [m]; None if unknown, or that of the prior's skeleton.
    """

    poses: np.ndarray
    log_weights: np.ndarray
    previous: np.ndarray
    spread: np.ndarray
    heights: np.ndarray | None = None

    def __post_init__(self) -> None:
        poses = frozen(self.poses, (None, len(POSE)), "Start.poses")
        weights = frozen(self.log_weights, (len(poses),), "Start.log_weights")
        previous = frozen(self.previous, poses.shape, "Start.previous")
        spread = frozen(self.spread, (len(POSE),), "Start.spread")
        if not len(poses) or not np.isfinite(poses).all() or not np.isfinite(weights).any() or np.isnan(weights).any():
            raise MotionError("Start.poses must be finite, and at least one of Start.log_weights too")
        if not ((spread >= 0) & np.isfinite(spread)).all() or np.isinf(previous).any():
            raise MotionError("Start.spread must be finite and at least 0, and Start.previous finite or NaN")
        if self.heights is not None:
            object.__setattr__(self, "heights", frozen(self.heights, (len(poses),), "Start.heights"))
        for name, value in (("poses", poses), ("log_weights", weights), ("previous", previous), ("spread", spread)):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"Start({len(self.poses)} candidates)"

    @classmethod
    def at(cls, pose: ArrayLike, previous: ArrayLike | None = None, spread: ArrayLike = SPREAD) -> Start:
        """A start at one given `pose` (25,) [m, rad], with the pose one frame earlier, `previous`, or None.

        `spread` is (25,), or a number for all entries.

        Raises:
            MotionError: wrong shapes, or NaN in the pose.
        """
        pose = frozen(pose, (len(POSE),), "pose")
        previous = np.full(len(POSE), np.nan) if previous is None else frozen(previous, (len(POSE),), "previous")
        spread = np.broadcast_to(np.asarray(spread, dtype=np.float64), (len(POSE),))
        return cls(pose[None], np.zeros(1), previous[None], spread)

    def draw(self, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Draw `n` candidates by weight and spread with `rng`: indices (n,), poses (n, 25), previous poses (n, 25)."""
        weights = np.exp(self.log_weights - self.log_weights.max())
        which = systematic(weights, n, rng)
        noise = self.spread * rng.standard_normal((n, len(POSE)))
        return which, self.poses[which] + noise, self.previous[which] + noise


def deviations(values: ArrayLike, name: str) -> np.ndarray:
    """Standard deviations (25,) of pose entries, read-only; a MotionError about `name` unless finite and at least 0."""
    checked = frozen(values, (len(POSE),), name)
    if not ((checked >= 0) & np.isfinite(checked)).all():
        raise MotionError(f"{name} must be finite standard deviations of at least 0, got {checked.min()!r}")
    return checked


def tempered(scores: np.ndarray, effective: float) -> np.ndarray:
    """Weights (N,) exp(power · scores), with the highest power up to 1 that leaves `effective` effective ones.

    `scores` (N,) are up to a constant. The effective number is 1 / Σ w² of normalised weights w.
    """
    scores = scores - scores.max()
    low, high, power = 0.0, 2.0, 1.0  # tries 1 first
    while low < 1.0 and high - low > _FINE:
        weights = np.exp(power * scores)
        low, high = (power, high) if weights.sum() ** 2 / (weights**2).sum() >= effective else (low, power)
        power = 0.5 * (low + high)
    return np.exp(low * scores)


def systematic(weights: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Systematic resampling (Kitagawa 1996): indices (n,) drawn by `weights` (N,) with one random number of `rng`.

    Each index occurs n times its normalised weight, rounded up or down. Weights are at least 0, not all 0.
    """
    edges = np.cumsum(weights)
    points = (rng.random() + np.arange(n)) * (edges[-1] / n)
    return np.minimum(np.searchsorted(edges, points, side="right"), len(weights) - 1)
