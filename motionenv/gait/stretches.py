"""Stretches of a capture in which somebody walks steadily, and those in which he stands, turns or changes speed."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.runs import runs
from motionenv.gait.feet import Feet, smoothed

_CUTOFF = 0.8  # [Hz] below the rhythm of strides
_STANDS = 0.2  # [m/s] of who stands
_SLOWER = 0.75  # share of the brisk speed below which somebody starts or stops
_BRISK = 80  # percentile of the speed
_TURNS = 30.0  # [degrees/s]
_SHORTEST = 0.5  # [s] of a stretch; shorter ones belong to their neighbour
_FEET = 7.0  # [Hz] cut-off frequency for the paths of the feet
_LOWEST = 20  # percentile of the height of a foot that lies flat
_CARRIED = 0.15  # [m/s] at which a belt moves the foot that stands, at least
_DRIFTS = 2.0  # times the speed of who drifts on a belt, at least; on floors, feet that land come to 0.1


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

    Steady is who moves at three quarters of his brisk speed or faster, and turns by less than 30 degrees a second, on
    however long a curve. Who steps without moving ahead, as on a treadmill, is steady throughout.
    """
    kinds = _kinds(feet)
    _absorb(kinds, feet.fps)
    edges = [0, *(np.flatnonzero(np.diff(kinds)) + 1).tolist(), len(kinds)]
    names = ("steady", "standing", "turning", "changing speed", "unseen")
    return tuple(Stretch(a / feet.fps, b / feet.fps, names[kinds[a]]) for a, b in pairwise(edges))


def belt(feet: Feet) -> np.ndarray | None:
    """Velocity (2,) [m/s] of the treadmill on which somebody walks; None if the `feet` stand still on the floor.

    It is the median velocity of the feet while they are lowest, if the pelvis stays in place or drifts slowly.
    """
    speed = _speed(feet)
    if len(speed) < 2 or not np.isfinite(speed).any():
        return None
    lowest = []
    for side in feet.sides:
        foot = smoothed(0.5 * (feet.heel[side] + feet.toe[side]), feet.fps, _FEET)
        velocity = np.gradient(foot[:, :2], axis=0) * feet.fps
        lowest.append(velocity[foot[:, 2] <= np.percentile(foot[:, 2], _LOWEST)])  # none of a foot that is never seen
    velocities = np.concatenate([np.empty((0, 2)), *lowest])
    carried = np.median(velocities, axis=0) if len(velocities) else np.zeros(2)
    brisk = np.percentile(speed, _BRISK)
    return carried if np.linalg.norm(carried) > max(_CARRIED, _DRIFTS * brisk if brisk >= _STANDS else 0.0) else None


def on_treadmill(feet: Feet) -> bool:
    """Whether somebody, whose `feet` are given, steps without moving ahead."""
    return belt(feet) is not None


def heading(feet: Feet) -> np.ndarray:
    """Direction in which the pelvis of the `feet` moves over about a stride (frames,) [degrees], continuous."""
    path = smoothed(feet.pelvis[:, :2], feet.fps, _CUTOFF)
    way = np.gradient(path, axis=0) if len(path) > 1 else np.ones_like(path)
    return np.degrees(np.unwrap(np.arctan2(way[:, 1], way[:, 0])))


def _speed(feet: Feet) -> np.ndarray:
    """Horizontal speed of the pelvis (frames,) [m/s], over about a stride."""
    path = smoothed(feet.pelvis[:, :2], feet.fps, _CUTOFF)
    return np.linalg.norm(np.gradient(path, axis=0), axis=-1) * feet.fps if len(path) > 1 else np.zeros(len(path))


def _kinds(feet: Feet) -> np.ndarray:
    """Index of the kind at each frame: 0 steady, 1 standing, 2 turning, 3 changing speed, 4 unseen."""
    known = np.isfinite(feet.pelvis).all(-1)
    kinds = np.zeros(len(known), dtype=int)
    if not known.any():
        return kinds + 4
    if not on_treadmill(feet):
        speed = _speed(feet)
        brisk = np.percentile(speed[known], _BRISK)
        rate = np.abs(np.gradient(heading(feet))) * feet.fps if len(known) > 1 else np.zeros(len(known))
        kinds[speed < _SLOWER * brisk] = 3
        kinds[(rate > _TURNS) & (speed >= _STANDS)] = 2
        kinds[speed < _STANDS] = 1
    kinds[_hidden(known, round(_SHORTEST * feet.fps))] = 4
    return kinds


def _hidden(known: np.ndarray, least: int) -> np.ndarray:
    """Frames in gaps of at least `least` frames; shorter ones are bridged."""
    hidden = np.zeros(len(known), dtype=bool)
    for first, last in runs(~known):
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
