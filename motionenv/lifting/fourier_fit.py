r"""Robust least-squares fit of a 2D Fourier series to a walk in the image (paper B, eqs. 3.1, 3.4).

    position of marker m at time t = columns(2πft) ŵ_m + drift(t),      ŵ_m = (p0, p1, q1, p2, q2), drift has mean 0

In pixels, the right-hand side is multiplied by size(t), a parabola in time with mean 1, because a walker who approaches
the camera grows. It is estimated by regressing the markers' heights in each frame on their mean heights.

All markers share one frequency f and one polynomial drift, the walker's motion across the image. The normal equations
of each marker use only the frames that show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers.extraction import best_frequency
from motionenv.models.eigenwalkers.fourier_series import PARTS, columns
from motionenv.types import MARKERS, Points, frozen

#: Least number of strides for a fit.
LEAST_CYCLES = 1.5

_LEAST = 8  # frames that must show a marker to determine its five coefficients
_DETERMINED = 0.01  # least eigenvalue of the normal equations per frame; 0.5 if phases are covered uniformly
_HUBER = 2.0  # [standard deviations] threshold of Huber's weights
_ROUNDS = 4  # iterations of reweighting
_MEDIAN = 1.1774  # median distance of a two-dimensional Gaussian from its centre, in standard deviations
_PARTS = len(PARTS)


@dataclass(frozen=True, eq=False, repr=False)
class Series(OneLine):
    """Fourier series of a walk in the image of one camera, with phase 0 at the first frame.

    Attributes:
        coefficients: (5, 15, 2) in the points' unit, across and upwards; NaN for markers with too few observations.
        frequency, cycles: strides per second [Hz], and number of strides observed.
        drift: (degree + 1, 2) coefficients of 1, t, t², ... [s] of the motion common to all markers, in the points'
            unit, second axis upwards; mean 0 over the frames.
        size: (3,) coefficients of 1, t, t² of the relative image size, with mean 1; (1, 0, 0) in metres.
        rms: (15,) root mean square residual of each marker over frames and both coordinates.
        explained: share of the variance about the mean posture (without drift; outliers weigh less) that it explains.
        weights: (frames, 15) in [0, 1]: below 1 for outliers, 0 where a marker is missing.
        unit, fps, name: "m" or "px", frame rate [Hz], and label of the recording.
    """

    coefficients: np.ndarray
    frequency: float
    cycles: float
    drift: np.ndarray
    size: np.ndarray
    rms: np.ndarray
    explained: float
    weights: np.ndarray
    unit: str
    fps: float
    name: str = ""

    def __post_init__(self) -> None:
        n = len(MARKERS)
        shapes = {
            "coefficients": (_PARTS, n, 2), "drift": (None, 2), "size": (3,), "rms": (n,), "weights": (None, n),
        }  # fmt: skip
        for key, shape in shapes.items():
            object.__setattr__(self, key, frozen(getattr(self, key), shape, f"Series.{key}"))

    def drift_at(self, t: ArrayLike) -> np.ndarray:
        """Common motion (..., 2) at times `t` (...) [s] since the first frame."""
        return np.asarray(t, dtype=np.float64)[..., None] ** np.arange(len(self.drift)) @ self.drift

    def size_at(self, t: ArrayLike) -> np.ndarray:
        """Relative image size (...), with mean 1, at times `t` (...) [s] since the first frame."""
        return np.asarray(t, dtype=np.float64)[..., None] ** np.arange(3) @ self.size

    def positions_at(self, t: ArrayLike) -> np.ndarray:
        """Fitted marker positions (..., 15, 2), second axis upwards, at times `t` (...) [s] since the first frame."""
        t = np.asarray(t, dtype=np.float64)
        waves = np.einsum("...h,hmc->...mc", columns(2 * np.pi * self.frequency * t), self.coefficients)
        return (waves + self.drift_at(t)[..., None, :]) * self.size_at(t)[..., None, None]


def fourier_points(points: Points, *, frequencies: Sequence[float] = (0.5, 2.0), drift: int = 3) -> Series:
    """Fit the 2D Fourier series of a walk of at least 1.5 strides.

    The fundamental is the stride frequency, found by a scan and then refined; coefficients and drift have a closed form
    given the frequency. Huber weights, scaled by each marker's median residual, limit the influence of outliers.

    Args:
        points: image points of one camera; any gaps are allowed, also missing markers.
        frequencies: (low, high) stride frequencies to search [Hz].
        drift: degree in time of the motion common to all markers; 1 is constant speed.

    Raises:
        MotionError: an argument out of range.
        GapError: fewer than 1.5 strides, or no marker with enough observations.
    """
    _check(points, frequencies, drift)
    who, seconds = points.name or "this walk", len(points.positions) / points.fps
    low, high = frequencies
    if LEAST_CYCLES / seconds >= high:
        raise GapError(f"{who} lasts {seconds:.2f} s, too short for {LEAST_CYCLES:g} strides: use a longer sequence")
    low = max(low, 0.8 * LEAST_CYCLES / seconds)
    size = _size(points)
    growth = np.polynomial.polynomial.polyval(np.arange(len(points.positions)) / points.fps, size)
    upward = points.upward / growth[:, None, None]
    weights = np.isfinite(upward).all(axis=-1).astype(np.float64)
    for iteration in range(_ROUNDS):
        normal = _Normal(upward, weights, points.fps, drift, who)
        frequency = best_frequency(normal.variance, low, high, seconds)
        if iteration:  # the first estimate still includes the outliers
            low, high = max(low, 0.9 * frequency), min(high, 1.1 * frequency)
        off = normal.residuals(frequency)
        weights = _huber(off, weights > 0)
    if frequency * seconds < LEAST_CYCLES:
        raise GapError(
            f"{who} shows {frequency * seconds:.2f} strides; at least {LEAST_CYCLES:g} are needed: "
            "use a longer sequence"
        )
    return normal.series(frequency, points, size)


def _check(points, frequencies, drift) -> None:
    if not isinstance(points, Points):
        raise MotionError(
            f"points must be Points, got {type(points).__name__}: read them with motionenv.read_points, or make them "
            "with motionenv.lifting.project_markers"
        )
    if not 0 < frequencies[0] < frequencies[1] < np.inf:
        raise MotionError(f"frequencies must be (low, high) in Hz with 0 < low < high, got {frequencies!r}")
    if drift not in range(10):
        raise MotionError(f"drift must be a whole number from 0 to 9, got {drift!r}")


def _size(points: Points) -> np.ndarray:
    """Coefficients (3,) of the relative image size in time [s]; (1, 0, 0) where the points do not determine it."""
    heights, still = points.upward[..., 1], np.array([1.0, 0.0, 0.0])
    seen = np.isfinite(heights)
    if points.unit == "m" or not seen.any():
        return still
    mean = lambda values, axis: np.where(seen, values, 0.0).sum(axis=axis) / np.maximum(seen.sum(axis=axis), 1)
    usual = np.where(seen, mean(heights, 0), np.nan)
    about = usual - mean(usual, 1)[:, None]
    spread = np.nansum(about**2, axis=1)
    told = spread > 0.25 * spread.max()
    if told.sum() < _LEAST or not spread.max() > 0:
        return still
    t = np.arange(len(heights)) / points.fps
    slope = np.nansum(about * heights, axis=1)[told] / spread[told]
    found = np.polynomial.polynomial.polyfit(t[told], slope, 2)
    growth = np.polynomial.polynomial.polyval(t, found)
    return found / growth.mean() if growth.min() > 0.2 * growth.max() else still


def _huber(off: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Huber weights (frames, 15) of residuals (frames, 15, 2)."""
    distance = np.linalg.norm(off, axis=-1)
    fitted = seen & np.isfinite(distance)
    weights = seen.astype(np.float64)  # markers without a series have no residuals, but may get a series later
    for m in np.flatnonzero(fitted.any(axis=0)):
        near = _HUBER * np.median(distance[fitted[:, m], m]) / _MEDIAN
        weights[fitted[:, m], m] = near / np.maximum(distance[fitted[:, m], m], max(near, 1e-300))
    return np.where(seen, np.minimum(weights, 1.0), 0.0)


class _Normal:
    """Weighted normal equations at any frequency, joint over all markers because they share the drift."""

    def __init__(self, upward: np.ndarray, weights: np.ndarray, fps: float, drift: int, who: str):
        self.weights, self.seen, self.who = weights, weights > 0, who
        self.t = np.arange(len(upward)) / fps
        self.middle = _mean(upward, self.seen)
        self.y = np.where(self.seen[..., None], upward - self.middle, 0.0)
        u = 2 * self.t / max(self.t[-1], 1e-9) - 1
        path = legvander(u, drift)[:, 1:]
        self.path = path - path.mean(axis=0)

    def variance(self, frequency: float) -> float:
        return self.solve(frequency)[2]

    def solve(self, frequency: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Coefficients (15, 5, 2), path coefficients (drift, 2), and the weighted sum of squared residuals."""
        a = np.concatenate([columns(2 * np.pi * frequency * self.t), self.path], axis=1)
        n = a.shape[1]
        matrix = (self.weights.T @ (a[:, :, None] * a[:, None, :]).reshape(len(a), -1)).reshape(-1, n, n)
        right = np.einsum("tk,tmc->mkc", a, self.weights[..., None] * self.y, optimize=True)
        some = self._determined(matrix[:, :_PARTS, :_PARTS])
        matrix, right = matrix[some], right[some]
        inner = np.linalg.solve(
            matrix[:, :_PARTS, :_PARTS], np.concatenate([matrix[:, :_PARTS, _PARTS:], right[:, :_PARTS]], axis=-1)
        )
        into, alone = inner[..., : n - _PARTS], inner[..., n - _PARTS :]
        schur = (matrix[:, _PARTS:, _PARTS:] - matrix[:, _PARTS:, :_PARTS] @ into).sum(axis=0)
        left = (right[:, _PARTS:] - matrix[:, _PARTS:, :_PARTS] @ alone).sum(axis=0)
        path = np.linalg.lstsq(schur, left, rcond=None)[0]
        found = np.full((len(MARKERS), _PARTS, 2), np.nan)
        found[some] = alone - into @ path
        square = (self.weights[..., None] * self.y**2).sum() - (path * right[:, _PARTS:].sum(axis=0)).sum()
        return found, path, square - (found[some] * right[:, :_PARTS]).sum()

    def residuals(self, frequency: float) -> np.ndarray:
        """Residuals (frames, 15, 2); NaN for markers without a series."""
        found, path, _ = self.solve(frequency)
        waves = np.einsum("tk,mkc->tmc", columns(2 * np.pi * frequency * self.t), found)
        return self.y - waves - (self.path @ path)[:, None]

    def series(self, frequency: float, points: Points, size: np.ndarray) -> Series:
        """Build the `Series` at `frequency`."""
        found, path, left = self.solve(frequency)
        off = np.where(self.seen[..., None], self.residuals(frequency), np.nan)
        coefficients = found.transpose(1, 0, 2).copy()
        coefficients[0] += self.middle
        still = self.y - (self.path @ path)[:, None]
        about = still - _mean(still, self.weights)
        total = (self.weights[..., None] * about**2).sum()
        power = np.polynomial.polynomial.polyfit(self.t, self.path @ path, self.path.shape[1])
        return Series(
            coefficients, frequency, frequency * len(self.t) / points.fps, power, size,
            np.sqrt((_mean(np.nan_to_num(off) ** 2, self.seen)).mean(axis=-1)) + 0 * found[:, 0, 0],
            1 - left / total if total > 0 else 0.0, self.weights, points.unit, points.fps, points.name,
        )  # fmt: skip

    def _determined(self, matrix: np.ndarray) -> np.ndarray:
        """Markers seen in enough frames and phases to determine five coefficients."""
        least = np.linalg.eigvalsh(matrix)[:, 0]
        some = (self.seen.sum(axis=0) >= _LEAST) & (least > _DETERMINED * self.weights.sum(axis=0))
        if not some.any():
            raise GapError(f"{self.who} shows no marker in enough frames, at least {_LEAST} all over the stride")
        return some


def _mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted mean over frames (15, 2) of values (frames, 15, 2); 0 where all weights are 0."""
    total = weights.sum(axis=0)[:, None]
    sums = np.where(weights[..., None] > 0, weights[..., None] * values, 0.0).sum(axis=0)
    return sums / np.where(total > 0, total, 1)
