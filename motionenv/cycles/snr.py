"""Signal-to-noise ratio of a folded series (Ormoneit et al. 2005, section 3.2, eq. 1-3), all candidates in one pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.errors import GapError, MotionError

#: Residual sums of squares below this fraction of a channel's total are rounding errors, and are raised to it.
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False, repr=False)
class SNR(OneLine):
    """Signal-to-noise ratio as a function of the candidate period (paper A, fig. 5).

    Attributes:
        candidates: (n,) candidate periods [frames].
        channels: (n, m) signal / noise per channel; NaN if undefined: the channel is never observed or constant, there
            are fewer than two non-empty bins, or no bin has two samples.
        total: (n,) sum over the channels where it is defined (eq. 3), else 0.
    """

    candidates: np.ndarray
    channels: np.ndarray
    total: np.ndarray


def snr(z: ArrayLike, candidates: ArrayLike, *, weighting: Literal["counts", "paper"] = "counts") -> SNR:
    """Signal-to-noise ratio of `z` folded at every candidate period, ignoring missing samples (eq. 1-3).

    `"paper"` is eq. 2 as printed, Σ_k (z̄_k - Z̄)² / ((p - 1) p / |I|), which assumes equally many samples in all bins;
    on white noise it drifts with p. `"counts"` weights each bin by its samples, Σ_k n_k (z̄_k - Z̄)² / (p - 1), the
    analysis-of-variance statistic, whose expectation on white noise does not depend on p. In both, p counts the
    non-empty bins, and the noise of eq. 1 has |I| - p degrees of freedom; Z̄ is the mean of each channel.

    Args:
        z: (frames, m), NaN where missing. Remove trends first (root position drifts and has no period).
        candidates: (n,) whole numbers of frames, at least 2.
        weighting: `"counts"` (default) or `"paper"`.

    Raises:
        MotionError: `z` is not (frames, m), or an invalid candidate or `weighting`.
        GapError: `z` has no observations.
    """
    z, seen = checked_series(z)
    if weighting not in ("counts", "paper"):
        raise MotionError(f"weighting must be 'counts' or 'paper', got {weighting!r}")
    given = np.atleast_1d(np.asarray(candidates))
    if given.ndim != 1 or not given.size or (given != np.floor(given)).any() or given.min() < 2:
        raise MotionError(f"candidates must be whole numbers of at least 2 frames, got {candidates!r}")
    order, back = np.unique(given.astype(np.int64), return_inverse=True)
    deviations, total, n = centre(z)
    between, means, bins = np.zeros((3, len(order), z.shape[1]))
    folds: dict[int, np.ndarray] = {}
    both = np.hstack([deviations, seen])
    for i, p in reversed(list(enumerate(order.tolist()))):
        double = folds.get(2 * p)
        folds[p] = folded(both, p) if double is None else double[:p] + double[p:]
        sums, counts = np.hsplit(folds[p], 2)
        mean = sums / np.maximum(counts, 1)
        between[i], means[i], bins[i] = (sums * mean).sum(axis=0), (mean**2).sum(axis=0), (counts > 0).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        signal = between / (bins - 1) if weighting == "counts" else means * n / ((bins - 1) * bins)
        noise = np.maximum(total - between, ROUNDING * total) / (n - bins)
        ratio = np.where((bins > 1) & (n > bins) & (total > 0), signal / noise, np.nan)[back]
    return SNR(given.astype(np.int64), ratio, np.nansum(ratio, axis=1))


def folded(values: np.ndarray, p: int) -> np.ndarray:
    """Sums (p, m) of the rows of `values` (frames, m) that are whole periods of `p` frames apart."""
    whole = np.zeros((-(-len(values) // p) * p, values.shape[1]))
    whole[: len(values)] = values
    return whole.reshape(-1, p, values.shape[1]).sum(axis=0)


def checked_series(z: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """`z` as float64 (frames, m), and where it is observed.

    Raises:
        MotionError: another shape, or infinite values.
        GapError: no observations.
    """
    try:
        z = np.asarray(z, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MotionError(f"a sequence must be numeric of shape (frames, channels): {error}") from None
    if z.ndim != 2 or 0 in z.shape:
        raise MotionError(f"a sequence must have shape (frames, channels), got {z.shape}")
    if np.isinf(z).any():
        raise MotionError("a sequence has infinite values: use NaN for missing values")
    seen = ~np.isnan(z)
    if not seen.any():
        raise GapError(f"a sequence of {len(z)} frames and {z.shape[1]} channels has no observations")
    return z, seen


def centre(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deviations from each channel's mean (0 where missing), their sum of squares (m,), and the counts |I| (m,).

    A channel whose deviations are rounding errors is constant: its sum of squares is exactly 0.
    """
    seen = np.isfinite(z)
    known, n = np.where(seen, z, 0.0), seen.sum(axis=0)
    deviation = np.where(seen, z - known.sum(axis=0) / np.maximum(n, 1), 0.0)
    squares = (deviation**2).sum(axis=0)
    squares[squares <= n * (64 * np.finfo(float).eps * np.abs(known).max(axis=0)) ** 2] = 0.0
    return deviation, squares, n
