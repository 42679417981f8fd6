"""Parameters of the frames of a motion, independent of position and heading (paper C, section 4).

The paper's frame has 50 parameters: 25 of the pose, and their velocities. To be independent of position and heading,
three of the 25 are increments since the previous frame, in that frame's heading frame: forward, left [m] and heading
[rad]. Height, tilt and obliquity of the pelvis and the 19 joint angles are absolute. The velocities [per second] are
backward differences, which need no future frames.

Angles are wrapped to within half a turn of the middle of the joint's range (`motionenv.body.LIMITS`), and velocities
take the shorter way round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from motionenv._core.validation import checked_fps
from motionenv.errors import MotionError
from motionenv.models.motion_tree.feature_kernels import MIDDLE, parameters_of, placed_poses
from motionenv.types import POSE, Motion

#: Frames per second of every database (paper C, fig. 5).
FPS = 30.0
#: Frames in a window (paper C: d = 10, a third of a second).
WINDOW = 10

_TURN = 2 * np.pi
_IS_ANGLE = ~np.isnan(MIDDLE)
_MIDDLE = np.nan_to_num(MIDDLE)
_BALL_JOINTS = [POSE.index(n) for n in ("neck_flexion", "left_shoulder_flexion", "right_shoulder_flexion",
                                        "left_hip_flexion", "right_hip_flexion")]  # fmt: skip


def parameters(poses: ArrayLike) -> np.ndarray:
    """Parameters (..., frames, 50) of two poses or more (..., frames, 25) at 30 fps: of the pose, then velocities.

    Raises:
        MotionError: another shape.
    """
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim < 2 or poses.shape[-1] != 25 or poses.shape[-2] < 2:
        raise MotionError(f"poses must have shape (..., 2 or more frames, 25), got {poses.shape}")
    frames = poses.shape[-2]
    flat = np.ascontiguousarray(poses.reshape(-1, 25))
    out = np.empty((len(flat), 50))
    parameters_of(flat, np.arange(0, len(flat), frames), 0, len(flat), FPS, out)
    return out.reshape(*poses.shape[:-1], 50)


def local(before: ArrayLike, now: ArrayLike) -> np.ndarray:
    """The first 25 parameters of poses `now` (..., 25), with increments since `before` (..., 25), one frame earlier."""
    before, now = np.broadcast_arrays(np.asarray(before, dtype=np.float64), np.asarray(now, dtype=np.float64))
    out = now.copy()
    c, s = np.cos(before[..., 5]), np.sin(before[..., 5])
    x, y = now[..., 0] - before[..., 0], now[..., 1] - before[..., 1]
    out[..., 0], out[..., 1] = c * x + s * y, c * y - s * x
    out[..., 5] -= before[..., 5]
    return out


def placed(before: ArrayLike, steps: ArrayLike) -> np.ndarray:
    """Poses (..., n, 25) in the world after `steps` (..., n, 25), first 25 parameters, from `before` (..., 25).

    Angles are within half a turn of those before.
    """
    before = np.ascontiguousarray(before, dtype=np.float64)
    steps = np.ascontiguousarray(steps, dtype=np.float64)
    out = np.empty_like(steps)
    placed_poses(before.reshape(-1, 25), *(each.reshape(-1, *steps.shape[-2:]) for each in (steps, out)))
    return out


def turned_towards(poses: ArrayLike, aim: ArrayLike) -> np.ndarray:
    """Poses (..., 25) with whole turns added to their angles so that each is within half a turn of `aim` (..., 25)."""
    turned = np.array(poses, dtype=np.float64)
    turned[..., 3:] -= _TURN * np.round((turned[..., 3:] - np.asarray(aim)[..., 3:]) / _TURN)
    return turned


def resample(motion: Motion, fps: float = FPS) -> list[np.ndarray]:
    """The gapless stretches of one `motion` (frames, 25) at another rate `fps`, each (frames, 25) [m, rad].

    Cubic splines interpolate the poses of a stretch; a frame with NaN ends it. Three angles represent each rotation in
    two ways, (f, a, r) and (f + π, π - a, r + π), up to whole turns. Each stretch takes the one that is on average
    nearest to the middle of the joint's range.

    Raises:
        MotionError: a batch of motions, or a frame rate not above 0.
    """
    fps = checked_fps(fps)
    if motion.poses.ndim != 2:
        raise MotionError(f"resample one sequence at a time: (frames, 25), got {motion.poses.shape}")
    whole = np.isfinite(motion.poses).all(1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8)))
    return [
        _canonical(_at_rate(motion.poses[first:last], motion.fps, fps))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        if last - first > 1
    ]


def _at_rate(poses: np.ndarray, have: float, want: float) -> np.ndarray:
    """Resample gapless poses (frames, 25) from `have` to `want` frames per second, from the same first frame."""
    if np.isclose(have, want, rtol=1e-9):
        return poses.copy()
    frames = int(np.floor((len(poses) - 1) * want / have * (1 + 1e-12))) + 1
    return CubicSpline(np.arange(len(poses)) / have, poses)(np.arange(frames) / want)


def _canonical(poses: np.ndarray) -> np.ndarray:
    """Poses (frames, 25) with each ball joint's angles in the representation nearest to the middle of its range."""
    wrapped = poses - _TURN * np.round((poses.mean(0) - _MIDDLE) / _TURN) * _IS_ANGLE
    for at in _BALL_JOINTS:
        other = wrapped[:, at : at + 3] * [1, -1, 1] + np.pi
        other -= _TURN * np.round((other.mean(0) - _MIDDLE[at : at + 3]) / _TURN)
        if _off(other, at) < _off(wrapped[:, at : at + 3], at):
            wrapped[:, at : at + 3] = other
    return wrapped


def _off(angles: np.ndarray, at: int) -> float:
    """Mean squared distance [rad²] of a ball joint's angles (frames, 3) from the middle of their ranges."""
    return float(((angles - _MIDDLE[at : at + 3]) ** 2).mean())
