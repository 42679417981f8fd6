"""TRC: Motion Analysis's tab-separated marker positions, also used by OpenSim."""

import re
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.readers.text import given_fps, number, pointed, read_lines, unique
from motionenv.mocap.units_axes import stated_metres, upright, vertical_axis
from motionenv.types import Markers

_CLOCK = 0.01  # relative tolerance between the Time column and the DataRate
_AXIS = re.compile(r"[XYZ]\d*", re.IGNORECASE)
_EVEN = 0.1  # relative tolerance of the steps of the Time column, which is often rounded


def read(
    path: str | Path, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    override: bool = True,
) -> Markers:  # fmt: skip
    """Read the markers of a TRC file; blanks and points at exactly (0, 0, 0) are gaps: NaN.

    Decimal commas, missing or additional tabs, and columns separated by blanks are read too. "NumMarkers" is ignored:
    some files don't count virtual markers in it, others count unlabelled ones. "NumFrames" is ignored where it
    disagrees with the number of rows, but the times rise in even steps: programs that cut a trial leave it as it was.
    Repeated labels get "_2", "_3". The unlabelled trajectories that Cortex appends in varying columns are ignored.

    Args:
        path, fps, unit, override: as of `motionenv.mocap.read`; the file has "DataRate" and "Units".
        up: the file's vertical axis, "x", "y" or "z". The format doesn't specify it. None is the axis along which the
            points, of a standing or walking person, extend at least 1.5 times as far as along each other one; if there
            is none, "y", as in OpenSim's files.

    Raises:
        FormatError: a malformed file, or a frame rate or a unit that must be given; names the line.
    """
    lines = read_lines(path)
    header = _header(path, lines)
    names = _names(path, lines)
    first = _first_row(path, lines)
    rows = [(i, line) for i, line in enumerate(lines[first - 1 :], first) if line.strip()]
    values = np.array([_row(path, i, line, len(names)) for i, line in rows])
    if header.get("NumFrames", str(len(rows))) != str(len(rows)) and not _even(values[:, 1]):
        problem = f"'NumFrames' says {header['NumFrames']}, but there are {len(rows)}: it is truncated"
        raise FormatError(path, problem, f"line {len(lines)}")
    fps = given_fps(fps, override, lambda: _stated_fps(path, header.get("DataRate", ""), values[:, 1]))
    points = values[:, 2:].reshape(len(rows), len(names), 3)
    gap = (points == 0).all(-1) | np.isnan(points).any(-1)
    points = np.where(gap[..., None], np.nan, points)
    points = points * stated_metres(path, header.get("Units", ""), points, unit, override, "line 3")
    up = up or vertical_axis(points, "y")
    world = upright(points, up)
    if up == "y":  # OpenSim's ground: x forward, y up, z to the right
        world = world[..., [1, 0, 2]] * [1.0, -1.0, 1.0]
    return Markers(unique(names), world, fps, name=Path(path).stem)


def _header(path, lines: list[str]) -> dict[str, str]:
    if not lines[0].lstrip().startswith("PathFileType"):
        raise FormatError(path, "must begin with PathFileType: this isn't a TRC file", "line 1")
    if len(lines) < 4:
        raise FormatError(path, "is truncated inside its header", f"line {len(lines)}")
    return dict(zip(lines[1].split(), lines[2].split(), strict=False))


def _even(times: np.ndarray) -> bool:
    steps = np.diff(times)
    return len(steps) > 0 and bool((np.abs(steps - np.median(steps)) <= _EVEN * np.median(steps)).all())


def _words(line: str) -> list[str]:
    """The columns of a line: separated by tabs, or by blanks where there are no tabs."""
    return [word.strip() for word in line.split("\t")] if "\t" in line else line.split()


def _names(path, lines: list[str]) -> list[str]:
    words = _words(lines[3])
    if not words or not words[0].lower().startswith("frame"):
        got = words[0] if words else ""
        raise FormatError(path, f"expected the line of labels, which starts with Frame#, got {got!r}", "line 4")
    names = [word for word in words[2:] if word]
    if not names:
        raise FormatError(path, "names no marker", "line 4")
    return names


def _first_row(path, lines: list[str]) -> int:
    """Number of the first line of data: the line of X1 Y1 Z1, or X5 Y5 Z5, and an empty one are optional."""
    for i, line in enumerate(lines[4:], 5):
        words = line.split()
        if words and not _AXIS.fullmatch(words[0]):
            return i
    raise FormatError(path, "has no data after its header: it is truncated", f"line {len(lines)}")


def _row(path, i: int, line: str, markers: int) -> list[float]:
    """Frame number, time and coordinates of one line; NaN for blanks."""
    words = _words(line)
    need = 2 + 3 * markers
    if len(words) < need:
        raise FormatError(path, f"expected {need} columns for {markers} markers, got {len(words)}", f"line {i}")
    words = words[:need]
    try:
        values = [float(word or "nan") for word in words]
    except ValueError:
        values = [np.inf]
    if np.isinf(values).any():
        words = [pointed(word) for word in words]
        gap = lambda word: word.lower() in ("", "nan")
        values = [np.nan if gap(word) else number(path, i, word, f"column {c}") for c, word in enumerate(words, 1)]
    return values


def _stated_fps(path, written: str, times: np.ndarray) -> float:
    if not written:
        raise FormatError(path, "has no value for DataRate; pass fps= (--fps)", "line 3")
    fps = number(path, 3, pointed(written), "DataRate")
    if fps <= 0:
        raise FormatError(path, f"'DataRate' must be above 0, got {written!r}; pass fps= (--fps)", "line 3")
    took, expected = times[-1] - times[0], (len(times) - 1) / fps
    if not abs(took - expected) <= _CLOCK * expected + 0.001:
        problem = f"the times span {took:g} s, but 'DataRate' makes {expected:g} s of the frames; pass fps= (--fps)"
        raise FormatError(path, problem, "column 2")
    return fps
