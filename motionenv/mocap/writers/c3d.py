"""C3D writer, with ezc3d: the body's 15 markers or captured points, with events and clinical angles beside them."""

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.body.kinematics import markers as body_markers
from motionenv.errors import MotionError
from motionenv.mocap.units_axes import METRES
from motionenv.mocap.writers._c3d_groups import add_events, add_measurements, angle_points
from motionenv.mocap.writers.common import Angles, check_sequence
from motionenv.types import MARKERS, Event, Markers, Motion, Recording

_MOST_FRAMES = 65535  # the header counts frames in 16 bits


def parts(motion: Motion, events: Sequence[Event] = (), angles: Angles | None = None) -> Iterator[bytes]:
    """The bytes of a C3D file of the 15 markers of `motionenv.types.MARKERS`, in one part: ezc3d can write only files.

    Millimetres as float32, z up and x forward (POINT:X_SCREEN +X, Y_SCREEN +Z); gaps have the residual -1. Events are
    written as Vicon's software writes them, angles as points with Plug-in Gait's names ("LKneeAngles").

    Args:
        motion: one sequence (frames, 25) of at most 65535 frames.
        events: of the motion, at most 255.
        angles: clinical angles of the motion [degrees]; a frame in which one of a joint's three is unknown is a gap.

    Raises:
        MotionError: not one sequence, too many frames or events, angles of other frames or without known names.
    """
    check_sequence(motion, "C3D", gaps=True)
    positions = body_markers(motion.poses, motion.skeleton) / METRES["mm"]
    file = _file(MARKERS, positions, angle_points(angles, len(motion.poses)), motion.fps, "mm")
    add_events(file, events, motion.fps, 1, "")
    return map(_written, [file])  # on demand, as writing may fail


def marker_parts(capture: Markers, events: Sequence[Event] = (), angles: Angles | None = None) -> Iterator[bytes]:
    """The bytes of a C3D file of captured points under their own names, in one part.

    The unit of length, the number of the first frame, the subject's name and the measurements of the group PROCESSING
    are those of `capture.recording`, if there is one; else millimetres and frame 1. z is up. Analogue channels and
    force plates aren't written. Without events, the recording's own are; otherwise arguments and errors are as those of
    `parts`, and too many points or one with the name of an angle are errors too.
    """
    recording = capture.recording or Recording(metres=0.001)
    unit = next((name for name, metres in METRES.items() if np.isclose(metres, recording.metres, rtol=1e-6)), "mm")
    frames = len(capture.positions)
    first = recording.first_frame if 1 <= recording.first_frame <= _MOST_FRAMES + 1 - frames else 1
    file = _file(capture.names, capture.positions / METRES[unit], angle_points(angles, frames), capture.fps, unit)
    file["header"]["points"]["first_frame"] = first - 1  # ezc3d counts from 0
    add_events(file, events or recording.events, capture.fps, first, recording.subject)
    if METRES[unit] == recording.metres:
        add_measurements(file, recording)
    return map(_written, [file])  # on demand, as writing may fail


def _file(names: tuple[str, ...], positions: np.ndarray, angles: dict[str, np.ndarray], fps: float, unit: str) -> Any:
    """The ezc3d representation of positions (frames, points, 3) [unit] and angles (frames, 3), NaN in gaps."""
    import ezc3d

    frames = len(positions)
    if frames > _MOST_FRAMES:
        raise MotionError(f"a C3D file has at most {_MOST_FRAMES} frames, got {frames}: write several files")
    if twice := sorted(set(names) & set(angles)):
        raise MotionError(f"there is a point with the name of an angle, {twice[0]}: rename it, or pass no angles")
    points = np.concatenate([positions, *(angle[:, None] for angle in angles.values())], axis=1).transpose(2, 1, 0)
    gap = np.isnan(points).any(0)
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["UNITS"]["value"] = [unit]
    point["RATE"]["value"] = [fps]
    _add_labels(file, [*names, *angles])
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    if angles:
        file.add_parameter("POINT", "ANGLES", list(angles))
        file.add_parameter("POINT", "ANGLE_UNITS", ["deg"])
    file["data"]["points"] = np.concatenate([np.where(gap, np.nan, points), np.ones((1, *gap.shape))])
    file["data"]["meta_points"]["residuals"] = np.where(gap, -1.0, 0.0)[None]
    file["data"]["meta_points"]["camera_masks"] = np.zeros((7, *gap.shape), dtype=bool)
    return file


def _add_labels(file: Any, labels: list[str]) -> None:
    """Name the points; the 256th and later in LABELS2, LABELS3, ..., as a parameter has at most 255 entries."""
    file["parameters"]["POINT"]["LABELS"]["value"] = labels[:255]
    for i, start in enumerate(range(255, len(labels), 255), 2):
        file.add_parameter("POINT", f"LABELS{i}", labels[start : start + 255])


def _written(file: Any) -> bytes:
    """The bytes that ezc3d writes, which can write only files whose names end in .c3d."""
    _, points, frames = file["data"]["points"].shape
    with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
        path = Path(folder) / "motion.c3d"
        file.write(str(path))
        return _whole(path.read_bytes(), frames * points * 16)


def _whole(raw: bytes, data: int) -> bytes:
    """`raw`, unless it is shorter than its header and `data` bytes, because ezc3d doesn't report a full disk."""
    blocks = int.from_bytes(raw[16:18], "little") - 1
    if blocks < 2 or len(raw) < 512 * blocks + data:
        raise OSError(f"ezc3d could write only {len(raw)} bytes: the disk is full or a limit is reached")
    return raw
