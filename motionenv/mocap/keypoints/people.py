"""Several people in a film, kept apart: tracks of detections over time, and the choice of one of them.

Who is who is told by motion (each goes on as before), size and, if pictures are at hand, colours of the clothes, for
all who are in a frame together. Identities in a file are taken as they are, but detectors exchange them when people
cross: where two tracks break at once, and each goes on smoothly as the other, they are exchanged back.
"""

import warnings
from collections.abc import Sequence
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import CaptureWarning, FormatError

#: One person over time: the keypoints (n, 3) by frame number, in the order of frames.
Track = dict[int, np.ndarray]

_MOST_PEOPLE = 100  # most people in one image
_STRIDE = 1.0  # most movement between detections, relative to the person's size
_LOST = 30  # frames after which a track ends
_BESIDE = 0.1  # space around keypoints in which the person is, relative to the larger side of their box
_GOES_ON = 5  # frames for which nobody who isn't seen is expected to go on as before
_RECENT = 0.3  # weight of the last step in the velocity of a track, and of the last look
_RIVAL = 0.25  # length times size of another track, relative to the longest, from which the choice is ambiguous
_AROUND = 6  # frames before and after a break
_BREAK, _SMOOTHER = 0.15, 0.5  # least break of a track [sizes], and most of what is left of it when exchanged
_ELSE, _MOVED = 0.7, 0.08  # distance of looks, and step [sizes], beyond both of which a detection is somebody else
_JUMP = 0.5  # step from a frame to the next, relative to the person's size, that nobody makes


def followed(path: str | Path, found: list[tuple], looks: Sequence[np.ndarray] | None = None) -> list[Track]:
    """Tracks of everybody, the longest and most confident first, from detections (frame, keypoints (n, 3), identity).

    Where every detection has an identity, identities make the tracks, and a `CaptureWarning` tells where they were
    exchanged or one jumps; otherwise motion and `looks`, a distribution of colours for each detection, do.

    Raises:
        FormatError: a crowd, or an identity that occurs twice in a frame.
    """
    by_frame: dict[int, list] = {}
    for i in sorted(range(len(found)), key=lambda i: found[i][0]):
        frame, keypoints, identity = found[i]
        by_frame.setdefault(frame, []).append((keypoints, identity, None if looks is None else looks[i]))
    frame, crowd = max(by_frame.items(), key=lambda item: len(item[1]))
    if len(crowd) > _MOST_PEOPLE:
        raise FormatError(path, f"frame {frame} shows {len(crowd)} people: keep only the walker's detections")
    known = all(identity is not None for _, _, identity in found)
    tracks = _split(path, _repaired(path, _named(path, by_frame))) if known else _linked(by_frame)
    return sorted(tracks, key=weight, reverse=True)


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
                found[frame].append([*(low - _BESIDE * (high - low).max()), *(high + _BESIDE * (high - low).max())])
    return [np.reshape(each, (-1, 4)) for each in found]


def _size(track: Track) -> float:
    """Largest extent of the visible keypoints, the median over frames [pixels]."""
    extents = [np.ptp(k[k[:, 2] > 0, :2], axis=0).max() for k in track.values() if (k[:, 2] > 0).any()]
    return float(np.median(extents)) if extents else 0.0


def chosen(path: str | Path, tracks: list[Track], person: int | Sequence[int] | None) -> Track:
    """The track of `person`, an index; None is the first, unless another is a quarter as long, for its size.

    Several indices are parts of one person, whose tracks are joined.

    Raises:
        FormatError: no such person, several who are seen at once, or several and none is chosen; lists them.
    """
    rivals = [t for t in tracks if weight(t) * _size(t) >= _RIVAL * weight(tracks[0]) * _size(tracks[0])]
    if person is None and len(rivals) == 1:
        return tracks[0]
    parts = list(person) if isinstance(person, list | tuple) else [person]
    known = {part: tracks[part] for part in parts if isinstance(part, int) and 0 <= part < len(tracks)}
    if parts and len(known) == len(parts):
        return _joined(path, known)
    who = "; ".join(f"{i}: {len(track)} frames from {min(track)}" for i, track in enumerate(rivals[:5]))
    asked = f"there is no person {person!r}" if person is not None else f"shows {len(rivals)} people"
    raise FormatError(path, f"{asked}: select one with person= (--person). Longest tracks: {who}")


def _joined(path: str | Path, parts: dict[int, Track]) -> Track:
    for one, other in combinations(parts, 2):
        if both := sorted(parts[one].keys() & parts[other].keys()):
            raise FormatError(
                path, f"persons {one} and {other} are both seen in {len(both)} frames from {both[0]} to {both[-1]}: "
                "they are two people; join only parts of one person (--person)",
            )  # fmt: skip
    return dict(sorted((item for track in parts.values() for item in track.items()), key=lambda item: item[0]))


def _named(path: str | Path, by_frame: dict[int, list]) -> list[Track]:
    tracks: dict[Any, Track] = {}
    for frame, people in by_frame.items():
        for keypoints, name, _ in people:
            if frame in tracks.setdefault(name, {}):
                raise FormatError(path, f"track_id {name!r} occurs twice in frame {frame}: keep one of them")
            tracks[name][frame] = keypoints
    return list(tracks.values())


class _Walker:
    """A track, and how its person moves [pixels per frame] and looks."""

    def __init__(self, frame: int, keypoints: np.ndarray, look: np.ndarray | None) -> None:
        self.track, self.last, self.velocity, self.look = {frame: keypoints}, frame, np.zeros(2), look

    def differs(self, frame: int, keypoints: np.ndarray, look: np.ndarray | None) -> float:
        """How unlike this person a detection is; infinite if it can't be the same."""
        expected = self.track[self.last].copy()
        expected[:, :2] += self.velocity * min(frame - self.last, _GOES_ON)
        apart = _apart(expected, keypoints)
        if apart > (_STRIDE if frame > self.last + 1 else _JUMP):
            return np.inf
        if self.look is None or look is None:
            return apart
        unlike = float(np.sqrt(max(0.0, 1 - np.sqrt(self.look * look).sum())))  # Hellinger's distance
        return np.inf if unlike > _ELSE and apart > _MOVED else apart + unlike

    def goes_on(self, frame: int, keypoints: np.ndarray, look: np.ndarray | None) -> None:
        """Add a detection."""
        before = self.track[self.last]
        both = (before[:, 2] > 0) & (keypoints[:, 2] > 0)
        step = np.median((keypoints - before)[both, :2], axis=0) / (frame - self.last)
        self.velocity = self.velocity + _RECENT * (step - self.velocity)
        if self.look is not None and look is not None:
            self.look = self.look + _RECENT * (look - self.look)
        self.track[frame], self.last = keypoints, frame


def _linked(by_frame: dict[int, list]) -> list[Track]:
    """Tracks by motion and looks, those of each frame assigned together."""
    from scipy.optimize import linear_sum_assignment

    walkers: list[_Walker] = []
    for frame, people in by_frame.items():
        active = [walker for walker in walkers if frame - walker.last <= _LOST]
        seen = [(keypoints, look) for keypoints, _, look in people]
        costs = np.array([[w.differs(frame, *one) for one in seen] for w in active]).reshape(len(active), len(seen))
        new = set(range(len(seen)))
        for i, j in zip(*linear_sum_assignment(np.where(np.isfinite(costs), costs, 1e6)), strict=True):
            if np.isfinite(costs[i, j]):
                active[i].goes_on(frame, *seen[j])
                new.remove(int(j))
        walkers += [_Walker(frame, *seen[j]) for j in sorted(new)]
    return [walker.track for walker in walkers]


def _repaired(path: str | Path, tracks: list[Track]) -> list[Track]:
    """The tracks, exchanged back from where two break at once and each goes on as the other."""
    out = list(tracks)
    for i, j in combinations(range(len(out)), 2):
        while (frame := _exchange(out[i], out[j])) is not None:
            one, other = out[i], out[j]
            out[i], out[j] = _spliced(one, other, frame), _spliced(other, one, frame)
            warnings.warn(
                f"{Path(path).name}: two people's identities are exchanged from frame {frame} on, which was corrected",
                CaptureWarning, stacklevel=2,
            )  # fmt: skip
    return out


def _spliced(early: Track, late: Track, frame: int) -> Track:
    return {f: k for f, k in early.items() if f < frame} | {f: k for f, k in late.items() if f >= frame}


def _exchange(one: Track, other: Track) -> int | None:
    """The frame from which two tracks are exchanged, where that makes both smoothest; None if they aren't."""
    best, where = 0.0, None
    for frame in sorted(one.keys() & other.keys()):
        parts = [_near(track, frame, side) for track in (one, other) for side in (-1, 1)]
        if any(len(part) < 3 for part in parts):
            continue
        kept = [_break(parts[0], parts[1], frame), _break(parts[2], parts[3], frame)]
        if min(kept) > _BREAK:
            left = _break(parts[0], parts[3], frame) + _break(parts[2], parts[1], frame)
            if left < _SMOOTHER * sum(kept) and sum(kept) - left > best:
                best, where = sum(kept) - left, frame
    return where


def _near(track: Track, frame: int, side: int) -> Track:
    """What a track has in some frames before `frame` (side -1), or from it on (1)."""
    frames = range(frame - _AROUND, frame) if side < 0 else range(frame, frame + _AROUND)
    return {f: track[f] for f in frames if f in track}


def _break(before: Track, after: Track, frame: int) -> float:
    """How much keypoints change place or velocity at a frame, relative to the person's size: the median of them."""
    lines = []
    for part in (before, after):
        all_seen = np.min([k[:, 2:] for k in part.values()], axis=0) > 0
        places = np.where(all_seen, [k[:, :2] for k in part.values()], np.nan).reshape(len(part), -1)
        lines.append(np.polynomial.polynomial.polyfit(np.array(list(part)) - frame + 0.5, places, 1))
    place, velocity = np.linalg.norm((lines[1] - lines[0]).reshape(2, -1, 2), axis=-1)
    size = max(np.ptp(k[k[:, 2] > 0, :2], axis=0).max(initial=0.0) for k in (*before.values(), *after.values()))
    change = place + velocity * _AROUND / 2
    return float(np.nanmedian(change) / max(size, 1e-9)) if np.isfinite(change).any() else 0.0


def _split(path: str | Path, tracks: list[Track]) -> list[Track]:
    """The tracks, cut where a body jumps to another place from one frame to the next: that is somebody else."""
    out = []
    for track in tracks:
        frames = list(track)
        cuts = [b for a, b in pairwise(frames) if b == a + 1 and _JUMP < _apart(track[a], track[b]) < np.inf]
        if cuts:
            warnings.warn(
                f"{Path(path).name}: somebody jumps to another place in frame {cuts[0]}, where the track was split; "
                "parts of one person can be joined with --person, such as --person 0,3", CaptureWarning, stacklevel=2,
            )  # fmt: skip
        edges = [frames[0], *cuts, frames[-1] + 1]
        out += [{f: track[f] for f in frames if a <= f < b} for a, b in pairwise(edges)]
    return out


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median distance of the keypoints common to both detections (n, 3), relative to the person's size."""
    both = (one[:, 2] > 0) & (other[:, 2] > 0)
    if not both.any():
        return np.inf
    size = max(np.ptp(one[both, :2], axis=0).max(), np.ptp(other[both, :2], axis=0).max(), 1e-9)
    return float(np.median(np.linalg.norm(one[both, :2] - other[both, :2], axis=-1)) / size)
