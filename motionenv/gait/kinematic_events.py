"""Gait events from the paths of heels and toes.

Candidates are those of Zeni, Richards & Higginson (2008, Gait Posture 27): at initial contact the heel is furthest
ahead of the pelvis, at toe-off the toe furthest behind. The heel is furthest ahead some 50 ms before it meets the
ground, the more so the faster somebody walks; so initial contact is moved to where the heel's fall is stopped hardest,
the peak of its vertical acceleration soon after.
"""

import numpy as np
from scipy.signal import find_peaks

from motionenv.gait.feet import Feet
from motionenv.gait.signals import smoothed
from motionenv.types import Event

_SLOW, _FAST = 7.0, 14.0  # [Hz] cut-off frequencies for candidates, and for the impact
_STEP = 0.35  # [s] least time between two candidates of one kind and side
_SWING = 0.1  # [m] least prominence of a candidate: a foot that travels less doesn't step
_BEFORE, _AFTER = 0.02, 0.16  # [s] around a candidate where the impact is looked for
_FALLING = -0.1  # [m/s] vertical velocity of a heel that is about to land
_HIDDEN = 0.5  # most share of unknown frames within `_AROUND` of an event
_AROUND = 0.1  # [s]


def kinematic_events(feet: Feet) -> tuple[Event, ...]:
    """Initial contacts and toe-offs, in the order of time.

    Args:
        feet: heels, toes and pelvis.
    """
    pelvis = smoothed(feet.pelvis, feet.fps, _SLOW)
    ways = directions(feet)
    found = []
    for side in feet.sides:
        heel = smoothed(feet.heel[side], feet.fps, _SLOW)
        toe = smoothed(feet.toe[side], feet.fps, _SLOW)
        ahead = ((heel - pelvis)[:, :2] * ways).sum(-1)
        behind = ((pelvis - toe)[:, :2] * ways).sum(-1)
        contacts = _impacts(feet.heel[side], _peaks(ahead, feet.fps), feet.fps)
        found += [Event(t, "initial_contact", side) for t in contacts if _seen(feet.heel[side], t, feet.fps)]
        offs = [_summit(behind, k) / feet.fps for k in _peaks(behind, feet.fps)]
        found += [Event(t, "toe_off", side) for t in offs if _seen(feet.toe[side], t, feet.fps)]
    return tuple(sorted(found, key=lambda event: event.time))


def directions(feet: Feet) -> np.ndarray:
    """Direction of progression at each frame (frames, 2): that of the pelvis' path over about a stride."""
    path = smoothed(feet.pelvis[:, :2], feet.fps, 0.5)
    way = np.gradient(path, axis=0) if len(path) > 1 else np.ones_like(path)
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return way / np.where(length > 0, length, 1.0)


def _peaks(signal: np.ndarray, fps: float) -> np.ndarray:
    """Frames at which the signal peaks, the first and the last included if it falls from there."""
    low = np.min(signal) - 1.0
    padded = np.concatenate([[low], signal, [low]])
    peaks = find_peaks(padded, distance=max(round(_STEP * fps), 1), prominence=_SWING)[0]
    return peaks - 1


def _impacts(heel: np.ndarray, candidates: np.ndarray, fps: float) -> list[float]:
    """Times [s] of the peak of the heel's vertical acceleration near each candidate."""
    height = smoothed(heel, fps, _FAST)[:, 2]
    if len(height) < 3:
        return []
    acceleration = np.gradient(np.gradient(height))
    times = []
    for k in candidates:
        first, last = max(k - round(_BEFORE * fps), 1), min(k + round(_AFTER * fps), len(height) - 2)
        # Where the trial begins with the heel on its way down, the candidate lies before it.
        if k == len(height) - 1 or last <= first or (k == 0 and height[1] - height[0] > _FALLING / fps):
            continue
        hardest = first + int(np.argmax(acceleration[first : last + 1]))
        times.append(_summit(acceleration, hardest) / fps)
    return times


def _summit(signal: np.ndarray, frame: int) -> float:
    """Where the parabola through a peak and its neighbours is highest [frames]."""
    if not 0 < frame < len(signal) - 1:
        return float(frame)
    before, at, after = signal[frame - 1 : frame + 2]
    bend = before - 2 * at + after
    return frame + float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else float(frame)


def _seen(path: np.ndarray, time: float, fps: float) -> bool:
    """Whether the point is known around an event."""
    at, around = round(time * fps), max(round(_AROUND * fps), 1)
    near = np.isfinite(path[max(at - around, 0) : at + around + 1]).all(-1)
    return bool(near.size) and near.mean() >= _HIDDEN
