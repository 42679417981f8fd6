"""How far points lie from a two-harmonic walker, and how much each of them tells about it."""

from dataclasses import dataclass

import numpy as np

from motionenv.types import MARKERS

_DEGREES = 4.0  # of freedom of Student's t: the usual choice (Lange, Little & Taylor 1989)
_FLOOR = 1e-8  # [m²] least variance
_SHRINK = 8.0  # frames that the markers' common variance counts for in each one's
_FITTED = 5  # coefficients that each coordinate of a marker is fitted with
_BAND = 2.5  # [cycles] frequencies up to here disturb the coefficients


@dataclass
class Noise:
    """Variances [m²] per coordinate of the 15 markers, each (15,).

    Attributes:
        total: of what the walker leaves of the points.
        slow: per frame, at the frequencies of the walker's coefficients: with `slow` as the variance of independent
            frames the coefficients are as sure as they really are. Real strides differ from one another, so it's
            several times `total`.
        deviation: the part of `total` that lasts longer than a frame, which is the person's and not the camera's.
    """

    total: np.ndarray
    slow: np.ndarray
    deviation: np.ndarray


def robust_weights(residual: np.ndarray, seen: np.ndarray, total: np.ndarray, robust: bool = True) -> np.ndarray:
    """Weights (frames, 15) of Student's t for residuals (frames, 15, 2) [m]; 0 where nothing is seen."""
    if not robust:
        return seen.astype(float)
    squared = (residual**2).sum(axis=-1) / total
    return np.where(seen, (_DEGREES + 2) / (_DEGREES + squared), 0.0)


def first_noise(residual: np.ndarray, seen: np.ndarray) -> Noise:
    """One variance for all, from the median of residuals (frames, 15, 2) [m]: outliers don't move it."""
    squared = (residual[seen] ** 2).sum(axis=-1)
    variance = np.full(len(MARKERS), max(np.median(squared) / (2 * np.log(2)), _FLOOR))
    return Noise(variance, 4 * variance, variance)


def noise(residual: np.ndarray, weights: np.ndarray, cycles: float) -> Noise:
    """Variances from residuals (frames, 15, 2) [m] with robust weights (frames, 15), over so many cycles."""
    count = weights.sum(axis=0)
    free = np.maximum(count - _FITTED, 0.0)
    total = _pooled((weights[..., None] * residual**2).sum(axis=(0, 2)) / 2, free)
    slow = np.maximum(_slow(residual, weights, count, cycles), total)
    lag = [_lagged(residual, weights, k) for k in (1, 2)]
    lasting = (4 * lag[0] - lag[1]) / 3 * count / np.maximum(free, 1.0)  # c(k) = c(0) - a k² for small k
    deviation = np.clip(_pooled(np.where(free > 0, lasting, 0.0) * free, free), 0.0, total)
    return Noise(total, slow, deviation)


def _slow(residual, weights, count, cycles: float) -> np.ndarray:
    """Variance per frame (15,) in the band of the coefficients, from the frequencies between theirs."""
    frames = len(residual)
    highest = max(int(_BAND * cycles), 3)
    angles = 2 * np.pi * np.arange(highest + 1)[:, None] * np.arange(frames) / frames
    waves = np.concatenate([np.ones((1, frames)), *(np.sqrt(2) * f(angles[1:]) for f in (np.sin, np.cos))])
    sums = np.einsum("kt,tmi->kmi", waves, weights[..., None] * residual)
    energy = (sums**2).sum(axis=(0, 2)) / 2 / np.maximum(count, 1.0)
    free = np.where(count > _FITTED, len(waves) - _FITTED, 0.0)
    return _pooled(energy * (free > 0), free)


def _lagged(residual, weights, lag: int) -> np.ndarray:
    """Mean product (15,) per coordinate of residuals `lag` frames apart."""
    both = weights[lag:] * weights[:-lag]
    products = (residual[lag:] * residual[:-lag]).sum(axis=-1)
    return (both * products).sum(axis=0) / 2 / np.maximum(both.sum(axis=0), 1e-9)


def _pooled(sums: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Each marker's variance (15,) from its sum of squares, drawn towards that of all markers."""
    common = max(sums.sum() / max(free.sum(), 1.0), _FLOOR)
    return np.maximum((sums + _SHRINK * common) / (free + _SHRINK), _FLOOR)
