"""What one frame of a motion says, whatever the place and the heading (paper C, section 4).

The paper's frame has 50 parameters: 25 of the pose and their velocities. Where the person is and which way it faces
must not matter, so three of the 25 are increments since the frame before, seen in the heading frame of that frame:
forward, left [m] and heading [rad]. Height, tilt and obliquity of the pelvis and the 19 joint angles are as they are.
The other 25 are the velocities of these [per second], backward differences, so that nothing of the future is needed.

Angles that differ by whole turns are the same: parameters tell them within half a turn of the middle of the joint's
range (`motionenv.body.LIMITS`), and velocities are those of the shorter way.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from motionenv.errors import MotionError
from motionenv.models.tree._frame_kernels import MIDDLE, parameters_of, placed_poses
from motionenv.types import POSE, Motion, checked_fps

#: Frames per second of every database (paper C, fig. 5).
FPS = 30.0
#: Frames in a window (paper C: d = 10, a third of a second).
WINDOW = 10
#: Names of the parameters of a frame.
PARAMETERS = (*POSE, *(f"{name}_velocity" for name in POSE))

_TURN = 2 * np.pi
_IS_ANGLE = ~np.isnan(MIDDLE)
_MIDDLE = np.nan_to_num(MIDDLE)
_BALL_JOINTS = [POSE.index(n) for n in ("neck_flexion", "left_shoulder_flexion", "right_shoulder_flexion",
                                        "left_hip_flexion", "right_hip_flexion")]  # fmt: skip


def parameters(poses) -> np.ndarray:
    """The parameters (..., frames, 50) of the frames of motions at 30 frames/s, in the order of `PARAMETERS`.

    Args:
        poses: (..., frames, 25) [m, rad], two frames or more.

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


def local(before, now) -> np.ndarray:
    """Poses `now` (..., 25) as first 25 parameters: with increments since `before` (..., 25), one frame earlier."""
    before, now = np.broadcast_arrays(np.asarray(before, dtype=np.float64), np.asarray(now, dtype=np.float64))
    out = now.copy()
    c, s = np.cos(before[..., 5]), np.sin(before[..., 5])
    x, y = now[..., 0] - before[..., 0], now[..., 1] - before[..., 1]
    out[..., 0], out[..., 1] = c * x + s * y, c * y - s * x
    out[..., 5] -= before[..., 5]
    return out


def placed(before, steps) -> np.ndarray:
    """Poses (..., n, 25) in the world that come after `before` by `steps`, angles within half a turn of those before.

    Args:
        before: (..., 25) poses.
        steps: (..., n, 25), the first 25 parameters of frames that may come after each.
    """
    before = np.ascontiguousarray(before, dtype=np.float64)
    steps = np.ascontiguousarray(steps, dtype=np.float64)
    out = np.empty_like(steps)
    placed_poses(before.reshape(-1, 25), *(each.reshape(-1, *steps.shape[-2:]) for each in (steps, out)))
    return out


def turned_towards(poses, aim) -> np.ndarray:
    """Poses (..., 25) with whole turns added to their angles so that each is within half a turn of `aim` (..., 25)."""
    turned = np.array(poses, dtype=np.float64)
    turned[..., 3:] -= _TURN * np.round((turned[..., 3:] - np.asarray(aim)[..., 3:]) / _TURN)
    return turned


def resample(motion: Motion, fps: float = FPS) -> list[np.ndarray]:
    """The gapless stretches of a motion at another frame rate, each (frames, 25) [m, rad].

    Poses between frames come from cubic splines through the frames of a stretch; a frame with NaN in it ends one. A
    joint with three angles has two ways to tell each rotation, (f, a, r) and (f + π, π - a, r + π), and whole turns
    besides; each stretch is told in the way that is on average nearest to the middle of the joints' ranges.

    Args:
        motion: one sequence, (frames, 25).
        fps: frames per second to come.

    Raises:
        MotionError: a batch of motions, or a frame rate not above 0.
    """
    fps = checked_fps(fps)
    if motion.poses.ndim != 2:
        raise MotionError(f"resample one sequence at a time: (frames, 25), got {motion.poses.shape}")
    whole = np.isfinite(motion.poses).all(1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8)))
    return [
        _plainly_told(_at_rate(motion.poses[first:last], motion.fps, fps))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        if last - first > 1
    ]


def _at_rate(poses: np.ndarray, have: float, want: float) -> np.ndarray:
    """Poses (frames, 25) without gaps at `want` frames per second, from `have`; the first frame stays."""
    if np.isclose(have, want, rtol=1e-9):
        return poses.copy()
    frames = int(np.floor((len(poses) - 1) * want / have * (1 + 1e-12))) + 1
    return CubicSpline(np.arange(len(poses)) / have, poses)(np.arange(frames) / want)


def _plainly_told(poses: np.ndarray) -> np.ndarray:
    """Poses (frames, 25) with every ball joint told in the way that is nearest to the middle of its range."""
    told = poses - _TURN * np.round((poses.mean(0) - _MIDDLE) / _TURN) * _IS_ANGLE
    for at in _BALL_JOINTS:
        other = told[:, at : at + 3] * [1, -1, 1] + np.pi
        other -= _TURN * np.round((other.mean(0) - _MIDDLE[at : at + 3]) / _TURN)
        if _off(other, at) < _off(told[:, at : at + 3], at):
            told[:, at : at + 3] = other
    return told


def _off(angles: np.ndarray, at: int) -> float:
    """Mean squared distance [rad²] of a ball joint's angles (frames, 3) from the middle of their ranges."""
    return float(((angles - _MIDDLE[at : at + 3]) ** 2).mean())
