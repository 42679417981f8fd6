"""Common parts of the writers: validation, and conversion to y-up files."""

import numpy as np

from motionenv.body.kinematics import forward
from motionenv.body.skeleton import LIMBS, SEGMENT_PARENT
from motionenv.errors import GapError, MotionError
from motionenv.types import POSE, Motion

_Y_UP = [1, 2, 0]


def y_up(points) -> np.ndarray:
    """World points (..., 3) in a y-up file's axes: x becomes z, left becomes x, up becomes y."""
    return np.asarray(points)[..., _Y_UP]


def y_up_turns(rotations) -> np.ndarray:
    """World rotations (..., 3, 3) in a y-up file's axes (see `y_up`)."""
    return np.asarray(rotations)[..., _Y_UP, :][..., _Y_UP]


def local_rotations(motion: Motion) -> np.ndarray:
    """Rotation of each segment relative to its parent, (frames, 12, 3, 3), axes as in the world.

    Args:
        motion: one sequence without gaps.
    """
    rotations = forward(motion.poses, motion.skeleton)[1]
    local = rotations.copy()
    for segment, parent in enumerate(SEGMENT_PARENT):
        if parent >= 0:
            local[:, segment] = rotations[:, parent].swapaxes(-1, -2) @ rotations[:, segment]
    return local


def check_sequence(motion: Motion, kind: str, *, gaps: bool) -> None:
    """Reject motions that a file can't represent, before anything is written.

    Args:
        motion: the motion.
        kind: name of the format, for messages.
        gaps: whether the format can represent missing values.

    Raises:
        MotionError: not one sequence of at least one frame, an infinite value, or another body's skeleton.
        GapError: a gap, if the format can't represent it; names the first.
    """
    if motion.poses.ndim != 2 or not len(motion.poses):
        problem = "holds one sequence of poses (frames, 25) with at least one frame"
        raise MotionError(f"a {kind} file {problem}, got {motion.poses.shape}: write batched sequences one by one")
    if len(motion.skeleton.radii) != len(LIMBS):
        raise MotionError(f"the skeleton must have radii for {len(LIMBS)} limbs, got {len(motion.skeleton.radii)}")
    bad = np.isinf(motion.poses) if gaps else ~np.isfinite(motion.poses)
    if not bad.any():
        return
    frame, entry = np.argwhere(bad)[0]
    where = f"{POSE[entry]} of frame {frame} is {motion.poses[frame, entry]}"
    if np.isnan(motion.poses[frame, entry]):
        count = int(bad.any(1).sum())
        raise GapError(
            f"{where}, and so are values of {count} frames: {kind} can't represent gaps, so fill or cut them first"
        )
    raise MotionError(f"{where}; poses must be finite, or NaN where unknown")
