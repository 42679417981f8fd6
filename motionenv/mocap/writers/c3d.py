"""C3D writer: the body's 15 markers, with ezc3d."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from motionenv._core.files import atomic_write
from motionenv.body.kinematics import markers
from motionenv.errors import MotionError
from motionenv.mocap.writers.common import check_sequence
from motionenv.types import MARKERS, Motion

_MM = 1000.0
_MOST_FRAMES = 65535  # the header counts frames in 16 bits


def write(motion: Motion, path) -> None:
    """Write the 15 markers of `motionenv.types.MARKERS` as C3D, atomically.

    Millimetres as float32, z up and x forward (POINT:X_SCREEN +X, Y_SCREEN +Z); gaps have the residual -1.

    Args:
        motion: one sequence (frames, 25) of at most 65535 frames.
        path: the file.

    Raises:
        MotionError: not one sequence, too many frames, or the file can't be written.
    """
    file = _file(motion)
    with atomic_write(path) as temporary:
        _write(file, temporary, len(motion.poses))


def parts(motion: Motion) -> Iterator[bytes]:
    """The bytes that `write` writes, in one part: ezc3d can write only files.

    Raises:
        MotionError: not one sequence, or too many frames.
    """
    file = _file(motion)
    with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
        path = Path(folder) / "motion.c3d"
        _write(file, path, len(motion.poses))
        return iter([path.read_bytes()])


def _file(motion: Motion) -> Any:
    """The ezc3d representation of the file.

    Raises:
        MotionError: invalid arguments of `write`.
    """
    import ezc3d

    check_sequence(motion, "C3D", gaps=True)
    frames = len(motion.poses)
    if frames > _MOST_FRAMES:
        raise MotionError(f"a C3D file has at most {_MOST_FRAMES} frames, got {frames}: write several files")
    points = _MM * markers(motion.poses, motion.skeleton).transpose(2, 1, 0)
    gap = np.isnan(points).any(0)
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["LABELS"]["value"] = list(MARKERS)
    point["UNITS"]["value"] = ["mm"]
    point["RATE"]["value"] = [motion.fps]
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    file["data"]["points"] = np.concatenate([np.where(gap, np.nan, points), np.ones((1, *gap.shape))])
    file["data"]["meta_points"]["residuals"] = np.where(gap, -1.0, 0.0)[None]
    file["data"]["meta_points"]["camera_masks"] = np.zeros((7, *gap.shape), dtype=bool)
    return file


def _write(file: Any, path: Path, frames: int) -> None:
    """Write `file` with ezc3d, and check that it is complete.

    Raises:
        OSError: the disk is full.
    """
    file.write(str(path))
    _check_whole(path, frames * len(MARKERS) * 16)


def _check_whole(path: Path, data: int) -> None:
    """Raise if a file is shorter than its header and `data` bytes, because ezc3d doesn't report a full disk."""
    raw = path.read_bytes()
    blocks = int.from_bytes(raw[16:18], "little") - 1
    if blocks < 2 or len(raw) < 512 * blocks + data:
        raise OSError(f"ezc3d could write only {len(raw)} bytes: the disk is full or a limit is reached")
