"""Several people in a film, kept apart: tracks of detections over time, and the choice of one of them."""

from dataclasses import dataclass, field

import numpy as np

from motionenv.errors import FormatError

_MOST_PEOPLE = 100  # most people in one image
_STRIDE = 1.0  # most movement between detections, relative to the person's size
_LOST = 30  # frames after which a track ends
_RIVAL = 0.25  # length of another track, relative to the longest, from which the choice is ambiguous


@dataclass
class Track:
    """One person over time: frame numbers, and the keypoints (n, 3) in each."""

    frames: list[int] = field(default_factory=list)
    keypoints: list[np.ndarray] = field(default_factory=list)

    def add(self, frame: int, keypoints: np.ndarray) -> None:
        self.frames.append(frame)
        self.keypoints.append(keypoints)

    @property
    def weight(self) -> float:
        """Duration of the track weighted by confidence [frames]."""
        return float(np.sum([np.nan_to_num(k[:, 2]).clip(0, 1).mean() for k in self.keypoints]))


def followed(path, found: list[tuple]) -> list[Track]:
    """Tracks of everybody, the longest and most confident first, from detections (frame, keypoints (n, 3), identity).

    Where every detection has an identity, identities make the tracks; otherwise the position of the keypoints does.

    Raises:
        FormatError: a crowd, or an identity that occurs twice in a frame.
    """
    by_frame: dict[int, list] = {}
    for frame, keypoints, identity in found:
        by_frame.setdefault(frame, []).append((keypoints, identity))
    crowded = max(by_frame.items(), key=lambda item: len(item[1]))
    if len(crowded[1]) > _MOST_PEOPLE:
        raise FormatError(path, f"frame {crowded[0]} shows {len(crowded[1])} people: keep only the walker's detections")
    if all(identity is not None for _, _, identity in found):
        tracks = _named(path, by_frame)
    else:
        tracks = []
        for frame in sorted(by_frame):
            alive = [t for t in tracks if frame - t.frames[-1] <= _LOST]
            _link(alive, tracks, frame, [keypoints for keypoints, _ in by_frame[frame]])
    return sorted(tracks, key=lambda track: -track.weight)


def chosen(path, tracks: list[Track], person: int | None) -> Track:
    """The track of `person`, an index; None is the first, unless another is at least a quarter as long.

    Raises:
        FormatError: no such person, or several and none is chosen; lists them.
    """
    seen = [t for t in tracks if t.weight >= _RIVAL * tracks[0].weight] if tracks[0].weight > 0 else tracks
    if person is None and len(seen) == 1:
        return tracks[0]
    if person is not None and isinstance(person, int) and 0 <= person < len(tracks):
        return tracks[person]
    who = "; ".join(f"{i}: {len(t.frames)} frames from {t.frames[0]}" for i, t in enumerate(seen[:5]))
    asked = f"there is no person {person!r}" if person is not None else f"shows {len(seen)} people"
    raise FormatError(path, f"{asked}: select one with person= (--person). Longest tracks: {who}")


def _named(path, by_frame: dict[int, list]) -> list[Track]:
    tracks: dict[int | str, Track] = {}
    for frame in sorted(by_frame):
        for keypoints, name in by_frame[frame]:
            track = tracks.setdefault(name, Track())
            if track.frames and track.frames[-1] == frame:
                raise FormatError(path, f"track_id {name!r} occurs twice in frame {frame}: keep one of them")
            track.add(frame, keypoints)
    return list(tracks.values())


def _link(alive: list[Track], tracks: list[Track], frame: int, people: list[np.ndarray]) -> None:
    """Assign each of `people` to the nearest active track, closest pairs first, or to a new one."""
    pairs = [(_apart(t.keypoints[-1], p), i, j) for i, t in enumerate(alive) for j, p in enumerate(people)]
    old, new = set(), set(range(len(people)))
    for apart, i, j in sorted(pairs):
        if apart <= _STRIDE and i not in old and j in new:
            alive[i].add(frame, people[j])
            old.add(i)
            new.remove(j)
    for j in sorted(new):
        tracks.append(Track([frame], [people[j]]))


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median distance of the keypoints common to both detections (n, 3), relative to the person's size."""
    both = (one[:, 2] > 0) & (other[:, 2] > 0)
    if not both.any():
        return np.inf
    size = max(np.ptp(one[both, :2], axis=0).max(), np.ptp(other[both, :2], axis=0).max(), 1e-9)
    return float(np.median(np.linalg.norm(one[both, :2] - other[both, :2], axis=-1)) / size)
