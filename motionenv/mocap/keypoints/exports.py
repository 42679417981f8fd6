"""Keypoints that other programs export as text or arrays.

YOLO (Ultralytics, save_txt=True; ultralytics/engine/results.py): a file per frame with a line per person: class, box
(4), keypoints (x, y and score, or x and y, relative to the picture), and perhaps the box's confidence and a track.
DeepLabCut's CSV: rows of scorer, individuals (of several animals only), bodyparts and coords; then a row per frame.
SLEAP's analysis CSV: track, frame_idx, instance.score, and x, y and score of each node; a row per person and frame.
VideoPose3D's data_2d_*.npz: "positions_2d" has arrays (frames, n, 2) by film or subject, by action, for each camera.
FreeMoCap's 2D data: an array (cameras, frames, n, 2 or more) whose first 33 points are MediaPipe's.
"""

import csv
import io
import pickle
import re
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.mocap.readers.text import number, read_bytes, read_lines

#: A frame or the name of its image, somebody's keypoints (n, 3), and an identity or None.
Detection = tuple[int | str, np.ndarray, Any]

_BOX = 5  # columns of a class and a box
_COUNTS = {len(known.keypoints) for known in KEYPOINT_SETS.values()}
_TITLES = {"scorer", "individuals", "bodyparts", "coords"}
_AXES = {"x": 0, "y": 1, "likelihood": 2, "score": 2}
_GAPS = ("", "nan")
_BODY, _HANDS = 33, 42  # FreeMoCap's arrays go on with two hands and the face
#: What pickled arrays consist of.
_SAFE = {("numpy.core.multiarray", "_reconstruct"), ("numpy.core.multiarray", "scalar"), ("numpy", "ndarray"),
         ("numpy", "dtype"), ("numpy.core.numeric", "_frombuffer"), ("_codecs", "encode")}  # fmt: skip
_PARTS = {name.removeprefix("left_").replace("_", ""): name.removeprefix("left_")
          for known in KEYPOINT_SETS.values() for name in known.keypoints if name.startswith("left_")}  # fmt: skip
_MIDDLE = {name.replace("_", ""): name for known in KEYPOINT_SETS.values() for name in known.keypoints
           if name and not name.startswith(("left_", "right_"))}  # fmt: skip
_MIDDLE |= {"hip": "mid_hip", "chip": "mid_hip", "pelvis": "mid_hip", "head": "head_top"}  # Sports2D's, Pose2Sim's


def keypoint_name(written: str) -> str:
    """The name in `skeletons.toml` of a keypoint that is written like RHip, hip_R, "Left Hip" or leftHip."""
    words = [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", written)]
    if len(words) == 1 and words[0][:1] in "lr" and words[0][1:] in _PARTS:
        words = [words[0][0], words[0][1:]]
    sides = [word for word in words if word in ("l", "left", "r", "right")]
    rest = "".join(word for word in words if word not in sides)
    if len(sides) == 1 and rest in _PARTS:
        return f"{'left' if sides[0].startswith('l') else 'right'}_{_PARTS[rest]}"
    return _MIDDLE.get(rest, written) if not sides else written


def yolo_people(path: Path) -> list[dict]:
    """The people in a frame's text file, with "keypoints" and perhaps "track_id"."""
    people = []
    for i, line in enumerate(path.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        words = line.split()
        values = [number(path, i, word, f"column {c}") for c, word in enumerate(words, 1)]
        fits = [(n, each, len(words) - _BOX - n * each) for each in (3, 2) for n in sorted(_COUNTS)]
        fits = [fit for fit in fits if 0 <= fit[2] <= 2]
        if words and not fits:
            problem = "must have a class, a box, and x, y and score of a person's keypoints (YOLO pose)"
            raise FormatError(path, f"{problem}, got {len(words)} columns", f"line {i}")
        if not words or values[0] != 0:  # 0 is a person
            continue
        n, each, more = min(fits, key=lambda fit: (-fit[1], fit[2]))
        points = np.ones((n, 3))
        points[:, :each] = np.reshape(values[_BOX : _BOX + n * each], (n, each))
        tracked = more == 2 or (more == 1 and words[-1].isdigit())
        people.append({"keypoints": points.ravel().tolist(), **({"track_id": int(values[-1])} if tracked else {})})
    return people


def is_export(path: str | Path) -> bool:
    """Whether a CSV file at `path` is DeepLabCut's or SLEAP's."""
    first = [word.strip(' "').lower() for word in read_lines(path)[0].split(",")]
    return first[0] in _TITLES or {"frame_idx", "instance.score"} <= set(first)


def table(path: str | Path) -> tuple[list[Detection], list[str]]:
    """Detections in a CSV file of DeepLabCut or SLEAP, and the names of the keypoints as of `keypoint_name`.

    Raises:
        FormatError: damaged, or no keypoint has a known name.
    """
    rows = [(i, [word.strip() for word in row]) for i, row in enumerate(csv.reader(read_lines(path)), 1) if any(row)]
    header = rows[0][1]
    if wrong := [(i, row) for i, row in rows if len(row) != len(header)]:
        raise FormatError(
            path, f"expected {len(header)} columns as in line 1, got {len(wrong[0][1])}", f"line {wrong[0][0]}"
        )
    titles = {row[0].lower(): row for _, row in rows[: len(_TITLES)] if row[0].lower() in _TITLES}
    if titles and not {"bodyparts", "coords"} <= set(titles):
        raise FormatError(path, f"must begin with DeepLabCut's rows scorer, bodyparts and coords, got {list(titles)}")
    if titles:  # somebody, keypoint and coordinate of each column
        who = titles.get("individuals", [""] * len(header))
        columns = list(zip(who, titles["bodyparts"], titles["coords"], strict=True))
        rows = rows[len(titles) :]
        index = next((c for c, column in enumerate(columns) if column[2] in _AXES), 1)  # pictures' paths may be split
        frames = [int(row[0]) if row[0].isdigit() else "/".join(row[:index]) for _, row in rows]
    else:
        columns, rows = [("", *name.rpartition(".")[::2]) for name in header], rows[1:]
        frames = [int(number(path, i, row[header.index("frame_idx")], "frame_idx")) for i, row in rows]
        columns[header.index("instance.score")] = ("", "", "")
    places = {c: column for c, column in enumerate(columns) if column[2] in _AXES}
    numbered = [dict.fromkeys(column[k] for column in places.values()) for k in (0, 1)]
    people, names = ({name: i for i, name in enumerate(found)} for found in numbered)
    known = [keypoint_name(name) for name in names]
    if not set(known) & {name for one in KEYPOINT_SETS.values() for name in one.keypoints}:
        raise FormatError(path, f"has no keypoints with known names, such as left_knee or RKnee, got {list(names)[:5]}")
    points = np.full((len(rows), len(people), len(names), 3), [np.nan, np.nan, 1.0])
    for c, (somebody, name, axis) in places.items():
        for k, (i, row) in enumerate(rows):
            if row[c].lower() not in _GAPS:
                points[k, people[somebody], names[name], _AXES[axis]] = number(path, i, row[c], f"column {c + 1}")
    tracks = [row[header.index("track")] if "track" in header else "" for _, row in rows]
    return [
        (frame, keypoints, somebody or track or None)
        for frame, track, everybody in zip(frames, tracks, points, strict=True)
        for somebody, keypoints in zip(people, everybody, strict=True)
        if not np.isnan(keypoints).any(axis=1).all()
    ], known


def holds_points(path: str | Path) -> bool:
    """Whether an NPZ file at `path` is VideoPose3D's."""
    try:
        with zipfile.ZipFile(path) as archive:
            return "positions_2d.npy" in archive.namelist()
    except (zipfile.BadZipFile, OSError):
        return False


def arrays(path: str | Path) -> list[Detection]:
    """Detections in arrays of VideoPose3D (.npz) or FreeMoCap (.npy); each film or camera is an identity.

    Raises:
        FormatError: damaged, 3D, or of another shape.
    """
    raw = read_bytes(path)
    try:
        if Path(path).suffix.lower() == ".npz":
            with zipfile.ZipFile(io.BytesIO(raw)) as archive:
                raw = archive.read("positions_2d.npy")
        found = list(_sequences(_array(raw), ""))
    except Exception as error:  # noqa: BLE001 damaged headers and pickles raise anything
        problem = "must be an array of 2D points (.npy), or VideoPose3D's data_2d_*.npz with positions_2d"
        raise FormatError(path, f"{problem}: {error}") from None
    return [(frame, keypoints, name if len(found) > 1 else None)
            for name, points in found for frame, keypoints in enumerate(_scored(path, points))]  # fmt: skip


def _scored(path, points: np.ndarray) -> np.ndarray:
    """Keypoints (frames, n, 3) of an array with or without scores."""
    if points.ndim != 3 or points.shape[2] not in (2, 3) or points.dtype.kind not in "fiu":
        raise FormatError(path, f"must have points (frames, n, 2 or 3), got {points.dtype} of shape {points.shape}")
    if points.shape[2] == 2:
        points = np.concatenate([points, np.ones_like(points[..., :1])], axis=2)
    elif ((points[..., 2] < 0) | (points[..., 2] > 1)).any():
        problem = "has 3D points, such as FreeMoCap's spatialXYZ: take its 2D data (..._pixelXY.npy)"
        raise FormatError(path, f"{problem}, or write them as .c3d, .trc or .csv and project these with --project")
    return points[:, : _BODY if points.shape[1] >= _BODY + _HANDS else None]


def _sequences(content: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """All arrays in dictionaries, lists and arrays of cameras, with the names on the way."""
    if isinstance(content, np.ndarray) and content.dtype == object:
        content = content.tolist()  # of one object, that
    if isinstance(content, np.ndarray) and content.ndim == 4:
        content = list(content[..., :2])
    if isinstance(content, np.ndarray):
        yield name, content
    elif isinstance(content, dict | list):
        for key, inner in content.items() if isinstance(content, dict) else enumerate(content):
            yield from _sequences(inner, f"{name} {key}".strip())
    else:
        raise TypeError(f"{name or 'it'} holds {type(content).__name__}")


def _array(raw: bytes) -> np.ndarray:
    """The array in an NPY file; one of objects is pickled, and may hold arrays, dictionaries and lists only."""
    file = io.BytesIO(raw)
    version = np.lib.format.read_magic(file)
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    with warnings.catch_warnings(action="ignore"):  # that the file was written under Python 2
        if header(file)[2].hasobject:
            return _Arrays(file, encoding="latin1").load()
        file.seek(0)
        return np.lib.format.read_array(file, allow_pickle=False)


class _Arrays(pickle.Unpickler):
    """Loads arrays and containers only, for other objects can run code."""

    def find_class(self, module: str, name: str) -> Any:
        if (module.replace("._core", ".core"), name) not in _SAFE:
            raise pickle.UnpicklingError(f"it holds {module}.{name}, and such objects can run code")
        return super().find_class(module.replace("numpy.core", "numpy._core"), name)
