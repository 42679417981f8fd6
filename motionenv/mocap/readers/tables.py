"""Tables of points over time: Qualisys's TSV, OptiTrack Motive's CSV (1.2x), and any CSV of positions.

Which of them a file is shows in its first line. A plain table has a header line with a column of the time ("time",
"t_ms", "Time (s)") or of frame numbers, and the columns of points: "hip_x", "hip.y", "HipZ", "hip_x_mm" or "hip X [m]".
"""

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.readers.text import given_fps, number, pointed, read_lines, unique
from motionenv.mocap.units_axes import METRES, PEOPLE, box, stated_metres, unit_proposal, upright, vertical_axis
from motionenv.types import Markers

_POINT = re.compile(r"(.*?)[\s_.-]*([xyz])(?:[\s_]*[\[(]?(mm|cm|dm|m)[\])]?)?", re.IGNORECASE)
_TIME = re.compile(r"(?:time|t|timestamp|seconds)[\s_]*[\[(]?(ms|milliseconds|s|sec|seconds)?[\])]?", re.IGNORECASE)
_FRAME = re.compile(r"frames?|frame[\s_]?(?:#|no\.?|number|index)|index", re.IGNORECASE)
_GAPS = ("", "nan", "null", "na", "none")
_USUAL = ("m", "cm", "mm")  # at most one of them makes a person of people's size
_EVEN = 0.25  # of a step, deviation of a step in time
_WHOLE = 5e-4  # relative deviation of a frame rate from a whole number


@dataclass
class _Table:
    names: list[str]
    points: np.ndarray  # (frames, points, 3) [file units]
    fps: Callable[[], float]  # what the file states, or a FormatError
    unit: str = ""
    up: str = ""
    notes: tuple[str, ...] = ()


def read(
    path: str | Path, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    override: bool = True,
) -> Markers:  # fmt: skip
    """Read the points of a table: Qualisys's TSV, Motive's CSV, or a plain one. Blanks and (0, 0, 0) are gaps: NaN.

    Of Motive's files, the positions of bones, rigid bodies and labelled markers are read; measured markers go before
    those of the same name that a body's fit gives.

    Args:
        path, fps, override: as of `motionenv.mocap.read`.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres. Motive's files state it, and Qualisys's are in
            millimetres. None takes what a plain table's columns state, or else that of m, cm and mm in which the points
            are of a person's size, with a note.
        up: the file's vertical axis, "x", "y" or "z". None is "y" for Motive, for others the axis along which people
            extend, or "z".

    Raises:
        FormatError: none of these tables, a malformed one, or a frame rate or unit that must be given; names the line.
    """
    lines = read_lines(path)
    start = lines[0].lstrip()
    parse = _motive if start.startswith("Format Version") else _qualisys if start.startswith("NO_OF_") else _plain
    table = parse(path, lines)
    gap = np.isnan(table.points).any(-1) | (table.points == 0).all(-1)
    points = np.where(gap[..., None], np.nan, table.points)
    stated, notes = table.unit, table.notes
    if not stated and unit is None:
        stated, note = _fitting_unit(path, points)
        notes = (*notes, note)
    points = points * stated_metres(path, stated, points, unit, override, "line 1")
    world = upright(points, up or table.up or vertical_axis(points, "z"))
    return Markers(unique(table.names), world, given_fps(fps, override, table.fps), name=Path(path).stem, notes=notes)


def _fitting_unit(path, points: np.ndarray) -> tuple[str, str]:
    """The unit in which points (frames, points, 3) are of a person's size, and a note that says so."""
    low, high = PEOPLE
    for unit in _USUAL:
        if low <= (size := box(points).max() * METRES[unit]) <= high:
            return unit, f"the file doesn't state its unit: in {unit} the points span {size:.2f} m, which fits a person"
    raise FormatError(path, f"doesn't state its unit of length; {unit_proposal(points)}", "line 1")


def _qualisys(path, lines: list[str]) -> _Table:
    """Header lines of a keyword and its values, perhaps a line of columns, and rows with or without frame and time."""
    rows = _rows(path, lines, "\t")
    first = next((at for at, (_, row) in enumerate(rows) if _is_number(row[0])), len(rows))
    header = {row[0].strip().upper(): [word.strip() for word in row[1:]] for _, row in rows[:first]}
    names = [name for name in header.get("MARKER_NAMES", []) if name]
    if not names:
        kind = " ".join(header.get("DATA_INCLUDED", []))
        raise FormatError(
            path, f"has no MARKER_NAMES: export 3D data from Qualisys Track Manager, not {kind or 'others'}"
        )
    if first == len(rows):
        raise FormatError(path, "has no data after its header: it is truncated", f"line {len(lines)}")
    begin = 2 if len(rows[first][1]) >= 3 * len(names) + 2 else 0
    columns = range(begin, begin + 3 * len(names))
    points = _values(path, rows[first:], columns, [f"column {c + 1}" for c in columns])
    said = (header.get("NO_OF_FRAMES") or [""])[0]
    notes: tuple[str, ...] = ()
    if said.isdigit() and int(said) != len(points):
        if abs(int(said) - len(points)) > 1:
            raise FormatError(path, f"NO_OF_FRAMES says {said}, but there are {len(points)}", f"line {len(lines)}")
        notes = (f"NO_OF_FRAMES says {said}, but there are {len(points)}: all are read",)
    rate = lambda: _stated(path, (header.get("FREQUENCY") or [""])[0], "FREQUENCY")
    return _Table(names, points.reshape(len(points), -1, 3), rate, "mm", notes=notes)


def _motive(path, lines: list[str]) -> _Table:
    """A line of keywords and values in turn, lines that say what the columns are, and rows of frame, time, values."""
    rows = [(i, [word.strip() for word in row]) for i, row in _rows(path, lines, ",")]
    about = dict(zip(rows[0][1][::2], rows[0][1][1::2], strict=False))
    at = next((at for at, (_, row) in enumerate(rows) if row[0].lower() == "frame"), None)
    if at is None or at < 4 or at + 1 == len(rows):
        raise FormatError(path, "has no line that begins with Frame, after those of types and names, and data after it")
    heads = [row for _, row in rows[1:at]]
    width = len(rows[at][1])
    label = lambda key, usual: next((row for row in heads if row[1:2] == [key]), heads[usual])
    kinds, names, what = (row + [""] * width for row in (label("Type", 0), label("Name", 1), heads[-1]))
    axes = [axis.upper() for axis in rows[at][1]]
    found = [c for c in range(2, width - 2) if what[c : c + 3] == ["Position"] * 3 and axes[c : c + 3] == [*"XYZ"]]
    if not found:
        raise FormatError(path, "has no positions: export markers or bones with their positions", f"line {rows[at][0]}")
    if about.get("Coordinate Space", "Global").lower() == "local" and any(kinds[c] == "Bone" for c in found):
        raise FormatError(
            path, "has bones relative to each other: export it with the coordinate space Global", "line 1"
        )
    measured = {names[c] for c in found if kinds[c] == "Marker"}
    keep = [
        c for c in found
        if not names[c].startswith("Unlabeled") and (names[c] not in measured or kinds[c] == "Marker")
    ]  # fmt: skip
    columns = [c + axis for c in keep for axis in range(3)]
    data = [(i, row + [""] * (width - len(row))) for i, row in rows[at + 1 :]]
    points = _values(path, data, columns, [f"{names[c]} {axis}" for c in keep for axis in "XYZ"])
    rate = about.get("Export Frame Rate") or about.get("Capture Frame Rate") or ""
    unit = about.get("Length Units") or "m"
    fps = lambda: _stated(path, rate, "Export Frame Rate")
    return _Table([names[c] for c in keep], points.reshape(len(points), -1, 3), fps, unit, "y")


def _plain(path, lines: list[str]) -> _Table:
    delimiter = max(",;\t", key=lines[0].count)
    rows = _rows(path, lines, delimiter)
    header = [word.strip() for word in rows[0][1]]
    columns, units = _triples(path, header)
    if len(rows) < 2:
        raise FormatError(path, "has no data after its header: it is truncated", f"line {len(lines)}")
    flat = [c for three in columns.values() for c in three]
    points = _values(path, rows[1:], flat, [header[c] for c in flat])
    clock = next((c for kind in (_TIME, _FRAME) for c, word in enumerate(header) if kind.fullmatch(word)), None)
    times = np.arange(len(points)) if clock is None else _values(path, rows[1:], [clock], [header[clock]])[:, 0]
    if _leaves_out(times):
        raise FormatError(path, f"{header[clock or 0]} must grow in even steps: resample or add lines", "line 2")

    def rate() -> float:
        if clock is None or not (kind := _TIME.fullmatch(header[clock])):
            raise FormatError(path, "has no column of times, such as time: pass fps= (--fps)", "line 1")
        return _rate(path, times * (1e-3 if (kind[1] or "").lower().startswith("m") else 1.0), header[clock])

    unit = units.pop().lower() if len(units) == 1 else ""
    return _Table(list(columns), points.reshape(len(points), -1, 3), rate, unit)


def _triples(path, header: list[str]) -> tuple[dict[str, list[int]], set[str]]:
    """The columns of x, y and z of each point, and the units that they state."""
    found: dict[str, dict[str, int]] = {}
    units = set()
    for c, word in enumerate(header):
        if (named := _POINT.fullmatch(word)) and named[1]:
            found.setdefault(named[1], {}).setdefault(named[2].lower(), c)
            units.add(named[3] or "")
    columns = {name: [axes[axis] for axis in "xyz"] for name, axes in found.items() if len(axes) == 3}
    if columns:
        return columns, units
    if all(_is_number(word) for word in header if word):
        raise FormatError(
            path, "has no header line with the names of its columns, such as time,hip_x,hip_y,hip_z", "line 1"
        )
    if any({"x", "y"} <= axes.keys() for axes in found.values()):
        raise FormatError(
            path,
            "has 2D points: lift them (motionenv lift, without --project), or read them with motionenv.read_points",
            "line 1",
        )
    raise FormatError(path, "is no table of points: expected columns such as time,hip_x,hip_y,hip_z", "line 1")


def _rows(path, lines: list[str], delimiter: str) -> list[tuple[int, list[str]]]:
    """The lines that aren't blank, with their numbers, in columns."""
    try:
        rows = [
            (i, row) for i, row in enumerate(csv.reader(lines, delimiter=delimiter), 1) if any(w.strip() for w in row)
        ]
    except csv.Error as error:
        raise FormatError(path, f"isn't a table in columns: {error}") from None
    return rows


def _values(path, rows: Sequence[tuple[int, list[str]]], columns: Sequence[int], names: Sequence[str]) -> np.ndarray:
    """The numbers (rows, columns) in some columns; NaN for blanks."""
    values = np.empty((len(rows), len(columns)))
    for at, (line, row) in enumerate(rows):
        if len(row) <= max(columns):
            raise FormatError(path, f"expected {max(columns) + 1} columns, got {len(row)}", f"line {line}")
        words = [row[c].strip() for c in columns]
        try:
            values[at] = [float(word or "nan") for word in words]
        except ValueError:
            values[at] = np.inf
        if np.isinf(values[at]).any():
            values[at] = [
                np.nan if word.lower() in _GAPS else number(path, line, pointed(word), name)
                for word, name in zip(words, names, strict=True)
            ]
    return values


def _is_number(word: str) -> bool:
    try:
        float(pointed(word.strip()))
    except ValueError:
        return False
    return True


def _stated(path, word: str, key: str) -> float:
    if not _is_number(word) or not 0 < float(pointed(word)) < np.inf:
        raise FormatError(path, f"{key} must be above 0, got {word!r}; pass fps= (--fps)", "line 1")
    return float(pointed(word))


def _leaves_out(times: np.ndarray) -> bool:
    """Whether times, or numbers of frames, go back or leave some out; rounded ones that repeat may jump by a digit."""
    steps = np.diff(times)
    digit = steps[steps > 0].min(initial=np.inf) if (steps == 0).any() else 0.0
    return len(steps) > 0 and not (0 <= steps.min() and steps.max() < 1.5 * steps.mean() + digit)


def _rate(path, times: np.ndarray, column: str) -> float:
    """The frame rate of even times [s], whole if it nearly is."""
    steps = np.diff(times)
    step = float(np.median(steps)) if len(steps) else np.nan
    if not 0 < step <= 1 or not (np.abs(steps - step) <= _EVEN * step).all():
        raise FormatError(path, f"{column} must grow in even steps of at most a second: pass fps= (--fps)", "line 2")
    mean = len(steps) / float(times[-1] - times[0])
    return float(round(mean)) if abs(mean - round(mean)) <= _WHOLE * mean else mean
