"""TRC writer: marker positions for OpenSim, in millimetres and the axes of its ground (x forward, y up, z right).

The layout is that of OpenSim's documentation, "Marker (.trc) Files": five header lines, an empty one, then a row per
frame of its number, its time and three tab-separated coordinates per marker. Unknown markers are blank.
"""

from collections.abc import Iterator

import numpy as np

from motionenv.body.kinematics import markers as body_markers
from motionenv.errors import MotionError
from motionenv.mocap.writers.common import check_sequence, facing_x, opensim_axes
from motionenv.types import MARKERS, Markers, Motion

_MM = 1000.0
_TOGETHER = 500  # frames converted to text at a time
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
    return _parts(MARKERS, body_markers(turned.poses, turned.skeleton), motion.fps, motion.name)


def encode_markers(capture: Markers) -> Iterator[bytes]:
    """The bytes of a TRC file of captured points (frames, points, 3) [m]; a MotionError for names it can't hold."""
    if bad := [name for name in capture.names if not name.strip() or set(name) & set("\t\r\n")]:
        raise MotionError(f"a TRC file needs names of points without tabs and line ends, got {bad[0]!r}: rename it")
    return _parts(capture.names, capture.positions, capture.fps, capture.name)


def _parts(names: tuple[str, ...], positions: np.ndarray, fps: float, title: str) -> Iterator[bytes]:
    """The header, then the rows of positions (frames, points, 3) [m]."""
    points = _MM * opensim_axes(positions)
    yield _header(names, len(points), fps, title).encode()
    row = "\t".join(["%.5f"] * points[0].size)
    for start in range(0, len(points), _TOGETHER):
        some = np.round(points[start : start + _TOGETHER], 5) + 0.0  # no negative zeros
        flat = some.reshape(len(some), -1)
        gaps = np.isnan(flat.sum(1)).tolist()
        texts = [_gappy(v) if gap else row % tuple(v) for v, gap in zip(flat.tolist(), gaps, strict=True)]
        lines = [f"{i + 1}\t{i / fps:.6f}\t{text}\n" for i, text in enumerate(texts, start)]
        yield "".join(lines).encode()


def _gappy(values: list[float]) -> str:
    """Coordinates of a frame with gaps. OpenSim counts a blank last column only if a tab ends it."""
    text = "\t".join([f"{x:.5f}" if x == x else "" for x in values])
    return text if values[-1] == values[-1] else text + "\t"


def _header(names: tuple[str, ...], frames: int, fps: float, title: str) -> str:
    """The five header lines and the empty one."""
    rate = f"{fps:.10g}"
    values = rate, rate, str(frames), str(len(names)), "mm", rate, "1", str(frames)
    axes = [f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", f"{'_'.join(title.split()) or 'motion'}.trc"], _KEYS, values,
        ["Frame#", "Time", *(f"{name}\t\t" for name in names)], ["", "", *axes], [],
    ]  # fmt: skip
    return "".join("\t".join(line) + "\n" for line in lines)
