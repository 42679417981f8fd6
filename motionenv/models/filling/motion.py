"""Fill what a capture doesn't show by a gait model's prior."""

from collections import defaultdict
from dataclasses import replace

import numpy as np

from motionenv._core.runs import runs
from motionenv.body.gaps import check_shown
from motionenv.body.skeleton import LIMITS
from motionenv.models.base import GaitModel
from motionenv.models.filling.prior import LAGS, AnglePrior, prior_of
from motionenv.types import Motion

#: Longest gap of the root [s] that is filled.
LONGEST = 0.5

#: Standard deviations of constant, movement and error of measurement, relative to each other, and the movement's scale.
CONSTANT, MOVEMENT, ERROR = 2.0, 1.0, 0.01
SCALE = 0.15  # [s]
#: Frames within this time [s] of a gap are used.
REACH = 1.0

_RATE = 60.0  # [Hz] at which they are used at most
_ROOT = 6  # entries of the root in the pose vector
_HEADING = 5
_TURN = 2 * np.pi


def fill(motion: Motion, *, model: str | GaitModel = "walk/fpca") -> Motion:
    """Fill the unknown entries of a motion with what the known ones and a gait model let expect.

    A joint angle is the conditional mean of `motionenv.models.filling.prior` given the other angles at that time and
    0.3 s around it, plus how its known values just before and after differ from it, interpolated by a Gaussian process
    (`interpolated`). So arms that a capture never shows swing against the legs; a knee that
    is occluded for a moment goes on smoothly; and a motion unlike walking has arms near the model's mean posture.

    The root can't be told from angles. Gaps of up to `LONGEST` between frames that show it are interpolated; in longer
    ones, before the first such frame and after the last, all entries of a frame stay NaN.

    Args:
        motion: (..., frames, 25).
        model: a name or path for `motionenv.load`, or a fitted model of walks. Your own (`motionenv fit`) fills with
            what your people do.

    Returns:
        The motion without those gaps. Known entries are unchanged; `filled` is True where the model gave the value, now
        or before. The same motion and model give the same result: there is nothing random in it.

    Raises:
        GapError: the root is never known, or the model lacks parts of the body itself.
        ModelError: no such model.
    """
    gaps = ~np.isfinite(motion.poses)
    if not gaps.any():
        return motion
    check_shown(motion.poses, ["root"], "filling")
    prior = prior_of(model)
    flat = motion.poses.reshape(-1, *motion.poses.shape[-2:])
    poses = np.stack([_filled(one, motion.fps, prior) for one in flat]).reshape(motion.poses.shape)
    filled = gaps & np.isfinite(poses)
    return replace(motion, poses=poses, filled=filled if motion.filled is None else filled | motion.filled)


def _filled(poses: np.ndarray, fps: float, prior: AnglePrior) -> np.ndarray:
    """Poses (frames, 25) without gaps, but for frames whose root stays unknown."""
    out = poses.copy()
    rooted = np.isfinite(poses[:, :_ROOT]).all(axis=1)
    for first, last in runs(~rooted):
        if 0 < first and last < len(poses) and (last - first) / fps <= LONGEST:
            _bridge(out, first, last, fps)
        else:
            out[first:last] = np.nan
    for first, last in runs(np.isfinite(out[:, 0])):
        out[first:last, _ROOT:] = _with_angles(out[first:last, _ROOT:], fps, prior)
    return np.where(np.isfinite(poses) & np.isfinite(out[:, :1]), poses, out)


def _bridge(poses: np.ndarray, first: int, last: int, fps: float) -> None:
    """Interpolate the unknown root entries of the frames from `first` up to `last`, in place."""
    near = around(first, last, len(poses), fps)
    near = near[np.isfinite(poses[near, :_ROOT]).all(axis=1)]
    frames = np.arange(len(poses))
    for entry in range(_ROOT):
        gap = np.isnan(poses[first:last, entry])
        values = np.full(len(poses), np.nan)
        values[near] = np.unwrap(poses[near, entry]) if entry == _HEADING else poses[near, entry]
        slope, level = np.polyfit(near, values[near], 1) if len(near) > 1 else (0.0, values[near[0]])
        line = slope * frames + level
        inside = line[first:last] + interpolated(values - line, first, last, fps)
        poses[first:last, entry][gap] = inside[gap]


def _with_angles(angles: np.ndarray, fps: float, prior: AnglePrior) -> np.ndarray:
    """Angles (frames, 19) with all gaps filled, the shortest first, so that longer ones can draw on them."""
    out = angles.copy()
    margin = round((REACH + LAGS[-1]) * fps)
    by_run = defaultdict(list)
    for angle, gaps in enumerate(np.isnan(angles).T):
        for run in runs(gaps):
            by_run[run].append(angle)
    for (first, last), wanted in sorted(by_run.items(), key=lambda item: item[0][1] - item[0][0]):
        start, stop = max(first - margin, 0), min(last + margin, len(out))
        expected = prior.predict(out[start:stop], fps, np.array(wanted))
        for angle, curve in zip(wanted, expected.T, strict=True):
            rest = out[start:stop, angle] - curve
            turns = _TURN * np.round(np.median(rest[np.isfinite(rest)]) / _TURN) if np.isfinite(rest).any() else 0.0
            gap = slice(first - start, last - start)
            value = curve[gap] + turns + interpolated(rest - turns, gap.start, gap.stop, fps)
            out[first:last, angle] = np.clip(value, *_range(angle, angles[:, angle]))
    return out


def _range(angle: int, known: np.ndarray) -> tuple[float, float]:
    """Least and greatest value [rad] to fill in: the joint's limits, or what of the capture goes beyond them."""
    low, high = LIMITS[_ROOT + angle]
    known = known[np.isfinite(known)]
    return min(low, known.min(initial=low)), max(high, known.max(initial=high))


def interpolated(values: np.ndarray, first: int, last: int, fps: float) -> np.ndarray:
    """Values (last - first,) of the gap of `values` (frames,) from frame `first` up to, not including, frame `last`.

    By Gaussian-process regression on the frames around it: a constant, which differs from gap to gap, plus a process
    with a Matérn covariance of smoothness 5/2 (Rasmussen & Williams 2006, eq. 4.17), twice differentiable, as limbs
    move, which returns to the constant within about half a second. Values are about 0 where nothing else is known, and
    0 if nothing is known around the gap.
    """
    seen = around(first, last, len(values), fps)
    seen = seen[np.isfinite(values[seen])]
    if not seen.size:
        return np.zeros(last - first)
    covariance = _covariance(seen, seen, fps) + ERROR**2 * np.eye(len(seen))
    return _covariance(np.arange(first, last), seen, fps) @ np.linalg.solve(covariance, values[seen])


def around(first: int, last: int, frames: int, fps: float) -> np.ndarray:
    """Frames (n,) before and after a gap from `first` to `last` in a motion of `frames`, at 60 Hz at most."""
    step, reach = max(1, round(fps / _RATE)), round(REACH * fps)
    before = np.arange(first - 1, max(first - 1 - reach, -1), -step)[::-1]
    return np.concatenate([before, np.arange(last, min(last + reach, frames), step)])


def _covariance(a: np.ndarray, b: np.ndarray, fps: float) -> np.ndarray:
    """Covariance (n, m) between frames a (n,) and b (m,)."""
    r = np.sqrt(5.0) * np.abs(a[:, None] - b) / (SCALE * fps)
    return CONSTANT**2 + MOVEMENT**2 * (1 + r + r**2 / 3) * np.exp(-r)
