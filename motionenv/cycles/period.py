"""Cycle length of one sequence (Ormoneit et al. 2005, section 3.2): the peak of the SNR, and its local refinement.

Three rules go beyond the paper; `benchmarks` measures them on real walks. They use the mean squared change D(τ) of the
standardised channels over τ frames. The recurrence of τ is D(τ) relative to the largest change over any shorter time:
near 0 if the motion repeats, near 1 if not.

**Double cycles.** A motion of period p has period 2p, 3p, ... as well; where strides alternate, or p is fractional,
a multiple may have a higher peak. The peak is divided by the largest k for which the motion recurs after p/k, and
D(p/k) exceeds D(p) by at most a fifth (`SHORTER`) of the largest change. A single step isn't mistaken for a cycle: left
and right are swapped then, and the change is largest. That needs channels that distinguish left from right, such as
joint angles.

**No peak.** There is no period if white noise would give such a peak with probability above 1 % (`SIGNIFICANCE`), if
the peak is at an end of the range, or if the recurrence exceeds 0.6 (`RECURRENCE`). Coloured noise fails the last
criterion (a single drifting channel passes in about 6 of 100 cases, three or more hardly ever).

**Fraction.** Folding at one period overestimates it if a person starts and stops, by 3 % on short trials. The reported
length is therefore the median, over time, of the local cycle length: the lag at which the motion matches itself best
over windows of 5/4 cycle, each window weighted by its precision (pairs · curvature / mismatch).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_fps
from motionenv.cycles.snr import SNR, centre, checked_series, snr
from motionenv.cycles.spikes import NORMAL, spikes
from motionenv.errors import GapError, MotionError

SHORTER = 0.2
SIGNIFICANCE = 0.01
RECURRENCE = 0.6
FAR = 8.0  # robust deviations of a channel, from which on a spike is replaced
#: Local cycle lengths are searched within this relative distance of the peak.
SPREAD = 0.14
#: Window length of the local cycle length [cycles].
WINDOW = 1.25


@dataclass(frozen=True, eq=False, repr=False)
class Period(OneLine):
    """The cycle length of a sequence and the evidence for it.

    Attributes:
        frames: cycle length [frames], fractional.
        seconds: cycle length [s].
        peak: accumulated signal-to-noise ratio (eq. 3) at the nearest whole period that was chosen.
        significance: bound on the probability that white noise of this size gives such a peak anywhere in the range.
        recurrence: mean squared change over one cycle, relative to the largest over any shorter time.
        curve: signal-to-noise ratio of every candidate (fig. 5).
    """

    frames: float
    seconds: float
    peak: float
    significance: float
    recurrence: float
    curve: SNR


def estimate_period(z: ArrayLike, fps: float, *, range_seconds: tuple[float, float] = (0.5, 2.5)) -> Period:
    """Cycle length of a sequence by its signal-to-noise ratio (eq. 1-3), with the rules in the module's docstring.

    Candidates are the whole numbers of frames in the range of which two cycles fit into the observed span. Channels
    that are never observed or constant are ignored. Channels must not drift: pass joint angles, or markers relative to
    the pelvis, but no root position. Samples that stand out from those around them are replaced.

    Args:
        z: (frames, m), NaN where missing.
        fps: frame rate [Hz].
        range_seconds: (low, high) cycle durations to search [s].

    Raises:
        MotionError: invalid `z`, `fps` or range, or the motion has no period.
        GapError: no observations, or fewer than two cycles of the shortest candidate.
    """
    z, seen = checked_series(z)
    z = _without_spikes(z, seen)
    fps = checked_fps(fps)
    candidates = _candidates(seen, fps, range_seconds)
    curve = snr(z, candidates)
    i = int(curve.total.argmax())
    significance = _significance(curve.channels[i], candidates[i], seen.sum(axis=0)) * len(candidates)
    if not significance <= SIGNIFICANCE:
        raise MotionError(f"no period: white noise has such a peak with a probability of {min(significance, 1):.2g}")
    standard = _standardised(z, seen)
    i, recurrence = _shortest(_mean_change(standard, candidates[i]), candidates, i)
    if i in (0, len(candidates) - 1):
        raise MotionError(
            f"no period between {candidates[0] / fps:.2f} and {candidates[-1] / fps:.2f} s: the signal-to-noise ratio "
            f"is highest at {candidates[i] / fps:.2f} s, the end of the range"
        )
    if not recurrence <= RECURRENCE:
        raise MotionError(
            f"no period: after {candidates[i] / fps:.2f} s, the peak, the motion has a recurrence of {recurrence:.2f}; "
            f"at most {RECURRENCE} is allowed"
        )
    frames = _local_length(standard, int(candidates[i]))
    return Period(frames, frames / fps, float(curve.total[i]), significance, recurrence, curve)


def _without_spikes(z: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The series (frames, m) with spikes, any of which could outweigh the whole motion, replaced by interpolation."""
    z, frames = z.copy(), np.arange(len(z))
    for x, known in zip(z.T, seen.T, strict=True):
        if len(x) > 4 and known.any():
            bad = spikes(x[None], FAR * NORMAL * float(np.median(np.abs(x[known] - np.median(x[known])))))[0] > 0
            x[bad] = np.interp(frames[bad], frames[known & ~bad], x[known & ~bad])
    return z


def _candidates(seen: np.ndarray, fps: float, range_seconds) -> np.ndarray:
    """Whole numbers of frames in the range of which two cycles fit into the observed span."""
    try:
        low, high = (float(s) for s in range_seconds)
    except (TypeError, ValueError):
        low = high = np.nan
    if not 0 < low < high < np.inf:
        raise MotionError(f"range_seconds must be (low, high) in s with 0 < low < high, got {range_seconds!r}")
    frames = np.flatnonzero(seen.any(axis=1))
    span = int(frames[-1] - frames[0]) + 1
    first, last = max(int(np.ceil(low * fps)), 3), min(int(high * fps), span // 2)
    if last - first < 2:
        raise GapError(
            f"fewer than two cycles: {span / fps:.2f} s are observed at {fps:g} frames per second, and the shortest "
            f"cycle in range_seconds lasts {low:g} s"
        )
    return np.arange(first, last + 1)


def _significance(ratios: np.ndarray, p: int, n: np.ndarray) -> float:
    """Probability of such ratios in white noise: F tests per channel, combined by Fisher's method."""
    ok = np.isfinite(ratios)
    if not ok.any():
        return 1.0
    with np.errstate(divide="ignore"):  # the probability may underflow
        logs = np.log(special.fdtrc(p - 1, n[ok] - p, ratios[ok]))  # scipy.stats is slow to import
    return float(special.chdtrc(2 * ok.sum(), -2 * logs.sum()))


def _standardised(z: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The channels that aren't constant, each with mean 0 and variance 1; NaN where missing."""
    deviation, squares, n = centre(z)
    moving = squares > 0
    return np.where(seen, deviation, np.nan)[:, moving] / np.sqrt(squares[moving] / n[moving])


def _mean_change(z: np.ndarray, p: int) -> np.ndarray:
    """D(τ), the mean squared change over τ = 0, 1, ... to about p frames; NaN if no pair was observed."""
    change, pairs = (x.sum(axis=1) for x in _squared_changes(z, np.arange(1, min(p + _reach(p), len(z) - 1) + 1)))
    with np.errstate(invalid="ignore"):
        return np.concatenate([[0.0], change / pairs])


def _squared_changes(z: np.ndarray, lags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sum over the channels of (z(t + lag) - z(t))², and the number of channels observed at both, each (lags, frames).

    Each pair is stored at its middle frame, relative to the middle of the pair of shortest lag that starts at frame 0.
    z: (frames, m), NaN where missing.
    """
    change, pairs = np.zeros((2, len(lags), len(z) - lags[0]))
    for i, lag in enumerate(lags):
        step = z[lag:] - z[:-lag]
        known = np.isfinite(step)
        middle = slice((lag - lags[0]) // 2, (lag - lags[0]) // 2 + len(step))
        change[i, middle], pairs[i, middle] = (np.where(known, step, 0.0) ** 2).sum(axis=1), known.sum(axis=1)
    return change, pairs


def _shortest(change: np.ndarray, candidates: np.ndarray, i: int) -> tuple[int, float]:
    """Index of the shortest p/k at which the motion recurs as well as at the peak, and its recurrence."""
    p = int(candidates[i])
    allowed = _least(change, p)[1] + SHORTER * np.nanmax(change)
    for k in range(p // int(candidates[0]), 1, -1):
        q, least = _least(change, round(p / k))
        if q >= candidates[0] and least <= min(allowed, RECURRENCE * np.nanmax(change[:q])):
            return q - int(candidates[0]), float(least / np.nanmax(change[:q]))
    return i, float(_least(change, p)[1] / np.nanmax(change[:p]))


def _least(change: np.ndarray, p: int) -> tuple[int, float]:
    """Position and value of the minimum of D near p frames (± 3 %)."""
    near = change[p - _reach(p) : p + _reach(p) + 1]
    if np.isnan(near).all():
        return p, np.inf
    return p - _reach(p) + int(np.nanargmin(near)), float(np.nanmin(near))


def _reach(p: int) -> int:
    """3 % of a period, at least one frame."""
    return int(np.ceil(0.03 * p))


def _local_length(z: np.ndarray, p: int) -> float:
    """Weighted median over time of the lag at which windows of 5/4 cycle match themselves best [frames]."""
    lags = np.arange(int(p * (1 - SPREAD)), min(int(np.ceil(p * (1 + SPREAD))), len(z) - 1) + 1)
    change, pairs = (_window_sums(x, int(WINDOW * p)) for x in _squared_changes(z, lags))
    change, pairs = change / np.maximum(pairs, 1), pairs.min(axis=0)
    # ignore windows with fewer than a quarter of the pairs of the fullest
    told = pairs >= pairs.max() / 4
    change, pairs = change[:, told], pairs[told]
    best = change.argmin(axis=0)
    inner = (best > 0) & (best < len(lags) - 1)
    if not inner.any():
        raise MotionError(f"no period: the motion does not match itself anywhere near {p} frames later")
    at, column = best[inner], np.flatnonzero(inner)
    left, here, right = (change[at + step, column] for step in (-1, 0, 1))
    bend = left - 2 * here + right
    length = lags[at] + 0.5 * (left - right) / bend
    return _weighted_median(length, pairs[inner] * bend / (here + 0.01))


def _window_sums(x: np.ndarray, width: int) -> np.ndarray:
    """Sums over `width` successive frames of x (n, frames), including partly filled windows at the ends."""
    total = np.cumsum(np.pad(x, ((0, 0), (width, width - 1))), axis=1)
    return total[:, width:] - total[:, :-width]


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """The value below and above which half of the weight lies."""
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, below[-1] / 2)])
