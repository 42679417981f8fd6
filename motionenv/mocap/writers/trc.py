"""TRC writer: marker positions for OpenSim, in millimetres and the axes of its ground (x forward, y up, z right).

The layout is that of OpenSim's documentation, "Marker (.trc) Files": five header lines, an empty one, then a row per
frame of its number, its time and three tab-separated coordinates per marker. Unknown markers are blank.
"""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from motionenv.body.kinematics import markers as body_markers
from motionenv.errors import MotionError
from motionenv.mocap.writers.common import check_sequence, facing_x, opensim_axes, text_rows
from motionenv.types import MARKERS, Markers, Motion

_MM = 1000.0
_KEYS = (
    "DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames",
)  # fmt: skip


def encode(motion: Motion) -> Iterator[bytes]:
    """The bytes of a TRC file of the 15 markers of `motionenv.types.MARKERS`, a few hundred frames at a time.

    The walk (frames, 25) is turned by the quarter turns that bring it to face x most, as in the .mot file of the same
    motion; gaps become blanks. A MotionError if it isn't one sequence.
    """
    check_sequence(motion, "TRC", gaps=True)
    turned = facing_x(motion)
    return _file(MARKERS, body_markers(turned.poses, turned.skeleton), motion.fps, motion.name)


def encode_markers(capture: Markers) -> Iterator[bytes]:
    """The bytes of a TRC file of captured points (frames, points, 3) [m]; a MotionError for names it can't hold."""
    if bad := [name for name in capture.names if not name.strip() or set(name) & set("\t\r\n")]:
        raise MotionError(f"a TRC file needs names of points without tabs and line ends, got {bad[0]!r}: rename it")
    return _file(capture.names, capture.positions, capture.fps, capture.name)


def _file(names: tuple[str, ...], positions: np.ndarray, fps: float, title: str) -> Iterator[bytes]:
    table = _MM * opensim_axes(positions).reshape(len(positions), -1)
    row = "\t".join(["%.5f"] * table.shape[1])

    def line(i: int, values: list[float]) -> str:
        text = row % tuple(values)
        if "nan" in text:  # OpenSim counts a blank last column only if a tab ends it
            text = text.replace("nan", "") + ("\t" if text.endswith("nan") else "")
        return f"{i + 1}\t{i / fps:.6f}\t{text}\n"

    return chain([_header(names, len(table), fps, title).encode()], text_rows(table, 5, line))


def _header(names: tuple[str, ...], frames: int, fps: float, title: str) -> str:
    rate = f"{fps:.10g}"
    values = rate, rate, str(frames), str(len(names)), "mm", rate, "1", str(frames)
    axes = [f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", f"{'_'.join(title.split()) or 'motion'}.trc"], _KEYS, values,
        ["Frame#", "Time", *(f"{name}\t\t" for name in names)], ["", "", *axes], [],
    ]  # fmt: skip
    return "".join("\t".join(line) + "\n" for line in lines)
