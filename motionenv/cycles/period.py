"""Cycle length of one sequence (Ormoneit et al. 2005, section 3.2)."""

from dataclasses import dataclass

import numpy as np

from motionenv.cycles.snr import SNR, centre, checked_series, snr
from motionenv.cycles.splines import normal_equations, periodic_basis, solve
from motionenv.errors import GapError, MotionError
from motionenv.types import checked_fps


@dataclass(frozen=True, eq=False)
class Period:
    """The cycle length of a sequence and the evidence for it.

    Attributes:
        frames: cycle length [frames], fractional.
        seconds: cycle length [s].
        peak: accumulated signal-to-noise ratio (eq. 3) at the nearest whole period.
        repeated: share of the variance, averaged over the channels, that one periodic curve explains (adjusted R²).
        curve: signal-to-noise ratio of every candidate.
    """

    frames: float
    seconds: float
    peak: float
    repeated: float
    curve: SNR


def estimate_period(z, fps, *, range_seconds=(0.5, 2.5)) -> Period:
    """Cycle length of `z` (frames, m)."""
    z, seen = checked_series(z)
    fps = checked_fps(fps)
    deviation, total, n = centre(z, seen)
    low = max(int(np.ceil(range_seconds[0] * fps)), 4)
    high = min(int(range_seconds[1] * fps), len(z) // 2)
    if high < low + 2:
        raise GapError("fewer than two cycles")
    curve = snr(z, np.arange(low, high + 1))
    best = int(curve.candidates[curve.total.argmax()])
    frames = _refine(deviation, seen, total, n, best)
    return Period(frames, frames / fps, float(curve.total.max()), 0.0, curve)


def _refine(deviation, seen, total, n, p):
    t = np.arange(len(deviation))
    grid = p + np.arange(-12, 13) / 8
    ratio = [_spline_ratio(t / g, deviation, seen, total, n) for g in grid]
    return float(grid[int(np.argmax(ratio))])


def _spline_ratio(phase, deviation, seen, total, n):
    gram, right = normal_equations(periodic_basis(phase), deviation, seen)
    explained = np.einsum("ka,ak->a", solve(gram, right), right)
    ok = total > 0
    return float((explained[ok] / 9 / (np.maximum(total - explained, 1e-13 * total) / (n - 10))[ok]).sum())
