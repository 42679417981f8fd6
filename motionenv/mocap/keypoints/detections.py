"""People in files: what detectors write for each frame of a film, and annotated data sets.

In JSON, COCO's results and data sets, AlphaPose, OpenPose, Pose2Sim's RTMLib, MMPose, Ultralytics and MediaPipe are
told apart by their keys; `layouts.toml` shows each layout with its source. `motionenv.mocap.keypoints.exports` has what
other programs write.
"""

import json
import re
import tomllib
from importlib.resources import files
from pathlib import Path
from reprlib import repr as _short
from typing import Any, NamedTuple

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.keypoints import exports
from motionenv.mocap.keypoints.frame_names import frame_numbers
from motionenv.mocap.keypoints.people import Track, followed
from motionenv.mocap.readers.text import read_bytes

_PERSON = 1  # COCO's category
_LARGEST = 1e9  # pixels
_CORNER = 0.2  # distance of all others from the corner, relative to somebody's extent, if points there are none
_KEYS = tomllib.loads(files(__package__).joinpath("layouts.toml").read_text(encoding="utf-8"))


class Detections(NamedTuple):
    """Tracks of all people, the longest and most confident first, and the number of frames.

    `fps` [Hz] is what names of images tell, and `names` are those of the keypoints, where the file has them.
    """

    tracks: list[Track]
    frames: int
    fps: float | None = None
    names: list[str] | None = None


def read(path: str | Path) -> Detections:
    """People in a file or folder.

    Image ids are frame numbers or file names that contain one or a time, as are the names of a folder's files (see
    `motionenv.mocap.keypoints.frame_names`); missing numbers are frames without detections. In a data set each image is
    one frame, in the order of file names, and visibility 0, 1 and 2 becomes a score of 0, 0.5 and 1. Without scores
    they are 1. Points at exactly (0, 0) weren't seen, if somebody's others are far from there.

    People are kept apart by `motionenv.mocap.keypoints.people`.

    Raises:
        FormatError: an unknown layout, damaged, or no person; names field and value.
    """
    suffix, names = Path(path).suffix.lower(), None
    if suffix in (".npy", ".npz"):
        people = exports.arrays(path)
    elif suffix == ".csv":
        people, names = exports.table(path)
    else:
        people = _in_json(path)
    numbers, fps = frame_numbers(path, [frame for frame, _, _ in people])
    found = [
        (number, _without_corner(keypoints), who)
        for number, (_, keypoints, who) in zip(numbers, people, strict=True)
        if keypoints is not None
    ]
    if any(np.nanmax(np.abs(keypoints), initial=0.0) > _LARGEST for _, keypoints, _ in found):
        raise FormatError(path, f"keypoints must be numbers of pixels and scores, got some above {_LARGEST:g}")
    counts = sorted({len(keypoints) for _, keypoints, _ in found})
    if len(counts) != 1:
        mixed = f"has people with {' and '.join(map(str, counts))} keypoints: keep one detector's"
        raise FormatError(path, mixed if counts else "has no person: there is nothing to read")
    return Detections(followed(path, found), max(numbers) + 1, fps, names)


def _in_json(path: str | Path) -> list:
    """Detections as of `exports` in JSON or a folder, and (frame, None, None) of frames without people."""
    content: Any = _folder(path) if Path(path).is_dir() else _parsed(path)
    annotated = isinstance(content, dict) and "annotations" in content
    scale = [1, 1, 2 if annotated else 1]
    return [
        (frame, None if one is None else _keypoints(path, one, f"frame {frame}") / scale, one and _identity(one))
        for frame, one in _everybody(path, _dataset(path, content) if annotated else content)
    ]


def _without_corner(keypoints: np.ndarray) -> np.ndarray:
    """Keypoints (n, 3) with scores of 0 at (0, 0), where many detectors put what they don't see, and where NaN."""
    unknown = np.isnan(keypoints).any(axis=1)
    corner = (keypoints[:, :2] == 0).all(axis=1)
    others = keypoints[~corner & ~unknown & (keypoints[:, 2] > 0), :2]
    near = len(others) > 0 and np.hypot(*others.T).min() <= _CORNER * np.ptp(others, axis=0).max()
    unseen = unknown | corner & (not near)
    return np.where(unseen[:, None] & np.array([False, False, True]), 0.0, keypoints)


def in_frames(track: Track, frames: int) -> np.ndarray:
    """Keypoints (frames, n, 3) of a track; NaN in the frames that it doesn't have."""
    out = np.full((frames, *next(iter(track.values())).shape), np.nan)
    out[list(track)] = list(track.values())
    return out


def _parsed(path) -> Any:
    """The file's JSON; NaN, which Pose2Sim writes, is a gap."""

    def refuse(word: str) -> float:
        if word == "NaN":
            return np.nan
        raise ValueError(f"{word} isn't a JSON number: remove such detections")

    raw = read_bytes(path)
    try:
        return json.loads(raw.decode("utf-8-sig"), parse_constant=refuse)
    except RecursionError:
        raise FormatError(path, "is nested too deeply to be keypoints") from None
    except ValueError as error:  # cut off, not UTF-8, Infinity, numbers of thousands of digits
        raise FormatError(path, f"isn't complete JSON: {error}") from None


def _folder(path) -> list[dict]:
    """The people of all JSON or, if there is none, YOLO's text files with a number in their name."""
    files = sorted(file for file in Path(path).iterdir() if any(letter.isdigit() for letter in file.stem))
    of = {suffix: [file for file in files if file.suffix.lower() == suffix] for suffix in (".json", ".txt")}
    if not any(of.values()):
        problem = "must hold .json, or YOLO's .txt, files with a frame number each, of one camera, got 0 files"
        raise FormatError(path, problem)
    if of[".json"]:
        return [{"frame": file.name, "people": _people(file, _parsed(file))} for file in of[".json"]]
    return [{"frame": file.name, "people": exports.yolo_people(file)} for file in of[".txt"]]


def _everybody(path, content) -> list[tuple]:
    """(frame, person) of everybody, and (frame, None) of frames without people."""
    if isinstance(content, dict):
        content = _first(content, "frames")
    if not isinstance(content, list):
        raise FormatError(path, "must be a list of detections or frames, or a data set; of files per frame, the folder")
    out: list[tuple] = []
    for i, entry in enumerate([] if one is None else one for one in content):
        frame = _first(entry, "frame") if isinstance(entry, dict) else i
        if frame is None and _first(entry, "people") is not None:
            frame = i
        if not isinstance(entry, list | dict) or type(frame) not in (int, str):
            problem = f"must have people, and image_id as a whole number or a file name, got {_short(frame)}"
            raise FormatError(path, problem, f"result {i}")
        if isinstance(entry, list) or "image_id" not in entry:
            out += [(frame, person) for person in _people(path, entry) or [None]]
        elif entry.get("category_id", _PERSON) == _PERSON:
            out.append((frame, entry))
    return out


def _people(path, entry) -> list:
    if isinstance(entry, dict):
        points = _first(entry, "points")
        several = isinstance(points, list) and all(map(_is_landmarks, points))
        null: Any = [] if any(key in entry for what in ("people", "points") for key in _KEYS[what]) else None
        entry = _first(entry, "people") or null if points is None else points if several else [entry]
    people = [entry] if _is_landmarks(entry) else entry
    if not isinstance(people, list) or not all(isinstance(person, list | dict) for person in people):
        raise FormatError(path, f"must list the people of a frame, got {_short(entry)}")
    return [person if isinstance(person, dict) else {"landmarks": person} for person in people]


def _is_landmarks(value) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(p, dict) and "x" in p for p in value)


def _dataset(path, content: dict) -> list[dict]:
    try:
        order = sorted(content["images"], key=lambda image: _natural(str(image.get("file_name", image["id"]))))
        frames: dict[Any, dict] = {image["id"]: {"frame": i, "people": []} for i, image in enumerate(order)}
        persons = [c["id"] for c in content.get("categories", []) if c["name"] == "person"] or [_PERSON]
        for entry in content["annotations"]:
            if entry.get("category_id", persons[0]) in persons:
                frames[entry["image_id"]]["people"].append(entry)
    except (AttributeError, KeyError, TypeError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else "it isn't so"
        problem = 'must have lists "images", each with an "id", and "annotations", each with an "image_id" among these'
        raise FormatError(path, f"{problem}: {what}") from None
    if len(frames) != len(order):
        raise FormatError(path, "two images have the same id: give each its own", "images")
    return list(frames.values())


def _keypoints(path, person: dict, where: str) -> np.ndarray:
    """The keypoints (n, 3) of one person."""
    try:
        columns = np.array(_columns(person))
    except (TypeError, ValueError):  # no lists, or of several lengths
        columns = np.empty(0)
    if columns.ndim != 2 or not columns.size or columns.dtype.kind not in "if":
        problem = "keypoints must be numbers of pixels and scores, three for each"
        raise FormatError(path, f"{problem}, got {_short(_first(person, 'points'))}", where)
    return columns.T.astype(np.float64)


def _columns(person: dict) -> list:
    x: Any
    values = _first(person, "points")
    if _is_landmarks(values):
        values = {key: [point.get(key) for point in values] for key in values[0]}
    if isinstance(values, dict):
        x, y, score = values.get("x"), values.get("y"), _first(values, "score")
    elif values and isinstance(values[0], list):
        x, y, *score = zip(*values, strict=True)
        score = person.get("keypoint_scores", *score)
    else:
        x, y, score = values[0::3], values[1::3], values[2::3]
    return [x, y, [1.0] * len(x) if score is None else score]


def _identity(person: dict) -> float | str | None:
    """The person's track; OpenPose's -1 and AlphaPose's 0 mean none."""
    value = _first(person, "identity")
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    nobody = not isinstance(value, int | float | str) or value == -1 or (value == 0 and "idx" in person)
    return None if nobody else value


def _first(entry: dict, what: str):
    return next((entry[key] for key in _KEYS[what] if entry.get(key) is not None), None)


def _natural(name: str) -> list:
    """Sort key that orders the numbers in names numerically."""
    return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in re.findall(r"[0-9]{1,18}|[^0-9]+", name)]
