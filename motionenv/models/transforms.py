"""The same motion on a body of another height, and at another frame rate."""

from dataclasses import replace

import numpy as np

from motionenv._core.runs import runs
from motionenv._core.validation import checked_fps, checked_number
from motionenv.body.limbs import resized
from motionenv.body.skeleton import MIDDLE
from motionenv.errors import MotionError
from motionenv.types import HEIGHT_RANGE, POSE, Motion

_TURN = 2 * np.pi
_IS_ANGLE = ~np.isnan(MIDDLE)
_MIDDLE = np.nan_to_num(MIDDLE)
_BALL_JOINTS = [POSE.index(n) for n in ("neck_flexion", "left_shoulder_flexion", "right_shoulder_flexion",
                                        "left_hip_flexion", "right_hip_flexion")]  # fmt: skip


def scaled(motion: Motion, height: float) -> Motion:
    """The same motion of a body scaled to `height` [m]. Lengths and speeds scale; angles and times stay.

    Args:
        motion: any motion.
        height: body height [m], from 0.5 to 2.5.

    Raises:
        MotionError: `height` out of range.
    """
    checked_number(height, "height", *HEIGHT_RANGE)
    factor = height / motion.skeleton.height
    poses = motion.poses.copy()
    poses[..., :3] *= factor
    return replace(motion, poses=poses, skeleton=resized(motion.skeleton, height))


def resample(motion: Motion, fps: float = 30.0) -> list[np.ndarray]:
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
    pieces = [motion.poses[first:last] for first, last in runs(whole) if last - first > 1]
    return [_canonical(_at_rate(poses, motion.fps, fps)) for poses in pieces]


def _at_rate(poses: np.ndarray, have: float, want: float) -> np.ndarray:
    """Resample gapless poses (frames, 25) from `have` to `want` frames per second, from the same first frame."""
    if np.isclose(have, want, rtol=1e-9):
        return poses.copy()
    from scipy.interpolate import CubicSpline  # takes a tenth of a second

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
