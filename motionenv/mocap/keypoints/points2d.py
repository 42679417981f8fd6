"""2D points of one walker: keypoints of detectors, and tables (CSV) of the 15 markers.

A table has one row per frame, and each column's unit at the end of its name:

    time_s                                            seconds; or `frame`, whole numbers, which need fps
    head_x_m, head_y_m ... right_ankle_y_m            metres, y upwards;
    head_x_px, head_y_px ... right_ankle_y_px         or pixels, y downwards

Empty fields and skipped frames are gaps; markers without columns are missing.
"""

import csv
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write
from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.detections import MOST_FRAMES, in_frames
from motionenv.mocap.keypoints.detections import read as read_detections
from motionenv.mocap.keypoints.people import Track, chosen
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS, KeypointSet, keypoint_set
from motionenv.mocap.readers import trc
from motionenv.mocap.readers.text import number, read_lines
from motionenv.mocap.units_axes import metres_per
from motionenv.types import MARKERS, Points

#: Least score of a visible keypoint.
CONFIDENCE = 0.3
_JITTER = 0.25  # [frames] tolerance of a frame's time
_NORMALISED = 2.0  # largest coordinate relative to the picture, of points a little outside
_WRITTEN = {
    name.replace("left_", "l").replace("right_", "r").replace("_", ""): name
    for name in KEYPOINT_SETS["halpe-26"].keypoints
}
_WRITTEN |= {"hip": "mid_hip", "chip": "mid_hip", "head": "head_top"}  # in TRC files of Sports2D and Pose2Sim
_TALLEST = 10.0  # [m] extent from which a TRC file that says metres has pixels, as those of Sports2D


def read_points(
    path: str | Path, *, format: str | None = None, fps: float | None = None, unit: str | None = None,
    person: int | None = None, confidence: float = CONFIDENCE, size: tuple[int, int] | None = None,
) -> Points:  # fmt: skip
    """Read the 2D points of a walker: keypoints of a detector, or a table of the 15 markers (.csv).

    Keypoints come as JSON of COCO, OpenPose, MMPose, Ultralytics, AlphaPose or MediaPipe, in one file (.json) or a
    folder of files, one per frame (layouts: `motionenv.mocap.keypoints.detections`), or as TRC in pixels of Sports2D.
    They become markers by `motionenv.mocap.keypoints.skeletons`. Points are in pixels or, for any length unit, in
    metres, and named after the file.

    `confidence` of the points is the detector's score, at most 1. It ranks one detector's points and means something
    else in each: the height of a peak in a heat map (OpenPose, HRNet) or along the picture's axes (RTMPose), the
    probability of being visible (MediaPipe), an annotator's visibility. Tables and TRC have none.

    Args:
        path: the file or folder.
        format: the kind of keypoints, such as "halpe-26" (`skeletons.KEYPOINT_SETS`); None recognises it by number, and
            by the places that keypoints of upright people have.
        fps: frame rate [Hz]; required for JSON, overrides that of a table or TRC.
        unit: "px", or a length unit of `motionenv.mocap.units_axes.METRES`; overrides the unit of a table's columns.
            Keypoints are in pixels.
        person: which of several people; 0 has the longest and most confident track. None is an
            error if another is at least a quarter as long.
        confidence: least score of a visible keypoint.
        size: width and height of the picture [pixels], for coordinates relative to it, as MediaPipe's.

    Raises:
        FormatError: damaged, another format, or several people; names field, value and what was expected.
        MotionError: an argument out of range.
    """
    if fps is not None:
        fps = checked_fps(fps)
    if not 0 <= confidence <= 1:
        raise MotionError(f"confidence must be a score from 0 to 1, got {confidence!r}")
    scale = 1.0 if unit in (None, "px") else metres_per(unit)
    suffix, scores, feet = Path(path).suffix.lower(), None, None
    if suffix == ".json" or Path(path).is_dir():
        if fps is None:
            raise FormatError(path, "keypoints have no frame rate: pass fps= (--fps)")
        tracks, frames = read_detections(path)
        keypoints = _in_pixels(path, in_frames(chosen(path, tracks, person), frames), size)
        known = keypoint_set(path, keypoints, format)
        positions, scores = known.markers(keypoints, confidence)
        feet, found = known.feet(keypoints, confidence), "px"
    elif suffix not in (".csv", ".trc"):
        got = suffix or "no suffix"
        raise FormatError(path, f"must be keypoints (.json, .trc or a folder) or a table (.csv), got {got!r}")
    elif (person, format, size) != (None, None, None):
        raise MotionError(f"person, format and size are only for keypoints in JSON; {suffix} has one walker: omit them")
    else:
        positions, fps, found = (_read_trc if suffix == ".trc" else _read_table)(path, fps)
    shown = "px" if (unit or found) == "px" else "m"
    return Points(
        positions * scale, fps, shown, name=Path(path).stem, confidence=scores,
        feet=None if feet is None else feet * scale,
    )  # fmt: skip


def read_people(path: str | Path, fps: float, size: tuple[int, int]) -> list[Points]:
    """Points in pixels of everybody whom a detector saw, the longest and most confident track first.

    `path` and `fps` are as of `read_points`, and so are errors; `size` of the picture [pixels] is used for coordinates
    relative to it. Tables and TRC show one person.
    """
    if Path(path).suffix.lower() in (".csv", ".trc"):
        return [read_points(path, fps=fps)]
    return points_of(path, *read_detections(path), fps, size)


def points_of(
    path: str | Path, tracks: list[Track], frames: int, fps: float, size: tuple[int, int] | None = None
) -> list[Points]:
    """Points in pixels of `tracks` of people in a film of so many `frames`; all else is as of `read_people`."""
    people = [in_frames(track, frames) for track in tracks]
    relative = np.nanmax(np.abs(people[0][..., :2]), initial=0.0) <= _NORMALISED
    people = [_in_pixels(path, keypoints, size if relative else None) for keypoints in people]
    known = keypoint_set(path, people[0])
    made = [(*known.markers(keypoints, CONFIDENCE), known.feet(keypoints, CONFIDENCE)) for keypoints in people]
    name = Path(path).stem
    return [Points(places, fps, "px", None, name, scores, feet) for places, scores, feet in made]


def write_points(points: Points, path: str | Path) -> None:
    """Write `points` to a table (CSV) at `path`, atomically; `read_points` restores the positions exactly.

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


def _in_pixels(path, keypoints: np.ndarray, size) -> np.ndarray:
    """Keypoints (frames, n, 3) in pixels, of coordinates in pixels or, with `size`, relative to the picture."""
    largest = np.abs(keypoints[keypoints[..., 2] > 0, :2]).max(initial=0.0)
    if (largest <= _NORMALISED) != (size is not None) and largest > 0:
        problem = "relative to the picture: pass size=(width, height) (--size 1920x1080)"
        raise FormatError(path, f"has coordinates {problem if size is None else 'in pixels: omit size'}")
    if size is not None and (np.shape(size) != (2,) or not all(isinstance(side, int) and side > 0 for side in size)):
        raise MotionError(f"size must be width and height of the picture in pixels, got {size!r}")
    return keypoints * [*(size or (1, 1)), 1]


def _read_trc(path, fps: float | None) -> tuple[np.ndarray, float, str]:
    """Positions (frames, 15, 2), frame rate and unit of a TRC file whose z is 0, as Sports2D writes it."""
    points = trc.read(path, fps, unit=1.0, up="z")
    if np.nan_to_num(points.positions[..., 2]).any():
        raise FormatError(path, "has 3D points: project them with --project, or read them with motionenv.read")
    known = KeypointSet("trc", tuple(_WRITTEN.get(name.lower(), name) for name in points.names))
    seen = np.where(np.isnan(points.positions[..., :1]), np.nan, 1.0)
    positions, _ = known.markers(np.concatenate([points.positions[..., :2], seen], axis=-1), 0.0)
    if np.isnan(positions).all():
        raise FormatError(path, f"has no keypoints with known names, such as RKnee, got {', '.join(points.names[:5])}")
    tall = np.nanmax(positions[..., 1]) - np.nanmin(positions[..., 1])
    return positions, points.fps, "px" if tall > _TALLEST else "m"


def _read_table(path, fps: float | None) -> tuple[np.ndarray, float, str]:
    lines = read_lines(path)
    try:
        rows = [(i, row) for i, row in enumerate(csv.reader(lines, strict=True), 1) if any(w.strip() for w in row)]
    except csv.Error as error:
        raise FormatError(path, f"isn't a CSV file: {error}") from None
    header, rows = [word.strip() for word in rows[0][1]], rows[1:]
    unit, columns = _columns(path, header)
    if not 2 <= len(rows) <= MOST_FRAMES:
        raise FormatError(path, f"must hold 2 to {MOST_FRAMES} frames, got {len(rows)}")
    values = np.array([_row(path, i, row, header) for i, row in rows])
    if np.isnan(values[:, 0]).any():
        line = rows[np.isnan(values[:, 0]).argmax()][0]
        raise FormatError(path, f"{header[0]} must be there in every row", f"line {line}")
    frames, fps = _clock(path, header[0], values[:, 0], fps)
    positions = np.full((frames[-1] + 1, len(MARKERS), 2), np.nan)
    positions.reshape(len(positions), -1)[frames[:, None], columns] = values[:, 1:]
    positions[np.isnan(positions).any(axis=-1)] = np.nan
    return positions, fps, unit


def _columns(path, header: list[str]) -> tuple[str, np.ndarray]:
    """The unit, and the marker coordinate (0..29) of each column after the first one."""
    if header[0] not in ("time_s", "frame"):
        raise FormatError(path, f"the first column must be time_s or frame, got {header[0]!r}", "line 1")
    known = {f"{name}_{axis}": 2 * i + j for i, name in enumerate(MARKERS) for j, axis in enumerate("xy")}
    split = [name.rpartition("_") for name in header[1:]]
    if any(coordinate.endswith("_z") for coordinate, _, _ in split) or header[-1].lower().endswith("z"):
        raise FormatError(
            path, "has 3D points: project them with --project, or read them with motionenv.read", "line 1"
        )
    for coordinate, _, unit in split:
        if coordinate not in known or unit not in ("m", "px"):
            problem = f"columns must be like left_knee_x_m or left_knee_x_px, 2D, got {f'{coordinate}_{unit}'!r}"
            raise FormatError(path, problem, "line 1")
    units = {unit for _, _, unit in split}
    which = np.array([known[coordinate] for coordinate, _, _ in split], dtype=np.intp)
    if len(units) != 1 or sorted(which ^ 1) != sorted(set(which)):
        raise FormatError(path, "must have x and y of each of its markers once, all in m or all in px", "line 1")
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
    if not frames[-1] < MOST_FRAMES:
        raise FormatError(path, f"spans {frames[-1]:.3g} frames, more than {MOST_FRAMES}: cut the walk out", column)
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
