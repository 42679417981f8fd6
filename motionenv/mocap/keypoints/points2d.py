"""2D points of one walker: COCO keypoints in JSON, and tables (CSV) of the 15 markers.

A table has one row per frame, and each column's unit at the end of its name:

    time_s                                            seconds; or `frame`, whole numbers, which need fps
    head_x_m, head_y_m ... right_ankle_y_m            metres, y upwards;
    head_x_px, head_y_px ... right_ankle_y_px         or pixels, y downwards

Empty fields and skipped frames are gaps; markers without columns are missing.

COCO's keypoints are converted to markers: shoulders, elbows, wrists, hips, knees and ankles directly; the pelvis is
midway between the hips; the sternum is 0.105 of the way from the centre of the shoulders to that of the hips (the mean
over CMU's walkers ± 0.014); the head is the centre of the ears, or the only visible ear, which suits side views, where
both coincide. The nose, a decimetre in front, isn't used: a gap is less harmful than a jump.
"""

import csv
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write
from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints import coco
from motionenv.mocap.readers.text import number, read_lines
from motionenv.mocap.units_axes import metres_per
from motionenv.types import MARKERS, Points

_STERNUM = 0.105  # fraction of the way from the centre of the shoulders to that of the hips
_JITTER = 0.25  # [frames] tolerance of a frame's time


def read_points(
    path, *, fps: float | None = None, unit: str | None = None, person: int | None = None, confidence: float = 0.3
) -> Points:
    """Read the 2D points of a walker: COCO keypoints (.json) or a table (.csv).

    Points are in pixels or, for any length unit, in metres, and named after the file.

    Args:
        path, person: the file, and which of several people; see `motionenv.mocap.keypoints.coco.read`.
        fps: frame rate [Hz]; required for COCO files, overrides the times of a table.
        unit: "px", or a length unit of `motionenv.mocap.units_axes.METRES`; overrides the unit of a table's columns.
            COCO's points are in pixels.
        confidence: least score of a visible COCO keypoint; visibility 1 and 2 count as visible, 0 doesn't.

    Raises:
        FormatError: damaged, another format, or several people; names field, value and what was expected.
        MotionError: an argument out of range.
    """
    if fps is not None:
        fps = checked_fps(fps)
    if not 0 <= confidence <= 1:
        raise MotionError(f"confidence must be a score from 0 to 1, got {confidence!r}")
    scale = 1.0 if unit in (None, "px") else metres_per(unit)
    suffix = Path(path).suffix.lower()
    if suffix == ".json":
        if fps is None:
            raise FormatError(path, "COCO keypoints have no frame rate: pass fps= (--fps)")
        positions, found = _from_keypoints(coco.read(path, person), confidence), "px"
    elif suffix == ".csv":
        if person is not None:
            raise MotionError(f"person is only for COCO files; a table has one walker: omit it, got {person!r}")
        positions, fps, found = _read_table(path, fps)
    else:
        raise FormatError(path, f"must be COCO keypoints (.json) or a table (.csv), got {suffix or 'no suffix'!r}")
    if unit is None or unit == "px":
        return Points(positions, fps, unit or found, name=Path(path).stem)
    return Points(positions * scale, fps, "m", name=Path(path).stem)


def write_points(points: Points, path) -> None:
    """Write points to a table (CSV) at `path`, atomically; `read_points` restores them exactly, but not their truth.

    Raises:
        MotionError: fewer than two frames, or the file can't be written.
    """
    frames = len(points.positions)
    if frames < 2:
        raise MotionError(f"a table needs at least two frames to define its frame rate, got {frames}")
    columns = [f"{name}_{axis}_{points.unit}" for name in MARKERS for axis in "xy"]
    table = np.column_stack([np.arange(frames) / points.fps, points.positions.reshape(frames, -1)])
    with atomic_write(path) as temporary, open(temporary, "w", encoding="ascii", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["time_s", *columns])
        rows.writerows([value if value == value else "" for value in row] for row in table.tolist())


def _from_keypoints(keypoints: np.ndarray, confidence: float) -> np.ndarray:
    """Positions (frames, 15, 2) of the markers from COCO's keypoints (frames, 17, 3)."""
    third = keypoints[..., 2]
    seen = (third >= confidence) & (third > 0)
    at = dict(
        zip(coco.KEYPOINTS, np.moveaxis(np.where(seen[..., None], keypoints[..., :2], np.nan), 1, 0), strict=True)
    )
    middle = lambda what: 0.5 * (at[f"left_{what}"] + at[f"right_{what}"])
    left, right = at["left_ear"], at["right_ear"]
    head = np.where(np.isnan(left), right, np.where(np.isnan(right), left, middle("ear")))
    pelvis, shoulders = middle("hip"), middle("shoulder")
    made = {"head": head, "pelvis": pelvis, "sternum": shoulders + _STERNUM * (pelvis - shoulders)}
    return np.stack([made[name] if name in made else at[name] for name in MARKERS], axis=1)


def _read_table(path, fps: float | None) -> tuple[np.ndarray, float, str]:
    """Positions (frames, 15, 2), frame rate and unit of a CSV table."""
    lines = read_lines(path)
    try:
        rows = [(i, row) for i, row in enumerate(csv.reader(lines, strict=True), 1) if any(w.strip() for w in row)]
    except csv.Error as error:
        raise FormatError(path, f"isn't a CSV file: {error}") from None
    header, rows = [word.strip() for word in rows[0][1]], rows[1:]
    unit, columns = _columns(path, header)
    if not 2 <= len(rows) <= coco.MOST_FRAMES:
        raise FormatError(path, f"must hold 2 to {coco.MOST_FRAMES} frames, got {len(rows)}")
    values = np.array([_row(path, i, row, header) for i, row in rows])
    if np.isnan(values[:, 0]).any():
        raise FormatError(
            path, f"{header[0]} must be there in every row", f"line {rows[np.isnan(values[:, 0]).argmax()][0]}"
        )
    frames, fps = _clock(path, header[0], values[:, 0], fps)
    positions = np.full((frames[-1] + 1, len(MARKERS), 2), np.nan)
    positions.reshape(len(positions), -1)[frames[:, None], columns] = values[:, 1:]
    positions[np.isnan(positions).any(axis=-1)] = np.nan
    return positions, fps, unit


def _columns(path, header: list[str]) -> tuple[str, np.ndarray]:
    """The unit, and the marker coordinate (0..29) of each column after the first one."""
    if header[0] not in ("time_s", "frame"):
        raise FormatError(path, f"the first column must be time_s or frame, got {header[0]!r}", "line 1")
    if len(set(header)) != len(header):
        raise FormatError(path, f"has the column {next(h for h in header if header.count(h) > 1)!r} twice", "line 1")
    if any(name.endswith(("_z_m", "_z_px")) for name in header):
        raise FormatError(path, "has columns of z: these are 3D points, project them first", "line 1")
    known = {f"{name}_{axis}": 2 * i + j for i, name in enumerate(MARKERS) for j, axis in enumerate("xy")}
    split = [name.rpartition("_") for name in header[1:]]
    for coordinate, _, unit in split:
        if coordinate not in known or unit not in ("m", "px"):
            problem = f"columns must have names like left_knee_x_m or left_knee_x_px, got {f'{coordinate}_{unit}'!r}"
            raise FormatError(path, problem, "line 1")
    units = {unit for _, _, unit in split}
    which = np.array([known[coordinate] for coordinate, _, _ in split], dtype=np.intp)
    if len(units) != 1 or set(which ^ 1) != set(which):
        raise FormatError(path, "must have x and y of each of its markers, all in m or all in px", "line 1")
    return units.pop(), which


def _row(path, line: int, row: list[str], header: list[str]) -> list[float]:
    if len(row) != len(header):
        raise FormatError(path, f"expected {len(header)} columns as in line 1, got {len(row)}", f"line {line}")
    return [number(path, line, word, name) if word.strip() else np.nan for word, name in zip(row, header, strict=True)]


def _clock(path, column: str, values: np.ndarray, fps: float | None) -> tuple[np.ndarray, float]:
    """Frame number of each row, from 0, and the frame rate, from times [s] or frame numbers."""
    steps = np.diff(values)
    if not (steps > 0).all():
        raise FormatError(path, f"{column} must grow from row to row, see row {(steps <= 0).argmax() + 2} of the data")
    if column == "frame" and fps is None:
        raise FormatError(path, "has frames but no times: pass fps= (--fps)")
    step = 1.0 if column == "frame" else float(np.median(steps))
    frames = np.concatenate([[0.0], np.cumsum(np.rint(steps / step))])
    if not frames[-1] < coco.MOST_FRAMES:
        raise FormatError(
            path, f"spans {frames[-1]:.3g} frames, more than {coco.MOST_FRAMES}: cut the walk out", column
        )
    took = (values[-1] - values[0]) / max(frames[-1], 1.0)
    if not np.abs(values - values[0] - frames * took).max() <= (1e-6 if column == "frame" else _JITTER * took):
        raise FormatError(path, f"{column} isn't regular: resample to a constant frame rate", column)
    return frames.astype(np.intp), (_rate(values, frames) if fps is None else fps)


def _rate(times: np.ndarray, frames: np.ndarray) -> float:
    """The frame rate with the fewest digits that reproduces these times exactly, or else their mean rate."""
    mean = float(frames[-1] / (times[-1] - times[0]))
    ntsc = round(mean * 1.001) / 1.001, round(mean * 1.001) * 1000 / 1001
    near = [*(float(f"{mean:.{n}g}") for n in range(1, 18)), *ntsc, np.nextafter(mean, 0), np.nextafter(mean, np.inf)]
    return next((float(f) for f in near if f > 0 and np.array_equal(frames / f, times)), mean)
