"""Gait events from the paths of heels and toes.

Candidates are those of Zeni, Richards & Higginson (2008, Gait Posture 27): at initial contact the heel is furthest
ahead of the pelvis, at toe-off the toe furthest behind. But the heel is furthest ahead some 50 ms before it meets the
ground, the more so the faster somebody walks. So initial contact is moved to where the heel's fall is stopped hardest,
the peak of its vertical acceleration, within a few frames of where the heel stops moving ahead. The toe of a runner is
furthest behind some 50 ms after it leaves the ground; there, toe-off is where it begins to move fast.

`benchmarks/mocap/events.py` measures the error. The constants of contacts (`_STOPS`, `_NEAR`, `_FAST`) were chosen by
leaving out one laboratory at a time; `_LEAVES` was chosen on all of them, and concerns runners.
"""

import numpy as np
from scipy.signal import find_peaks

from motionenv.gait.feet import Feet
from motionenv.gait.signals import bridged, smoothed
from motionenv.gait.stretches import on_treadmill
from motionenv.types import Event

_HEADING, _SLOW, _FAST = 0.5, 7.0, 14.0  # [Hz] cut-off frequencies for the direction, candidates, and the impact
_STILL = 0.1  # [m/s] of a pelvis that goes nowhere
_STEP = 0.35  # [s] least time between two candidates of one kind and side
_SWING = 0.1  # [m] least prominence of a candidate: a foot that travels less doesn't step
_STOPS = 0.5  # [m/s] over the floor, below which a heel has stopped moving ahead; at most half its speed before
_LEAVES = 1.6  # [m/s] over the floor of a toe that has left it; in running it is not yet furthest behind then
_LANDING = (0.02, 0.25)  # [s] before and after a candidate in which the heel stops
_NEAR = 0.035  # [s] around that, in which its fall is stopped hardest
_BELT = 5  # percentile of the velocity ahead of a foot on a treadmill: that of the belt on which it stands
_BACKWARDS = -0.5  # cosine between foot and travel of who walks backwards
_HIDDEN = 0.5  # most share of unknown frames within `_AROUND` of an event
_AROUND = 0.1  # [s]


def kinematic_events(feet: Feet) -> tuple[Event, ...]:
    """Initial contacts and toe-offs of `feet`, in the order of time.

    Who walks backwards lands on the toes and leaves with the heel, so these change places.
    """
    front, back = (feet.toe, feet.heel) if walks_backwards(feet) else (feet.heel, feet.toe)
    ways, fps = directions(feet), feet.fps
    found = []
    for side in feet.sides:
        contacts = _impacts(front[side], candidates(feet, front[side], ways), ways, fps, on_treadmill(feet))
        found += [Event(t, "initial_contact", side) for t in contacts if _seen(front[side], t, fps)]
        offs = _departures(feet, back[side], ways)
        found += [Event(t, "toe_off", side) for t in offs if _seen(back[side], t, fps)]
    return tuple(sorted(found, key=lambda event: event.time))


def candidates(feet: Feet, heel: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Frames of initial contacts according to Zeni et al. (2008): a heel is furthest ahead of the pelvis of `feet`.

    `heel` is (frames, 3) [m], and `ways` the direction of progression (frames, 2) of `directions`.
    """
    return _peaks(_ahead(feet, heel, ways), feet.fps)


def directions(feet: Feet) -> np.ndarray:
    """Direction of progression at each frame (frames, 2): that of the path of the `feet`'s pelvis over about a stride.

    On a treadmill it is the direction in which the feet point; zero if somebody stands throughout.
    """
    pointing = [feet.toe[side] - feet.heel[side] for side in feet.sides]
    if on_treadmill(feet) and any(np.nanmax(np.abs(foot)) > 0 for foot in pointing):
        way = np.sum([smoothed(foot, feet.fps, _HEADING)[:, :2] for foot in pointing], axis=0)
    elif len(feet.pelvis) > 1:
        way = np.gradient(smoothed(feet.pelvis[:, :2], feet.fps, _HEADING), axis=0)
        way[np.linalg.norm(way, axis=-1) * feet.fps < _STILL] = np.nan  # who stands has the direction that he had
        way = np.nan_to_num(bridged(way))
    else:
        way = np.zeros_like(feet.pelvis[:, :2])
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return way / np.where(length > 0, length, 1.0)


def walks_backwards(feet: Feet) -> bool:
    """Whether the `feet` point against the direction of progression."""
    ways = directions(feet)
    pointing = np.concatenate([(feet.toe[s] - feet.heel[s])[:, :2] for s in feet.sides])
    length = np.linalg.norm(pointing, axis=-1)
    known = length > 0  # false where it is NaN
    along = (pointing * np.tile(ways, (len(feet.sides), 1))).sum(-1)[known] / length[known]
    return bool(known.any()) and float(np.median(along)) < _BACKWARDS


def _ahead(feet: Feet, foot: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """How far a point of the foot is ahead of the pelvis (frames,) [m]."""
    apart = smoothed(foot, feet.fps, _SLOW) - smoothed(feet.pelvis, feet.fps, _SLOW)
    return (apart[:, :2] * ways).sum(-1)


def _peaks(signal: np.ndarray, fps: float) -> np.ndarray:
    """Frames at which the signal peaks, the first and the last included if it falls from there."""
    low = np.min(signal)
    padded = np.concatenate([[low], signal, [low]])
    peaks = find_peaks(padded, distance=max(round(_STEP * fps), 1), prominence=_SWING)[0]
    return peaks - 1


def _impacts(heel: np.ndarray, found: np.ndarray, ways: np.ndarray, fps: float, treadmill: bool) -> list[float]:
    """Times [s] of the impact after each candidate; none if the heel is still on its way when the capture ends."""
    if len(heel) < 3:
        return []
    speed = _speed(heel, ways, fps, _FAST, treadmill)
    acceleration = np.gradient(np.gradient(smoothed(heel, fps, _FAST)[:, 2]))
    times = []
    for k in found:
        first, last = max(k - round(_LANDING[0] * fps), 0), k + round(_LANDING[1] * fps)
        slow = first + np.flatnonzero(speed[first : last + 1] < min(_STOPS, 0.5 * speed[k]))
        # A capture that begins with the heel at rest doesn't show its contact, nor one that ends before the heel stops.
        resting = k == 0 and speed[0] < _STOPS
        if resting or not slow.size or not 0 < slow[0] < len(heel) - 1:
            continue
        begin, end = max(slow[0] - round(_NEAR * fps), 1), min(slow[0] + round(_NEAR * fps), len(heel) - 2)
        hardest = begin + int(np.argmax(acceleration[begin : end + 1]))
        times.append(_summit(acceleration, hardest) / fps)
    return times


def _departures(feet: Feet, toe: np.ndarray, ways: np.ndarray) -> list[float]:
    """Times [s] of toe-off: of each candidate, or sooner where the toe is then faster than anybody's who walks."""
    if len(toe) < 3:
        return []
    behind = _ahead(feet, toe, -ways)
    speed = _speed(toe, ways, feet.fps, _SLOW, on_treadmill(feet))
    times = []
    for k in _peaks(behind, feet.fps):
        slow = np.flatnonzero(speed[:k] < _LEAVES)
        if not 0 < k < len(toe) - 1 or not slow.size:
            continue  # it left the ground before the capture begins, or is still on it at the end
        if speed[k] <= _LEAVES:
            times.append(_summit(behind, k) / feet.fps)
        else:
            before, after = speed[slow[-1] : slow[-1] + 2]
            times.append(float(slow[-1] + (_LEAVES - before) / (after - before)) / feet.fps)
    return times


def _speed(foot: np.ndarray, ways: np.ndarray, fps: float, cutoff: float, treadmill: bool) -> np.ndarray:
    """Velocity ahead (frames,) [m/s] of a point of the foot over the floor, or over the belt of a treadmill."""
    velocity = np.gradient(smoothed(foot, fps, cutoff)[:, :2], axis=0) * fps
    speed = (velocity * ways).sum(-1)
    return speed - np.percentile(speed, _BELT) if treadmill else speed


def _summit(signal: np.ndarray, frame: int) -> float:
    """Where the parabola through a peak and its neighbours is highest [frames]."""
    if not 0 < frame < len(signal) - 1:
        return float(frame)
    before, at, after = signal[frame - 1 : frame + 2]
    bend = before - 2 * at + after
    return float(frame + np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else float(frame)


def _seen(path: np.ndarray, time: float, fps: float) -> bool:
    """Whether the point is known around an event."""
    at, around = round(time * fps), max(round(_AROUND * fps), 1)
    near = np.isfinite(path[max(at - around, 0) : at + around + 1]).all(-1)
    return bool(near.size) and near.mean() >= _HIDDEN
