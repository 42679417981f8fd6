"""People in JSON: what detectors write for each frame of a film, and annotated data sets.

COCO's results and data sets, AlphaPose, OpenPose, Pose2Sim's RTMLib, MMPose, Ultralytics and MediaPipe are told apart
by their keys; `layouts.toml` shows each layout with its source.
"""

import json
import re
import tomllib
from importlib.resources import files
from pathlib import Path
from reprlib import repr as _short
from typing import Any

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.keypoints.people import Track, followed
from motionenv.mocap.readers.text import read_bytes

#: Most frames of a film: an hour at 28 per second.
MOST_FRAMES = 100_000

_PERSON = 1  # COCO's category
_SPARSE = 50  # ratio of the range of image ids to the number of images above which ids can't be frame numbers
_LARGEST = 1e9  # pixels
_KEYS = tomllib.loads(files(__package__).joinpath("layouts.toml").read_text(encoding="utf-8"))


def read(path: str | Path) -> tuple[list[Track], int]:
    """Tracks of all people in a file or folder, the longest and most confident first, and the number of frames.

    Image ids are frame numbers or file names that contain one, as are the names of a folder's files; missing numbers
    are frames without detections. In a data set each image is one frame, in the order of file names, and visibility
    0, 1 and 2 becomes a score of 0, 0.5 and 1. Without scores they are 1.

    People are kept apart by `motionenv.mocap.keypoints.people`.

    Raises:
        FormatError: not JSON, an unknown layout, damaged, or no person; names field and value.
    """
    content: Any = _folder(path) if Path(path).is_dir() else _parsed(path)
    annotated = isinstance(content, dict) and "annotations" in content
    people = _everybody(path, _dataset(path, content) if annotated else content)
    numbers = _numbered(path, [frame for frame, _ in people])
    found = []
    for number, (frame, someone) in zip(numbers, people, strict=True):
        if someone is not None:
            keypoints = _keypoints(path, someone, f"frame {frame}") / [1, 1, 2 if annotated else 1]
            found.append((number, keypoints, _identity(someone)))
    counts = sorted({len(keypoints) for _, keypoints, _ in found})
    if len(counts) != 1:
        mixed = f"has people with {' and '.join(map(str, counts))} keypoints: keep one detector's"
        raise FormatError(path, mixed if counts else "has no person: there is nothing to read")
    return followed(path, found), max(numbers) + 1


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
    found = list(Path(path).glob("*.json"))
    named = {_number(path, file.name): file for file in found}
    if not found or len(named) < len(found):
        problem = "must hold .json files with a frame number each, of one camera"
        raise FormatError(path, f"{problem}, got {len(found)} files with {len(named)} numbers")
    return [{"frame": number, "people": _people(file, _parsed(file))} for number, file in named.items()]


def _everybody(path, content) -> list[tuple]:
    """(frame, person) of everybody, and (frame, None) of frames without people."""
    if isinstance(content, dict):
        content = _first(content, "frames")
    if not isinstance(content, list):
        raise FormatError(path, "must be a list of detections or frames, or a data set; of files per frame, the folder")
    out: list[tuple] = []
    for i, entry in enumerate(content):
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
        entry = _first(entry, "people") if points is None else points if several else [entry]
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
    """The keypoints (n, 3) of one person; scores are 0 where x, y or the score is NaN."""
    try:
        columns = np.array(_columns(person))
    except (TypeError, ValueError):  # no lists, or of several lengths
        columns = np.empty(0)
    if columns.ndim != 2 or not columns.size or columns.dtype.kind not in "if" or (np.abs(columns) > _LARGEST).any():
        problem = "keypoints must be numbers of pixels and scores, three for each"
        raise FormatError(path, f"{problem}, got {_short(_first(person, 'points'))}", where)
    out = columns.T.astype(np.float64)
    out[np.isnan(out).any(axis=1), 2] = 0.0
    return out


def _columns(person: dict) -> list:
    x: Any
    values = _first(person, "points")
    if _is_landmarks(values):
        values = {key: [point.get(key) for point in values] for key in values[0]}
    if isinstance(values, dict):
        x, y, score = values.get("x"), values.get("y"), _first(values, "score")
    elif "keypoint_scores" in person:
        (x, y), score = zip(*values, strict=True), person["keypoint_scores"]
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


def _numbered(path, frames: list) -> list[int]:
    numbers = [_number(path, frame) for frame in frames]
    first, different = min(numbers, default=0), len(set(numbers))
    span = max(numbers, default=0) - first + 1
    if span > max(_SPARSE * different, 1000) or span > MOST_FRAMES:
        problem = f"the {different} frames span {_short(span)} numbers: no frame numbers, or more than {MOST_FRAMES}"
        raise FormatError(path, f"{problem}; renumber them 0, 1, 2, ..., or cut the walk out", "image_id")
    return [number - first for number in numbers]


def _number(path, image) -> int:
    """Frame number: an image id, or the last digits of a file name."""
    digits = re.findall(r"\d{1,18}", image.rpartition(".")[0] or image) if isinstance(image, str) else [image]
    if not digits:
        raise FormatError(path, f"must be the number of a frame or hold one, got {_short(image)}", "image_id")
    return int(digits[-1])


def _natural(name: str) -> list:
    """Sort key that orders the numbers in names numerically."""
    return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in re.findall(r"[0-9]{1,18}|[^0-9]+", name)]
