"""Several people in a film, kept apart: tracks of detections over time, and the choice of one of them."""

from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import FormatError

#: One person over time: the keypoints (n, 3) by frame number, in the order of frames.
Track = dict[int, np.ndarray]

_MOST_PEOPLE = 100  # most people in one image
_STRIDE = 1.0  # most movement between detections, relative to the person's size
_LOST = 30  # frames after which a track ends
_AROUND = 0.1  # space around keypoints in which the person is, relative to the larger side of their box
_RIVAL = 0.25  # length of another track, relative to the longest, from which the choice is ambiguous


def followed(path: str | Path, found: list[tuple]) -> list[Track]:
    """Tracks of everybody, the longest and most confident first, from detections (frame, keypoints (n, 3), identity).

    Where every detection has an identity, identities make the tracks; otherwise the position of the keypoints does.

    Raises:
        FormatError: a crowd, or an identity that occurs twice in a frame.
    """
    by_frame: dict[int, list] = {}
    for frame, keypoints, identity in sorted(found, key=lambda detection: detection[0]):
        by_frame.setdefault(frame, []).append((keypoints, identity))
    frame, crowd = max(by_frame.items(), key=lambda item: len(item[1]))
    if len(crowd) > _MOST_PEOPLE:
        raise FormatError(path, f"frame {frame} shows {len(crowd)} people: keep only the walker's detections")
    known = all(identity is not None for _, _, identity in found)
    tracks: dict[Any, Track] = {}
    active: dict[Any, tuple[int, np.ndarray]] = {}
    for frame, people in by_frame.items():
        active = {name: last for name, last in active.items() if frame - last[0] <= _LOST}
        names = [identity for _, identity in people] if known else _linked(active, frame, people)
        for (keypoints, _), name in zip(people, names, strict=True):
            if frame in tracks.setdefault(name, {}):
                raise FormatError(path, f"track_id {name!r} occurs twice in frame {frame}: keep one of them")
            tracks[name][frame] = keypoints
            active[name] = frame, keypoints
    return sorted(tracks.values(), key=weight, reverse=True)


def weight(track: Track) -> float:
    """Duration of a track weighted by confidence [frames]."""
    return float(np.sum([np.clip(keypoints[:, 2], 0, 1).mean() for keypoints in track.values()]))


def boxes(tracks: list[Track], frames: int) -> list[np.ndarray]:
    """Boxes (n, 4) around the people of each frame: x0, y0, x1, y1, a tenth of the height more than the keypoints."""
    found: list[list] = [[] for _ in range(frames)]
    for track in tracks:
        for frame, keypoints in track.items():
            seen = keypoints[keypoints[:, 2] > 0, :2]
            if len(seen) and frame < frames:
                low, high = seen.min(axis=0), seen.max(axis=0)
                found[frame].append([*(low - _AROUND * (high - low).max()), *(high + _AROUND * (high - low).max())])
    return [np.reshape(each, (-1, 4)) for each in found]


def chosen(path: str | Path, tracks: list[Track], person: int | None) -> Track:
    """The track of `person`, an index; None is the first, unless another is at least a quarter as long.

    Raises:
        FormatError: no such person, or several and none is chosen; lists them.
    """
    rivals = [track for track in tracks if weight(track) >= _RIVAL * weight(tracks[0])]
    if person is None and len(rivals) == 1:
        return tracks[0]
    if person is not None and isinstance(person, int) and 0 <= person < len(tracks):
        return tracks[person]
    who = "; ".join(f"{i}: {len(track)} frames from {min(track)}" for i, track in enumerate(rivals[:5]))
    asked = f"there is no person {person!r}" if person is not None else f"shows {len(rivals)} people"
    raise FormatError(path, f"{asked}: select one with person= (--person). Longest tracks: {who}")


def _linked(active: dict, frame: int, people: list[tuple]) -> list:
    """The nearest active track of each of `people`, closest pairs first, or the name of a new one."""
    pairs = [(_apart(last, new), name, j) for name, (_, last) in active.items() for j, (new, _) in enumerate(people)]
    names: dict[int, Any] = {}
    for apart, name, j in sorted(pairs):
        if apart <= _STRIDE and j not in names and name not in names.values():
            names[j] = name
    return [names.get(j, (frame, j)) for j in range(len(people))]


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median distance of the keypoints common to both detections (n, 3), relative to the person's size."""
    both = (one[:, 2] > 0) & (other[:, 2] > 0)
    if not both.any():
        return np.inf
    size = max(np.ptp(one[both, :2], axis=0).max(), np.ptp(other[both, :2], axis=0).max(), 1e-9)
    return float(np.median(np.linalg.norm(one[both, :2] - other[both, :2], axis=-1)) / size)
