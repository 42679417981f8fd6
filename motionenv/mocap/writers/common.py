"""Common parts of the writers: validation, missing limbs, and conversion to y-up files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.files import atomic_write
from motionenv.body import gaps
from motionenv.body.kinematics import forward
from motionenv.body.skeleton import SEGMENT_PARENT
from motionenv.errors import GapError, MotionError
from motionenv.types import POSE, Motion

_Y_UP = [1, 2, 0]
_TOGETHER = 500  # frames converted to text at a time


class Angles(Protocol):
    """Joint angles that go beside a motion or capture, such as `motionenv.mocap.clinical.ClinicalAngles`."""

    @property
    def names(self) -> tuple[str, ...]:
        """One per column of `values`, such as "left_knee_flexion"."""

    @property
    def values(self) -> np.ndarray:
        """(frames, angles) [degrees], NaN where unknown."""


def y_up(points: ArrayLike) -> np.ndarray:
    """World points (..., 3) in a y-up file's axes: x becomes z, left becomes x, up becomes y."""
    return np.asarray(points)[..., _Y_UP]


def y_up_turns(rotations: ArrayLike) -> np.ndarray:
    """World rotations (..., 3, 3) in a y-up file's axes (see `y_up`)."""
    return np.asarray(rotations)[..., _Y_UP, :][..., _Y_UP]


def local_rotations(motion: Motion) -> np.ndarray:
    """Rotation of each segment relative to its parent, (frames, 12, 3, 3), axes as in the world; without gaps."""
    rotations = forward(motion.poses, motion.skeleton)[1]
    local = rotations.copy()
    for segment, parent in enumerate(SEGMENT_PARENT):
        if parent >= 0:
            local[:, segment] = rotations[:, parent].swapaxes(-1, -2) @ rotations[:, segment]
    return local


def shown_segments(poses: np.ndarray) -> np.ndarray:
    """Mask (12,) of the segments that poses (frames, 25) show, in the order of `motionenv.body.SEGMENTS`.

    A segment is missing if an entry that turns it, or the segment that carries it, is NaN in every frame: the head and
    the arms of a lower-body capture.
    """
    return gaps.known_segments(np.where(np.isnan(poses).all(0), np.nan, 0.0))


def without_missing(motion: Motion) -> Motion:
    """`motion` (frames, 25) with zeros for what `shown_segments` says is missing: the rest can do without NaN."""
    poses = np.where(_shown_entries(motion.poses), motion.poses, 0.0)
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def _shown_entries(poses) -> np.ndarray:
    """Mask (25,) of the entries that turn a segment that isn't missing."""
    shown = np.zeros(len(POSE), dtype=bool)
    for entries, segment_shown in zip(gaps.SEGMENT_ENTRIES, shown_segments(poses), strict=True):
        shown[entries] = segment_shown
    return shown


def check_sequence(motion: Motion, kind: str, *, gaps: bool) -> None:
    """Reject motions that a file of `kind` can't represent, before anything is written.

    Without `gaps`, the format can't represent missing values; limbs that are missing in every frame (see
    `shown_segments`) are fine all the same, because they are left out of the file.

    Raises:
        MotionError: not one sequence of at least one frame, or an infinite value.
        GapError: a gap, if the format can't represent it; names the first.
    """
    if motion.poses.ndim != 2 or not len(motion.poses):
        problem = "holds one sequence of poses (frames, 25) with at least one frame"
        raise MotionError(f"a {kind} file {problem}, got {motion.poses.shape}: write batched sequences one by one")
    _check_values(motion.poses, kind, gaps)


def _check_values(poses: np.ndarray, kind: str, gaps: bool) -> None:
    bad = np.isinf(poses)
    if bad.any():
        frame, entry = np.argwhere(bad)[0]
        problem = "poses must be finite, or NaN where unknown"
        raise MotionError(f"{POSE[entry]} of frame {frame} is {poses[frame, entry]}; {problem}")
    needed = _shown_entries(poses)
    needed[:6] = True  # nothing can be shown of a body whose place is unknown
    gap = np.isnan(poses) & needed
    if not gaps and gap.any():
        frame, entry = np.argwhere(gap)[0]
        count = int(gap.any(1).sum())
        raise GapError(
            f"{POSE[entry]} of frame {frame} is nan, and so are values of {count} frames: {kind} can't represent "
            "gaps, so fill or cut them first (motionenv.fill, --fill)"
        )


def checked_angles(angles: Angles, frames: int) -> dict[str, np.ndarray]:
    """The columns (frames,) [degrees] of angles by name; a MotionError unless they have one row per frame."""
    values = np.asarray(angles.values, dtype=np.float64)
    if values.shape != (frames, len(angles.names)):
        raise MotionError(
            f"angles.values must have shape ({frames}, {len(angles.names)}), one row per frame and one column per "
            f"name, got {values.shape}"
        )
    return dict(zip(angles.names, values.T, strict=True))


def text_rows(table: np.ndarray, decimals: int, line: Callable[[int, list[float]], str]) -> Iterator[bytes]:
    """The `line` of each row of a table (frames, columns), rounded to `decimals`, a few hundred rows at a time."""
    for start in range(0, len(table), _TOGETHER):
        some = np.round(table[start : start + _TOGETHER], decimals) + 0.0  # no negative zeros
        yield "".join([line(i, values) for i, values in enumerate(some.tolist(), start)]).encode()


def save(made: Iterable[bytes], path: str | Path) -> None:
    """Write the parts `made` of a file to `path`, whole or not at all; a MotionError if it can't be written."""
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        file.writelines(made)


def opensim_axes(points: ArrayLike) -> np.ndarray:
    """World points (..., 3) in the axes of OpenSim's ground: x forward, y up, z to the right."""
    points = np.asarray(points)
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def facing_x(motion: Motion) -> Motion:
    """`motion` (frames, 25) turned about the vertical through the world's origin by quarter turns, to face x most.

    OpenSim's models walk along x, and their pelvis_tilt and pelvis_list mean what they say only then. Quarter turns
    keep the laboratory's axes and, when the motion faces x already, its numbers.
    """
    heading = motion.poses[:, 5]
    known = heading[~np.isnan(heading)]
    mean = np.arctan2(np.sin(known).sum(), np.cos(known).sum())
    quarters = int(np.round(-mean / (np.pi / 2))) % 4
    if not quarters:
        return motion
    poses = motion.poses.copy()
    x, y = poses[:, 0].copy(), poses[:, 1].copy()
    poses[:, 0], poses[:, 1] = ((x, y), (-y, x), (-x, -y), (y, -x))[quarters]
    poses[:, 5] += quarters * np.pi / 2
    return Motion(poses, motion.skeleton, motion.fps, motion.name)
