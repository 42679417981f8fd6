"""COCO keypoints in JSON: results of detectors, and annotated data sets."""

import json
import re
from dataclasses import dataclass, field

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.readers.text import read_bytes

#: COCO's keypoints, in file order.
KEYPOINTS = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip

#: Most frames of a file: an hour at 28 per second.
MOST_FRAMES = 100_000

_MOST_PEOPLE = 100  # most people in one image
_PERSON = 1  # COCO's category
_SPARSE = 50  # ratio of the range of image ids to the number of images above which ids can't be frame numbers
_LARGEST = 1e9  # pixels
_STRIDE = 1.0  # most movement between detections, relative to the person's size
_LOST = 30  # frames after which a track ends
_RIVAL = 0.25  # length of another track, relative to the longest, from which the choice is ambiguous


@dataclass
class _Track:
    """One person over time: frame numbers, and the keypoints (17, 3) in each."""

    frames: list[int] = field(default_factory=list)
    keypoints: list[np.ndarray] = field(default_factory=list)

    def add(self, frame: int, keypoints: np.ndarray) -> None:
        self.frames.append(frame)
        self.keypoints.append(keypoints)

    @property
    def weight(self) -> float:
        """Duration of the track weighted by confidence [frames]."""
        return float(np.sum([np.clip(k[:, 2], 0, 1).mean() for k in self.keypoints]))


def read(path, person: int | None = None) -> np.ndarray:
    """Read the keypoints of one person in every frame, (frames, 17, 3): x, y [pixels] and score or visibility.

    Two layouts are supported: a list of results [{"image_id", "category_id", "keypoints", "score"}], and a data set
    {"images": [...], "annotations": [...]}. In a list, image ids are frame numbers or file names that contain one;
    missing numbers are frames without detections. In a data set each image is one frame, in the order of file names.

    A person is tracked from frame to frame by the position of the keypoints, or by "track_id" if every detection has
    one; frames without that person are NaN. `person` 0 has the longest and most confident track. None raises an error
    that lists the people if another track is at least a quarter as long as the first.

    Raises:
        FormatError: not JSON, not COCO's, damaged, no person, or several; names field and value.
    """
    content = _parsed(path)
    if isinstance(content, dict):
        entries, frame_of, frames = _dataset(path, content)
    else:
        entries, frame_of, frames = _results(path, content)
    found = [(frame_of[image], keypoints, track) for image, keypoints, track in entries]
    tracks = sorted(_tracks(path, found), key=lambda track: -track.weight)
    chosen = tracks[_chosen(path, tracks, person)]
    out = np.full((frames, len(KEYPOINTS), 3), np.nan)
    out[chosen.frames] = chosen.keypoints
    return out


def _parsed(path) -> list | dict:
    """The file's JSON: a list or an object."""

    def refuse(word: str):
        raise ValueError(f"{word} isn't a JSON number: remove such detections")

    raw = read_bytes(path)
    try:
        content = json.loads(raw.decode("utf-8-sig"), parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise FormatError(
            path, f"isn't complete JSON: {error.msg}", f"line {error.lineno}, column {error.colno}"
        ) from None
    except RecursionError:
        raise FormatError(path, "is nested too deeply to be COCO keypoints") from None
    except ValueError as error:  # not UTF-8, NaN, numbers of thousands of digits
        raise FormatError(path, f"isn't readable JSON: {error}") from None
    if not isinstance(content, list | dict):
        raise FormatError(path, f"must hold a list of results or a COCO data set, got {_short(content)}")
    return content


def _results(path, content: list) -> tuple[list, dict, int]:
    """Detections (image, keypoints, track) of a list of results, the frame of each image, and the number of frames."""
    entries = _detections(path, content, "result", {_PERSON})
    images = {image for image, _, _ in entries}
    numbers = {image: _number(path, image) for image in images}
    first = min(numbers.values())
    span = max(numbers.values()) - first + 1
    if span > max(_SPARSE * len(images), 1000) or span > MOST_FRAMES:
        raise FormatError(
            path,
            f"the {len(images)} image_ids span {span} numbers: they aren't frame numbers, or are more than "
            f"{MOST_FRAMES}; renumber them 0, 1, 2, ..., or cut the walk out",
            "image_id",
        )
    return entries, {image: number - first for image, number in numbers.items()}, span


def _dataset(path, content: dict) -> tuple[list, dict, int]:
    """Like `_results`, for a data set, in which each image is a frame."""
    for key in ("images", "annotations"):
        if not isinstance(content.get(key), list):
            raise FormatError(path, f'must have a list "{key}", got {_short(content.get(key))}')
    frame_of = _images(path, content["images"])
    categories = content.get("categories")
    named = [c for c in categories if isinstance(c, dict)] if isinstance(categories, list) else []
    people = {c["id"] for c in named if c.get("name") == "person" and isinstance(c.get("id"), int)} or {_PERSON}
    entries = _detections(path, content["annotations"], "annotation", people)
    for image, _, _ in entries:
        if image not in frame_of:
            raise FormatError(path, f'no image has the id {image!r}: add it to "images"', "annotations")
    return entries, frame_of, len(frame_of)


def _images(path, images: list) -> dict:
    if len(images) > MOST_FRAMES:
        raise FormatError(path, f"holds {len(images)} images, more than {MOST_FRAMES}: cut the walk out", "images")
    for i, image in enumerate(images):
        if not isinstance(image, dict) or not isinstance(image.get("id"), int | str):
            raise FormatError(path, f'needs an "id", got {_short(image)}', f"images[{i}]")
    order = sorted(images, key=lambda image: _natural(str(image.get("file_name", image["id"]))))
    frame_of = {image["id"]: i for i, image in enumerate(order)}
    if len(frame_of) != len(images):
        raise FormatError(path, "two images have the same id: give each its own", "images")
    return frame_of


def _detections(path, entries: list, what: str, people: set) -> list:
    """(image, keypoints (17, 3), track or None) of every person."""
    found = []
    for i, entry in enumerate(entries):
        where = f"{what} {i}"
        if not isinstance(entry, dict):
            raise FormatError(path, f"must be an object with image_id and keypoints, got {_short(entry)}", where)
        category = entry.get("category_id", min(people))
        if not isinstance(category, int) or category not in people:
            continue
        image, track = entry.get("image_id"), entry.get("track_id")
        if isinstance(image, bool) or not isinstance(image, int | str):
            raise FormatError(path, f"image_id must be a whole number or a file name, got {_short(image)}", where)
        if track is not None and not isinstance(track, int | str):
            raise FormatError(path, f"track_id must be a whole number or a name, got {_short(track)}", where)
        found.append((image, _keypoints(path, entry.get("keypoints"), where), track))
    if not found:
        raise FormatError(path, f"has no person among {len(entries)} {what}s: there is nothing to read")
    return found


def _keypoints(path, values, where: str) -> np.ndarray:
    """The keypoints (17, 3) of one detection."""
    need = 3 * len(KEYPOINTS)
    if not isinstance(values, list) or len(values) != need:
        have = f"{len(values)} values" if isinstance(values, list) else _short(values)
        raise FormatError(path, f"keypoints must hold {need} numbers, 17 times x, y and score, got {have}", where)
    if not all(type(v) in (int, float) and abs(v) <= _LARGEST for v in values):
        wrong = next(v for v in values if not (type(v) in (int, float) and abs(v) <= _LARGEST))
        raise FormatError(path, f"keypoints must be numbers of pixels and scores, got {_short(wrong)}", where)
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def _number(path, image) -> int:
    """Frame number: an image id, or the last digits of a file name."""
    digits = re.findall(r"\d{1,18}", image.rpartition(".")[0] or image) if isinstance(image, str) else [image]
    if not digits:
        raise FormatError(path, f"must be the number of a frame or hold one, got {_short(image)}", "image_id")
    return int(digits[-1])


def _natural(name: str) -> list:
    """Sort key that orders the numbers in names numerically."""
    return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in re.findall(r"[0-9]{1,18}|[^0-9]+", name)]


def _tracks(path, found: list) -> list[_Track]:
    """People over time, from detections (frame, keypoints, track id)."""
    by_frame: dict[int, list] = {}
    for frame, keypoints, track in found:
        by_frame.setdefault(frame, []).append((keypoints, track))
    crowded = max(by_frame.items(), key=lambda item: len(item[1]))
    if len(crowded[1]) > _MOST_PEOPLE:
        raise FormatError(path, f"frame {crowded[0]} shows {len(crowded[1])} people: keep only the walker's detections")
    if all(track is not None for _, _, track in found):
        return _named(path, by_frame)
    tracks: list[_Track] = []
    for frame in sorted(by_frame):
        _link([t for t in tracks if frame - t.frames[-1] <= _LOST], tracks, frame, [k for k, _ in by_frame[frame]])
    return tracks


def _named(path, by_frame: dict) -> list[_Track]:
    tracks: dict[int | str, _Track] = {}
    for frame in sorted(by_frame):
        for keypoints, name in by_frame[frame]:
            track = tracks.setdefault(name, _Track())
            if track.frames and track.frames[-1] == frame:
                raise FormatError(path, f"track_id {name!r} occurs twice in frame {frame}: keep one of them")
            track.add(frame, keypoints)
    return list(tracks.values())


def _link(alive: list[_Track], tracks: list[_Track], frame: int, people: list[np.ndarray]) -> None:
    """Assign each of `people` to the nearest active track, closest pairs first, or to a new one."""
    pairs = [(_apart(t.keypoints[-1], p), i, j) for i, t in enumerate(alive) for j, p in enumerate(people)]
    old, new = set(), set(range(len(people)))
    for apart, i, j in sorted(pairs):
        if apart <= _STRIDE and i not in old and j in new:
            alive[i].add(frame, people[j])
            old.add(i)
            new.remove(j)
    for j in sorted(new):
        tracks.append(_Track([frame], [people[j]]))


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median distance of the keypoints common to both detections (17, 3), relative to the person's size."""
    both = (one[:, 2] > 0) & (other[:, 2] > 0)
    if not both.any():
        return np.inf
    size = max(np.ptp(one[both, :2], axis=0).max(), np.ptp(other[both, :2], axis=0).max(), 1.0)
    return float(np.median(np.linalg.norm(one[both, :2] - other[both, :2], axis=-1)) / size)


def _chosen(path, tracks: list[_Track], person: int | None) -> int:
    seen = [t for t in tracks if t.weight >= _RIVAL * tracks[0].weight] if tracks[0].weight > 0 else tracks
    if person is None and len(seen) == 1:
        return 0
    if person is not None and isinstance(person, int) and 0 <= person < len(tracks):
        return person
    who = "; ".join(f"{i}: {len(t.frames)} frames from {t.frames[0]}" for i, t in enumerate(seen[:5]))
    asked = f"there is no person {person!r}" if person is not None else f"shows {len(seen)} people"
    raise FormatError(path, f"{asked}: select one with person= (--person). Longest tracks: {who}")


def _short(value) -> str:
    """A value of a file, abbreviated to a line."""
    if isinstance(value, list | dict):
        return f"a {'list' if isinstance(value, list) else 'JSON object'} of {len(value)}"
    text = repr(value) if not isinstance(value, int) or abs(value) < 10**20 else "a very large number"
    return text if len(text) <= 60 else f"{text[:57]}..."
