r"""Constant-velocity prior, independent for each pose parameter: the general prior of paper C, section 6 (its ref. 36).

    θ_t = θ_t-1 + θ̇_t / fps,    θ̇_t = θ̇_t-1 + η_t,    η_t ~ N(0, diag(σ²))

All smooth motions are likely, walking no more than others. As in the paper, joint limits are not enforced.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_choice, checked_fps
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.models.motion_tree.features import FPS, turned_towards
from motionenv.models.motion_tree.model import PARTS
from motionenv.models.transforms import resample
from motionenv.tracking.priors.base import Prior, Start, deviations
from motionenv.types import POSE, Motion, Skeleton

#: Standard deviations (25,) of η at 30 frames/s [m/s, rad/s]: root mean squares over 55 walks of 11 people (CMU), equal
#: for both sides.
CHANGE = np.array([
    0.08, 0.07, 0.08, 0.17, 0.12, 0.32, 0.47, 0.23, 0.43,
    *[0.38, 0.18, 0.57, 0.46] * 2, *[0.80, 0.30, 0.65, 1.60] * 2,
])  # fmt: skip
#: Standard deviations (25,) of an unknown θ̇ [m/s, rad/s], from the same walks.
VELOCITY = np.array([
    1.18, 0.18, 0.11, 0.19, 0.14, 0.35, 0.37, 0.20, 0.38,
    *[0.80, 0.27, 1.00, 0.76] * 2, *[1.90, 0.45, 0.80, 3.10] * 2,
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class MovingState:
    """Poses (N, 25) [m, rad] of N bodies, and velocities (N, 25) [m/s, rad/s] of the last step."""

    poses: np.ndarray
    velocities: np.ndarray
    sizes = None

    def take(self, which: np.ndarray) -> "MovingState":
        return MovingState(self.poses[which], self.velocities[which])


class VelocityPrior(Prior):
    """Bodies whose velocity is a random walk.

    Args:
        skeleton: the body; None uses one of 1.75 m.
        fps: frame rate [Hz].
        part: moving part, a key of `motionenv.models.motion_tree.model.PARTS`; other entries keep their start values.
        change: (25,) standard deviations of η at 30 frames/s [m/s, rad/s], for example from `velocity_change`; at other
            rates the variance is proportional to the time between frames. None uses those of captured walks.
        velocity: (25,) standard deviations of an unknown initial θ̇ [m/s, rad/s]; None as above.

    Attributes:
        moves: (25,) bool, which entries move.

    Raises:
        MotionError: an unknown `part`, or numbers out of range.
    """

    def __init__(
        self, *, skeleton: Skeleton | None = None, fps: float = 30.0, part: str = "body",
        change: np.ndarray | None = None, velocity: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        self.fps, self.size, self._part = checked_fps(fps), 0.0, part
        self.skeleton = from_height() if skeleton is None else skeleton
        self.moves = moving_entries(part)
        change = deviations(CHANGE if change is None else change, "change")
        self._change = change * self.moves * np.sqrt(FPS / self.fps)
        self._velocity = deviations(VELOCITY if velocity is None else velocity, "velocity") * self.moves

    def __repr__(self) -> str:
        return f"VelocityPrior({self._part}, {self.fps:g} fps)"

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> MovingState:
        """Draw `n` bodies from `start`; unknown velocities are drawn from their prior with `rng`."""
        row, poses, _ = start.draw(n, rng)
        poses = np.where(self.moves, poses, start.poses[row])
        unknown = self._velocity * rng.standard_normal((n, len(POSE)))
        said = turned_towards(start.poses - start.previous, np.zeros(len(POSE)))[row] * self.fps * self.moves
        noise = self._change * rng.standard_normal((n, len(POSE)))
        return MovingState(poses, np.where(np.isnan(said), unknown, said + noise))

    def propagate(self, state: MovingState, rng: np.random.Generator) -> MovingState:
        velocities = state.velocities + self._change * rng.standard_normal(state.poses.shape)
        return MovingState(state.poses + velocities / self.fps, velocities)

    def diffuse(self, state: MovingState, share: float, rng: np.random.Generator) -> MovingState:
        velocities = state.velocities + share * self._change * rng.standard_normal(state.poses.shape)
        return MovingState(state.poses + (velocities - state.velocities) / self.fps, velocities)

    def moved(self, state: MovingState, poses: np.ndarray) -> MovingState:
        """The bodies of `state` with other `poses` (N, 25) [m, rad]; velocities are updated accordingly."""
        poses = np.where(self.moves, poses, state.poses)
        return MovingState(poses, state.velocities + (poses - state.poses) * self.fps)


def velocity_change(motions: Iterable[Motion], fps: float = FPS) -> tuple[np.ndarray, np.ndarray]:
    """`change` and `velocity` of `VelocityPrior`: RMS (25,) of velocity changes per frame, and of velocities.

    `motions` (frames, 25) have any frame rate, and gaps; they are measured at `fps` [Hz].

    Raises:
        MotionError: no stretch of three frames without gaps.
    """
    stretches = [s for motion in motions for s in resample(motion, fps) if len(s) > 2]
    if not stretches:
        raise MotionError("velocity_change needs a motion of at least three frames without gaps")
    changes, velocities = (np.concatenate([np.diff(s, k, axis=0) * fps for s in stretches]) for k in (2, 1))
    return np.sqrt((changes**2).mean(0)), np.sqrt((velocities**2).mean(0))


def moving_entries(part: str) -> np.ndarray:
    """Which pose entries (25,) belong to a `part` of the body, a key of `PARTS`; raises MotionError for another."""
    return np.isin(np.arange(len(POSE)), PARTS[checked_choice(part, "part", PARTS)])
