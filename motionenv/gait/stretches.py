"""Stretches of a capture in which somebody walks steadily, and those in which he stands, turns or changes speed."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.gait.feet import Feet, bridged, smoothed

_CUTOFF = 0.8  # [Hz] below the rhythm of strides
_STANDS = 0.2  # [m/s] of who stands
_SLOWER = 0.75  # share of the brisk speed below which somebody starts or stops
_BRISK = 80  # percentile of the speed
_TURNS = 30.0  # [degrees/s]
_STRAIGHT = 30.0  # [degrees] by which the direction may change in one stretch
_SHORTEST = 0.5  # [s] of a stretch; shorter ones belong to their neighbour
_STEPS_IN_PLACE = 0.2  # [m] range of the heel about the pelvis of who walks on a treadmill


@dataclass(frozen=True, repr=False)
class Stretch(OneLine):
    """Part of a capture, from `start` to `end` [s] since the first frame.

    Its `kind` is "steady", "standing", "turning", "changing speed", or "unseen" where the pelvis is not visible.
    """

    start: float
    end: float
    kind: str


def find_stretches(feet: Feet) -> tuple[Stretch, ...]:
    """Divide a capture, of which the `feet` are given, by what the walker does.

    Steady is who moves at three quarters of his brisk speed or faster, and turns by less than 30 degrees a second.
    A curved path becomes several steady stretches, in each of which the direction changes by 30 degrees at most. Who
    steps without moving ahead, as on a treadmill, is steady throughout.
    """
    kinds = _kinds(feet)
    _absorb(kinds, feet.fps)
    edges = [0, *(np.flatnonzero(np.diff(kinds)) + 1).tolist(), len(kinds)]
    names = ("steady", "standing", "turning", "changing speed", "unseen")
    found = []
    for first, last in pairwise(edges):
        cuts = _straight_pieces(feet, first, last) if kinds[first] == 0 else [first, last]
        found += [Stretch(a / feet.fps, b / feet.fps, names[kinds[first]]) for a, b in pairwise(cuts)]
    return tuple(found)


def on_treadmill(feet: Feet) -> bool:
    """Whether somebody, whose `feet` are given, steps without moving ahead."""
    speed = _speed(feet)
    if not np.isfinite(speed).any() or np.percentile(speed, _BRISK) >= _STANDS:
        return False
    ranges = [np.ptp(bridged(feet.heel[s])[:, :2] - bridged(feet.pelvis)[:, :2], axis=0).max() for s in feet.sides]
    return bool(ranges) and max(ranges) > _STEPS_IN_PLACE


def _speed(feet: Feet) -> np.ndarray:
    """Horizontal speed of the pelvis (frames,) [m/s], over about a stride."""
    path = smoothed(feet.pelvis[:, :2], feet.fps, _CUTOFF)
    return np.linalg.norm(np.gradient(path, axis=0), axis=-1) * feet.fps if len(path) > 1 else np.zeros(len(path))


def _heading(feet: Feet) -> np.ndarray:
    """Direction in which the pelvis moves (frames,) [degrees], continuous."""
    path = smoothed(feet.pelvis[:, :2], feet.fps, _CUTOFF)
    way = np.gradient(path, axis=0) if len(path) > 1 else np.ones_like(path)
    return np.degrees(np.unwrap(np.arctan2(way[:, 1], way[:, 0])))


def _kinds(feet: Feet) -> np.ndarray:
    """Index of the kind at each frame: 0 steady, 1 standing, 2 turning, 3 changing speed, 4 unseen."""
    known = np.isfinite(feet.pelvis).all(-1)
    kinds = np.zeros(len(known), dtype=int)
    if not known.any():
        return kinds + 4
    if not on_treadmill(feet):
        speed = _speed(feet)
        brisk = np.percentile(speed[known], _BRISK)
        rate = np.abs(np.gradient(_heading(feet))) * feet.fps if len(known) > 1 else np.zeros(len(known))
        kinds[speed < _SLOWER * brisk] = 3
        kinds[(rate > _TURNS) & (speed >= _STANDS)] = 2
        kinds[speed < _STANDS] = 1
    kinds[_hidden(known, round(_SHORTEST * feet.fps))] = 4
    return kinds


def _hidden(known: np.ndarray, least: int) -> np.ndarray:
    """Frames in gaps of at least `least` frames; shorter ones are bridged."""
    hidden = np.zeros(len(known), dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], known, [True]]).astype(np.int8))).reshape(-1, 2)
    for first, last in edges:
        hidden[first:last] = last - first >= least
    return hidden


def _absorb(kinds: np.ndarray, fps: float) -> None:
    """Give runs that are too short to mean anything to a neighbour, the shortest first, in place.

    Beside another kind a run doesn't become steady: who stands a moment later was stopping, however briefly.
    """
    least = round(_SHORTEST * fps)
    while True:
        edges = [0, *(np.flatnonzero(np.diff(kinds)) + 1).tolist(), len(kinds)]
        runs = [slice(*pair) for pair in pairwise(edges)]
        i = min(range(len(runs)), key=lambda i: runs[i].stop - runs[i].start)
        if len(runs) == 1 or runs[i].stop - runs[i].start >= least:
            return
        beside = [run for j, run in enumerate(runs) if abs(j - i) == 1]
        kinds[runs[i]] = kinds[max(beside, key=lambda run: (kinds[run.start] != 0, run.stop - run.start)).start]


def _straight_pieces(feet: Feet, first: int, last: int) -> list[int]:
    """Frames at which a steady stretch is cut, so that its direction changes by `_STRAIGHT` at most in each piece."""
    if on_treadmill(feet):
        return [first, last]
    turned = _heading(feet)[first:last]
    pieces = max(int(np.ceil(np.ptp(turned) / _STRAIGHT)), 1)
    return np.linspace(first, last, pieces + 1).round().astype(int).tolist()
