"""Noise model of lifting: the residuals about a two-harmonic walker, and the weight of each point."""

from dataclasses import dataclass

import numpy as np

from motionenv.types import MARKERS

_DEGREES = 4.0  # degrees of freedom of Student's t: the usual choice (Lange, Little & Taylor 1989)
_FLOOR = 1e-8  # [m²] least variance
_SHRINK = 8.0  # weight, in frames, of the pooled variance in each marker's own
_FITTED = 5  # fitted coefficients per marker coordinate
_BAND = 2.5  # [cycles per stride] residuals up to this frequency affect the coefficients


@dataclass
class Noise:
    """Variances [m²] per coordinate of the 15 markers, each (15,).

    Attributes:
        total: residual variance about the walker.
        slow: per-frame variance at the frequencies of the walker's coefficients. Used as the variance of independent
            frames, it gives the coefficients their true uncertainty. It is several times `total`, because real strides
            differ from one another.
        deviation: the temporally correlated part of `total`, which belongs to the person and not to the camera.
    """

    total: np.ndarray
    slow: np.ndarray
    deviation: np.ndarray


def robust_weights(residual: np.ndarray, seen: np.ndarray, total: np.ndarray, robust: bool = True) -> np.ndarray:
    """Student's t weights (frames, 15) of residuals (frames, 15, 2) [m]; 0 for missing points."""
    if not robust:
        return seen.astype(float)
    squared = (residual**2).sum(axis=-1) / total
    return np.where(seen, (_DEGREES + 2) / (_DEGREES + squared), 0.0)


def first_noise(residual: np.ndarray, seen: np.ndarray) -> Noise:
    """One variance for all markers, from the median of the residuals (frames, 15, 2) [m], which resists outliers."""
    squared = (residual[seen] ** 2).sum(axis=-1)
    variance = np.full(len(MARKERS), max(np.median(squared) / (2 * np.log(2)), _FLOOR))
    return Noise(variance, 4 * variance, variance)


def noise(residual: np.ndarray, weights: np.ndarray, cycles: float) -> Noise:
    """Estimate variances from residuals (frames, 15, 2) [m] with robust weights (frames, 15) over `cycles` strides."""
    count = weights.sum(axis=0)
    free = np.maximum(count - _FITTED, 0.0)
    total = _shrunk((weights[..., None] * residual**2).sum(axis=(0, 2)) / 2, free)
    slow = np.maximum(_slow(residual, weights, count, cycles), total)
    lag = [_autocovariance(residual, weights, k) for k in (1, 2)]
    correlated = (4 * lag[0] - lag[1]) / 3 * count / np.maximum(free, 1.0)  # lag 0 by c(k) = c(0) - a k²
    deviation = np.clip(_shrunk(np.where(free > 0, correlated, 0.0) * free, free), 0.0, total)
    return Noise(total, slow, deviation)


def _slow(residual, weights, count, cycles: float) -> np.ndarray:
    """Variance per frame (15,) in the band of the coefficients, estimated between the harmonics."""
    frames = len(residual)
    highest = max(int(_BAND * cycles), 3)
    angles = 2 * np.pi * np.arange(highest + 1)[:, None] * np.arange(frames) / frames
    waves = np.concatenate([np.ones((1, frames)), *(np.sqrt(2) * f(angles[1:]) for f in (np.sin, np.cos))])
    sums = np.einsum("kt,tmi->kmi", waves, weights[..., None] * residual)
    energy = (sums**2).sum(axis=(0, 2)) / 2 / np.maximum(count, 1.0)
    free = np.where(count > _FITTED, len(waves) - _FITTED, 0.0)
    return _shrunk(energy * (free > 0), free)


def _autocovariance(residual, weights, lag: int) -> np.ndarray:
    """Autocovariance (15,) per coordinate of the residuals at `lag` frames."""
    both = weights[lag:] * weights[:-lag]
    products = (residual[lag:] * residual[:-lag]).sum(axis=-1)
    return (both * products).sum(axis=0) / 2 / np.maximum(both.sum(axis=0), 1e-9)


def _shrunk(sums: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Each marker's variance (15,) from its sum of squares, shrunk towards the pooled variance."""
    common = max(sums.sum() / max(free.sum(), 1.0), _FLOOR)
    return np.maximum((sums + _SHRINK * common) / (free + _SHRINK), _FLOOR)
