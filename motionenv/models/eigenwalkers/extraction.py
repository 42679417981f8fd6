"""Fourier representations of captured walks (paper B, section 3.1), by least squares on the known samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize_scalar

from motionenv._core.runs import runs
from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers import fourier_series as series
from motionenv.models.eigenwalkers.fourier_series import HIGHER, LEFT_ANKLE, PARTS, PELVIS, RIGHT_ANKLE, FourierWalker
from motionenv.types import MARKERS, Markers, Motion

if TYPE_CHECKING:
    from motionenv.gait import Stride

_PARTS = len(PARTS)
_TRAVEL = 0.2  # [m/s] least speed at which the pelvis' velocity, and not the body's orientation, gives the heading
_LEAST = 8  # frames in which a marker must be seen, for five coefficients
_DETERMINED = 0.01  # least eigenvalue of the normal equations per frame; 0.5 if all phases are seen equally often
_STRIDES = 2  # at least
_SCAN = 8  # frequencies tried per resolution 1 / duration


def fourier_walker(
    walk: Markers | Motion, *, frequencies: Sequence[float] = (0.5, 2.0), steady: float = 0.6, drift: int = 3
) -> FourierWalker:
    """The Fourier representation of a walk (eq. 3.1, 3.2), normalised as in `fourier_series`.

    Frequency, drift of the pelvis and coefficients minimise the squared residual: the frequency by a scan and a
    continuous refinement, the others in closed form. The best frequency is that of strides, not of steps: at the
    steps', the series can't represent the alternation of left and right.

    The paper's walkers stay in place on a treadmill. People who walk over ground speed up and slow down, which a
    periodic series can't represent. So only the steady stretch is used, and the pelvis' travel, a polynomial in time,
    is subtracted from all markers.

    Args:
        walk: the 15 markers of `motionenv.types.MARKERS`, (frames, 15, 3) [m], NaN where missing; or a motion.
        frequencies: least and greatest stride frequency [Hz] to try.
        steady: keep the longest stretch in which the pelvis moves at this share of its brisk speed or faster (see
            `steady_stretch`); 0 keeps all.
        drift: degree of the polynomial of the pelvis' horizontal travel; 1 is a constant speed.

    Raises:
        MotionError: other markers, infinite positions, or a setting out of range.
        GapError: too short for two strides, or too few frames show the pelvis and both ankles.
    """
    markers = _markers_of(walk) if isinstance(walk, Motion) else walk
    _check(markers, frequencies, steady, drift)
    positions = markers.positions[steady_stretch(markers, steady)]
    t = (np.arange(len(positions)) - (len(positions) - 1) / 2) / markers.fps
    seconds = len(positions) / markers.fps
    low, high = _resolvable(frequencies, seconds, markers.name)
    gaps = _gaps(np.isfinite(positions).all(axis=-1))
    residual = lambda f: _series(positions, gaps, t, f, drift)[2]
    frequency = best_frequency(residual, low, high, float(np.ptp(t)))
    if frequency * seconds < _STRIDES:
        raise GapError(f"{markers.name or 'this walk'} has fewer than two strides in its steady stretch: leave it out")
    coefficients, velocity, variance = _series(positions, gaps, t, frequency, drift)
    power = series.harmonic_power(coefficients[:_PARTS])
    shares = power / (power.sum() + variance)
    way = _way(coefficients[0], velocity, markers.name)
    all_ = series.in_phase(_turned(coefficients, way))
    w = series.grounded(series.centred(all_[:_PARTS]))
    heading = float(np.arctan2(way[1], way[0]))
    return FourierWalker(
        w, frequency, float(velocity @ way), shares, frequency * seconds, markers.name, heading, all_[_PARTS:]
    )


def walker_of_strides(markers: Markers, strides: Sequence[Stride], headings: np.ndarray) -> FourierWalker:
    """The mean Fourier representation of single strides, which may lie on a curve or on a treadmill.

    Each is taken along its own chord, and closed: its travel and its turn, and the drift of each marker, are taken out
    evenly over its duration.

    Args:
        markers: the 15 markers of `motionenv.types.MARKERS`, (frames, 15, 3) [m], NaN where missing.
        strides: as of `motionenv.gait.find_strides`.
        headings: (n,) direction of each stride's chord [rad].

    Raises:
        MotionError: other markers, or infinite positions.
        GapError: too few frames show the pelvis or the ankles.
    """
    _check(markers, (0.1, 10.0), 0.0, 1)
    found, power = [], []
    for stride, heading in zip(strides, headings, strict=True):
        still, t = _closed_stride(markers, stride, float(heading))
        gaps = _gaps(np.isfinite(still).all(axis=-1))
        if not any(PELVIS in some and len(still[frames]) >= _LEAST for frames, some in gaps):
            continue
        coefficients, _, variance = _series(still, gaps, t, 1 / stride.seconds, 0)
        if np.isfinite(coefficients[:_PARTS, [LEFT_ANKLE, RIGHT_ANKLE]]).all((0, 2)).any():
            found.append(series.centred(series.in_phase(coefficients)))
            shares = series.harmonic_power(coefficients[:_PARTS])
            power.append(shares / (shares.sum() + variance))
    if not found:
        raise GapError(f"{markers.name or 'this walk'} shows the pelvis and an ankle in no whole stride: leave it out")
    known = np.isfinite(found)
    w = np.where(known, found, 0.0).sum(0) / np.where(known.any(0), known.sum(0), np.nan)
    seconds = np.array([stride.seconds for stride in strides])
    speed = sum(stride.length for stride in strides) / seconds.sum()
    heading = float(np.angle(np.exp(1j * headings).sum()))
    w = series.in_phase(w)
    return FourierWalker(
        series.grounded(w[:_PARTS]), float(np.exp(-np.log(seconds).mean())), float(speed), np.mean(power, 0),
        len(strides), markers.name, heading, w[_PARTS:],
    )  # fmt: skip


def _closed_stride(markers: Markers, stride: Stride, heading: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions (frames, 15, 3) [m] of a stride in place, along x, and the frames' times from its middle [s]."""
    ends = np.array([stride.start, stride.end]) * markers.fps
    frames = np.arange(int(np.ceil(ends[0] - 1e-6)), min(int(ends[1] + 1e-6), len(markers.positions) - 1) + 1)
    share = (frames - ends[0]) / (ends[1] - ends[0]) - 0.5
    positions = markers.positions.copy()
    path = _filled(positions[:, PELVIS, :2], markers.name)
    clock = np.arange(len(path))
    at = lambda column, times: np.interp(times, clock, column)
    way = np.stack([at(column, ends) for column in path.T], -1)
    turn = _turn(positions[[frames[0], frames[-1]]]) * (ends[1] - ends[0]) / max(frames[-1] - frames[0], 1)
    own = positions[frames]
    own[..., :2] -= (way.mean(0) + share[:, None] * (way[1] - way[0]))[:, None]
    c, s = np.cos(heading + share * turn), np.sin(heading + share * turn)
    x, y = own[..., 0].copy(), own[..., 1].copy()
    own[..., 0], own[..., 1] = c[:, None] * x + s[:, None] * y, c[:, None] * y - s[:, None] * x
    # On a curve, the way bulges to the outside of its chord.
    own[..., 1] += (0.5 * turn * np.linalg.norm(way[1] - way[0]) * (0.25 - share**2))[:, None]
    drift = np.nan_to_num(own[-1] - own[0]) / max(share[-1] - share[0], 1e-9)
    return own - share[:, None, None] * drift, share * stride.seconds


def _turn(ends: np.ndarray) -> float:
    """By how much the body turns to the left between two frames (2, 15, 3) of one phase [rad]; 0 if it isn't seen."""
    left, right = ([MARKERS.index(f"{side}_{joint}") for joint in ("hip", "shoulder")] for side in ("left", "right"))
    across = np.nansum((ends[:, left] - ends[:, right])[..., :2], axis=1) @ [1, 1j]
    return float(np.angle(across[1] * np.conj(across[0])))


def steady_stretch(markers: Markers, share: float = 0.6) -> slice:
    """The longest stretch of frames in which the pelvis moves at `share` of its brisk speed or faster.

    The pelvis' speed is averaged over half a second, about a step; the brisk speed is its 90th percentile. A walker in
    place, as on a treadmill, is steady throughout. Markers are (frames, 15, 3) [m].

    Raises:
        GapError: too few frames show the pelvis.
    """
    pelvis = _filled(markers.positions[:, PELVIS, :2], markers.name)
    step = max(round(0.5 * markers.fps), 1)
    if len(pelvis) < 2 * step:
        return slice(0, len(pelvis))
    speed = np.linalg.norm(pelvis[step:] - pelvis[:-step], axis=-1) * markers.fps / step
    speed = np.pad(uniform_filter1d(speed, step), (step - step // 2, step // 2), mode="edge")
    brisk = np.percentile(speed, 90)
    fast = (speed >= share * brisk) | (brisk < _TRAVEL)
    return slice(*max(runs(fast), key=lambda run: run[1] - run[0]))


def best_frequency(residual: Callable[[float], float], low: float, high: float, seconds: float) -> float:
    """The frequency [Hz] of least residual, by a scan from `low` to `high` and a refinement around its minimum.

    The scan's resolution follows from the duration in seconds.
    """
    scan = np.linspace(low, high, int(np.ceil((high - low) * seconds * _SCAN)) + 2)
    best = int(np.argmin([residual(f) for f in scan]))
    bounds = scan[max(best - 1, 0)], scan[min(best + 1, len(scan) - 1)]
    return float(minimize_scalar(residual, bounds=bounds, method="bounded", options={"xatol": 1e-12}).x)


def _markers_of(motion: Motion) -> Markers:
    from motionenv.body.kinematics import shown_markers  # numba takes a while

    return Markers(MARKERS, shown_markers(motion.poses, motion.skeleton), motion.fps, name=motion.name)


def _check(markers: Markers, frequencies, steady, drift) -> None:
    if not isinstance(markers, Markers) or markers.names != MARKERS or markers.positions.ndim != 3:
        have = f"names {markers.names}" if isinstance(markers, Markers) else type(markers).__name__
        raise MotionError(
            "fourier_walker needs one sequence of Markers (frames, 15, 3) with the names of motionenv.types.MARKERS; "
            f"make them with motionenv.mocap.retargeting.to_markers. Got {have}"
        )
    if np.isinf(markers.positions).any():
        raise MotionError("markers hold infinite positions: mark missing positions with NaN")
    if not 0 < frequencies[0] < frequencies[1] < np.inf:
        raise MotionError(f"frequencies must be the least and the greatest stride rate [Hz], got {frequencies!r}")
    if not 0 <= steady <= 1 or drift not in range(10):
        raise MotionError(f"steady must be from 0 to 1 and drift from 0 to 9, got {steady!r} and {drift!r}")


def _resolvable(frequencies, seconds: float, name: str) -> tuple[float, float]:
    """Range of frequencies to scan, from 1.3 strides in `seconds`, so that a walk of less than two is recognised."""
    low, high = frequencies
    if _STRIDES / seconds >= high:
        raise GapError(
            f"{name or 'this walk'} is steady for only {seconds:.2f} s, too short for two strides at {high:g} strides "
            "per second: leave it out, or lower steady="
        )
    return max(low, 0.65 * _STRIDES / seconds), high


def _filled(pelvis: np.ndarray, name: str) -> np.ndarray:
    """The pelvis' path (frames, 2), linearly interpolated across gaps."""
    seen = np.isfinite(pelvis).all(axis=-1)
    if seen.sum() < _LEAST:
        raise GapError(f"{name or 'this walk'} shows the pelvis in only {seen.sum()} frames: leave it out")
    frames = np.arange(len(pelvis))
    return np.stack([np.interp(frames, frames[seen], pelvis[seen, i]) for i in (0, 1)], axis=-1)


def _way(posture: np.ndarray, velocity: np.ndarray, name: str) -> np.ndarray:
    """Direction of walking, a unit vector (2,): that of the pelvis' velocity or, in place, the one the body faces."""
    if np.hypot(*velocity) >= _TRAVEL:
        return velocity / np.hypot(*velocity)
    left, right = ([MARKERS.index(f"{side}_{joint}") for joint in ("hip", "shoulder")] for side in ("left", "right"))
    x, y = np.nansum((posture[left] - posture[right])[:, :2], axis=0)
    if not np.hypot(x, y) > 0:
        raise GapError(f"{name or 'this walk'} stays in place and shows neither both hips nor both shoulders")
    return np.array([y, -x]) / np.hypot(x, y)


def _turned(coefficients: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Coefficients (5, 15, 3) turned about the vertical so that `way` (2,) becomes x."""
    x, y = way
    return coefficients @ np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]]).T


def _series(positions, gaps, t, frequency: float, drift: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (17, 15, 3), mean velocity (2,) of the pelvis and residual variance [m²] at one frequency.

    The first five are eq. 3.1's; those of the `HIGHER` harmonics, and the variance, are of what these leave.
    """
    every = series.columns(2 * np.pi * frequency * t, harmonics=HIGHER[-1])
    basis, finer = every[:, :_PARTS], every[:, _PARTS:]
    path = (t / t[-1])[:, None] ** np.arange(1, drift + 1)
    there = next(frames for frames, some in gaps if PELVIS in some)
    bent = np.linalg.lstsq(np.column_stack([basis, path])[there], positions[there, PELVIS], rcond=None)[0][_PARTS:]
    travel = path @ (bent * [1.0, 1.0, 0.0])
    still = positions - travel[:, None, :]
    coefficients, variance = np.full((every.shape[1], len(MARKERS), 3), np.nan), 0.0
    for frames, some in gaps:
        a = basis[frames]
        if len(a) < _LEAST or np.linalg.eigvalsh(a.T @ a)[0] < _DETERMINED * len(a):
            continue
        y = still[np.ix_(frames, some)].reshape(len(a), -1)
        x = np.linalg.solve(a.T @ a, a.T @ y)
        rest = y - a @ x
        variance += (rest**2).sum() / len(a)
        coefficients[:_PARTS, some] = x.reshape(_PARTS, -1, 3)
        normal = finer[frames].T @ finer[frames]
        if np.linalg.eigvalsh(normal)[0] >= _DETERMINED * len(a):
            coefficients[_PARTS:, some] = np.linalg.solve(normal, finer[frames].T @ rest).reshape(len(normal), -1, 3)
    return coefficients, (travel[-1] - travel[0])[:2] / np.ptp(t), variance


def _gaps(seen: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Each distinct mask of frames (frames,), with the indices (n,) of the markers seen in exactly these frames."""
    patterns, which = np.unique(seen, axis=1, return_inverse=True)
    return [(frames, np.flatnonzero(which.reshape(-1) == j)) for j, frames in enumerate(patterns.T)]
