"""TRC: Motion Analysis's tab-separated marker positions, also used by OpenSim."""

from pathlib import Path

import numpy as np

from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.readers.text import count, number, read_lines, unique
from motionenv.mocap.units_axes import metres_per, upright
from motionenv.types import Markers

_HEADER = ("DataRate", "NumFrames", "Units")
_CLOCK = 0.01  # relative tolerance between the Time column and the DataRate


def read(path, fps: float | None = None, unit: str | float | None = None, up: str = "y") -> Markers:
    """Read the markers of a TRC file; blanks and points at exactly (0, 0, 0) are gaps: NaN.

    Args:
        path: the file.
        fps: frame rate; overrides the file's "DataRate".
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per unit; overrides the file's "Units".
        up: the file's vertical axis, "x", "y" or "z". The format doesn't specify it; OpenSim's files are y up, others
            depend on the laboratory.

    Returns:
        Positions [m], z up, of every labelled marker. ("NumMarkers" is ignored: some files don't count virtual markers
        in it, others count unlabelled ones.) Repeated labels get "_2", "_3". The unlabelled trajectories that Cortex
        appends in varying columns are ignored.

    Raises:
        FormatError: a malformed file, or a frame rate or a unit that must be given; names the line.
    """
    lines = read_lines(path)
    header = _header(path, lines)
    names = _names(path, lines)
    first = _first_row(path, lines)
    rows = [(i, line) for i, line in enumerate(lines[first - 1 :], first) if line.strip()]
    frames = count(path, 3, header["NumFrames"], "NumFrames")
    if len(rows) != frames:
        raise FormatError(path, f"'NumFrames' says {frames}, but there are {len(rows)}", f"line {len(lines)}")
    values = np.array([_row(path, i, line, len(names)) for i, line in rows])
    fps = _fps(path, header["DataRate"], values[:, 1]) if fps is None else checked_fps(fps)
    points = values[:, 2:].reshape(frames, len(names), 3)
    gap = (points == 0).all(-1) | np.isnan(points).any(-1)
    points = np.where(gap[..., None], np.nan, points) * _scale(path, header["Units"], unit)
    return Markers(unique(names), upright(points, up), fps, name=Path(path).stem)


def _header(path, lines: list[str]) -> dict[str, str]:
    """The entries of the second line with their values in the third."""
    if not lines[0].lstrip().startswith("PathFileType"):
        raise FormatError(path, "must begin with PathFileType: this isn't a TRC file", "line 1")
    if len(lines) < 4:
        raise FormatError(path, "is truncated inside its header", f"line {len(lines)}")
    keys, values = lines[1].split(), lines[2].split()
    header = dict(zip(keys, values, strict=False))
    if missing := [key for key in _HEADER if key not in header]:
        raise FormatError(path, f"has no value for {', '.join(missing)}", "line 3")
    return header


def _names(path, lines: list[str]) -> list[str]:
    """The markers' labels, from the line that starts with "Frame#"."""
    words = [word.strip() for word in lines[3].split("\t")]
    if not words[0].lower().startswith("frame"):
        raise FormatError(path, f"expected the line of labels, which starts with Frame#, got {words[0]!r}", "line 4")
    names = [word for word in words[2:] if word]
    if not names:
        raise FormatError(path, "names no marker", "line 4")
    return names


def _first_row(path, lines: list[str]) -> int:
    """Index of the first line of data: the line of X1 Y1 Z1 and an empty one are optional."""
    for i, line in enumerate(lines[4:], 5):
        words = line.split()
        if words and words[0].upper() != "X1":
            return i
    raise FormatError(path, "has no data after its header: it is truncated", f"line {len(lines)}")


def _row(path, i: int, line: str, markers: int) -> list[float]:
    """Frame number, time and coordinates of one line; NaN for blanks."""
    words = line.split("\t")
    need = 2 + 3 * markers
    if len(words) < need:
        raise FormatError(path, f"expected {need} columns for {markers} markers, got {len(words)}", f"line {i}")
    words = [word.strip() for word in words[:need]]
    try:
        values = [float(word or "nan") for word in words]
    except ValueError:
        values = [np.inf]
    if np.isinf(values).any():
        values = [number(path, i, word, f"column {c}") if _filled(word) else np.nan for c, word in enumerate(words, 1)]
    return values


def _filled(word: str) -> bool:
    """False for all notations of a gap."""
    return word.lower() not in ("", "nan")


def _fps(path, rate: str, times: np.ndarray) -> float:
    """The file's frame rate, if its times agree."""
    fps = number(path, 3, rate, "DataRate")
    if fps <= 0:
        raise FormatError(path, f"'DataRate' must be above 0, got {rate!r}; pass fps= (--fps)", "line 3")
    took, expected = times[-1] - times[0], (len(times) - 1) / fps
    if not abs(took - expected) <= _CLOCK * expected + 0.001:
        problem = f"the times span {took:g} s, but 'DataRate' makes {expected:g} s of the frames; pass fps= (--fps)"
        raise FormatError(path, problem, "column 2")
    return fps


def _scale(path, written: str, unit) -> float:
    """Metres per file unit."""
    try:
        return metres_per(written if unit is None else unit)
    except MotionError as error:
        if unit is not None:
            raise
        raise FormatError(path, f"{error}; pass unit= (--unit)", "line 3") from None
