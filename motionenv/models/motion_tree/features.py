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

from motionenv.errors import MotionError
from motionenv.models.motion_tree.feature_kernels import parameters_of

#: Frames per second of every database (paper C, fig. 5).
FPS = 30.0
#: Frames in a window (paper C: d = 10, a third of a second).
WINDOW = 10
#: Entries of the pose vector that a tree of a body part uses and predicts.
PARTS = {
    "body": tuple(range(25)), "lower": (*range(6), *range(17, 25)), "upper": tuple(range(6, 17)),
    "left_arm": tuple(range(9, 13)), "right_arm": tuple(range(13, 17)),
}  # fmt: skip

_TURN = 2 * np.pi


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
    before = np.asarray(before, dtype=np.float64)[..., None, :]
    out = np.array(steps, dtype=np.float64)
    c, s, (x, y) = np.cos(before[..., 5]), np.sin(before[..., 5]), np.moveaxis(out[..., :2].copy(), -1, 0)
    out[..., 0], out[..., 1] = before[..., 0] + c * x - s * y, before[..., 1] + s * x + c * y
    out[..., 5] += before[..., 5]
    return turned_towards(out, before)


def turned_towards(poses: ArrayLike, aim: ArrayLike) -> np.ndarray:
    """Poses (..., 25) with whole turns added to their angles so that each is within half a turn of `aim` (..., 25)."""
    turned = np.array(poses, dtype=np.float64)
    turned[..., 3:] -= _TURN * np.round((turned[..., 3:] - np.asarray(aim)[..., 3:]) / _TURN)
    return turned
