"""What a filter needs of a prior over motion: particles to start with, and the next frame's given this one's."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import POSE, Skeleton, frozen

#: How uncertain a given pose is, if not told otherwise: positions [m], then angles [rad].
SPREAD = np.concatenate([np.full(3, 0.02), np.full(22, 0.03)])


class State(Protocol):
    """N particles: a frozen dataclass of arrays whose leading axis is N."""

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""

    def take(self, which: np.ndarray) -> Any:
        """The particles `which` (n,), in that order, again where a number comes again."""


class Prior(Protocol):
    """p(φ_0) and p(φ_t | φ_t-1) of papers A and C, for many particles at a time.

    Attributes:
        skeleton: the body that moves.
        fps: frames per second.
    """

    skeleton: Skeleton
    fps: float

    def initial(self, start: "Start", n: int, rng: np.random.Generator) -> Any:
        """`n` particles at the first frame."""

    def propagate(self, state: Any, rng: np.random.Generator) -> Any:
        """The particles one frame later."""

    def diffuse(self, state: Any, share: float, rng: np.random.Generator) -> Any:
        """The particles in the same frame, with `share` (0 to 1) of a step's noise: for annealing."""

    def moved(self, state: Any, poses: np.ndarray) -> Any:
        """The particles put in other `poses` (N, 25), with all else that they know."""


@dataclass(frozen=True, eq=False)
class Start:
    """What is known of the first frame: weighted poses, and how uncertain they are.

    Attributes:
        poses: (n, 25) [m, rad], candidates.
        log_weights: (n,), up to a constant.
        previous: (n, 25) one frame earlier; NaN where nothing is known of it.
        spread: (25,) standard deviation of each candidate's entries [m, rad].
    """

    poses: np.ndarray
    log_weights: np.ndarray
    previous: np.ndarray
    spread: np.ndarray

    def __post_init__(self):
        poses = frozen(self.poses, (None, len(POSE)), "Start.poses")
        weights = frozen(self.log_weights, (len(poses),), "Start.log_weights")
        previous = frozen(self.previous, poses.shape, "Start.previous")
        spread = frozen(self.spread, (len(POSE),), "Start.spread")
        if not len(poses) or not np.isfinite(poses).all() or not np.isfinite(weights).any() or np.isnan(weights).any():
            raise MotionError("Start needs poses without NaN, and a weight above 0 for one of them at least")
        if not ((spread >= 0) & np.isfinite(spread)).all() or np.isinf(previous).any():
            raise MotionError("Start.spread must be finite numbers from 0, and previous poses must not be infinite")
        for name, value in (("poses", poses), ("log_weights", weights), ("previous", previous), ("spread", spread)):
            object.__setattr__(self, name, value)

    @classmethod
    def at(cls, pose, previous=None, spread=SPREAD) -> "Start":
        """One given pose.

        Args:
            pose: (25,) [m, rad].
            previous: (25,) one frame earlier, or None.
            spread: (25,), or a number for all entries.

        Raises:
            MotionError: other shapes, or NaN in the pose.
        """
        pose = frozen(pose, (len(POSE),), "pose")
        previous = np.full(len(POSE), np.nan) if previous is None else frozen(previous, (len(POSE),), "previous")
        spread = np.broadcast_to(np.asarray(spread, dtype=np.float64), (len(POSE),))
        return cls(pose[None], np.zeros(1), previous[None], spread)

    def draw(self, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which candidates (n,), their poses (n, 25) and those before them (n, 25), by weight and spread.

        Args:
            n: how many.
            rng: of the draws.
        """
        weights = np.exp(self.log_weights - self.log_weights.max())
        which = systematic(weights, n, rng)
        noise = self.spread * rng.standard_normal((n, len(POSE)))
        return which, self.poses[which] + noise, self.previous[which] + noise


def systematic(weights: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (n,) drawn by `weights` (N,) with one random number (Kitagawa 1996).

    Each comes as often as its share of n says, rounded up or down.

    Args:
        weights: from 0, not all 0.
        n: how many.
        rng: of the draw.
    """
    edges = np.cumsum(weights)
    points = (rng.random() + np.arange(n)) * (edges[-1] / n)
    return np.minimum(np.searchsorted(edges, points, side="right"), len(weights) - 1)
