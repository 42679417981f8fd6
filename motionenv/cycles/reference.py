"""Resample aligned sequences to cycles in the common reference domain (Ormoneit et al. 2005, section 3.4)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_whole
from motionenv.cycles.offsets import Alignment, align, positive
from motionenv.cycles.period import estimate_period
from motionenv.cycles.snr import checked_series
from motionenv.cycles.splines import SPACING, spline_basis
from motionenv.errors import MotionError
from motionenv.types import ANGLES, POSE, Cycles

#: Greatest variance of a fitted value, relative to one sample's, at which the data determine the spline.
LEVERAGE = 4.0


def to_reference(
    sequences: Sequence[np.ndarray], alignment: Alignment, fps: ArrayLike, *, samples: int = 128,
    channels: Sequence[str] | None = None, subjects: Sequence | None = None,
) -> Cycles:  # fmt: skip
    """Cut aligned sequences into cycles and resample each at phases 0, 1/samples, ..., by spline regression.

    Sequence i gives K_i = ⌈(T_i - o_i) / p_i⌉ + 1 cycles for o_i ≠ 0, including the partly filled ends. Each cycle and
    channel gets the unconstrained regression spline of appendix A, fitted to its own observed samples. The paper's grid
    0..𝒯 includes phase 1, which is the next cycle's phase 0 and is dropped. A grid point is NaN if the data don't
    support the spline: outside the observed span by more than a frame, inside a gap longer than the knot spacing, or if
    the fitted value's standard deviation is more than twice that of one sample. Cycles without any supported point are
    dropped.

    Args:
        sequences: n arrays (frames, m), NaN where missing. They may have other channels than those aligned.
        alignment: periods and offsets, from `align`.
        fps: frame rate, one or (n,) [Hz].
        samples: grid points per cycle.
        channels: m names; by default those of the pose vector for m = 25, of its angles for m = 19, else numbers.
        subjects: n labels of people; by default a number per sequence.

    Raises:
        MotionError: sequences, alignment, fps, channels and subjects don't match.
    """
    checked = [checked_series(z) for z in sequences]
    n = len(alignment.periods)
    if len(checked) != n or len({z.shape[1] for z, _ in checked}) != 1:
        raise MotionError(f"sequences must match the alignment of {n} sequences, got {len(checked)}")
    samples = checked_whole(samples, "samples", 2)
    channels = _channel_names(channels, checked[0][0].shape[1])
    subjects = [str(i) for i in range(n)] if subjects is None else [str(s) for s in subjects]
    if len(subjects) != n:
        raise MotionError(f"subjects must hold a label for each of the {n} sequences, got {len(subjects)}")
    seconds = alignment.periods / positive(fps, n, "fps")
    grid = np.arange(samples) / samples
    values, sequence = [], []
    for i, (z, _) in enumerate(checked):
        for cycle in _cycles(z, alignment.offsets[i], alignment.periods[i], grid):
            values.append(cycle)
            sequence.append(i)
    if not values:
        raise MotionError("no cycle has enough samples for a spline: the frame rate is too low")
    whose = tuple(subjects[i] for i in sequence)
    return Cycles(np.array(values), channels, seconds[sequence], np.array(sequence), whose)


def segment(
    sequences: Sequence[np.ndarray], fps: float | Sequence[float], *, steer: slice | Sequence[int] | None = None,
    weights: ArrayLike | None = None, samples: int = 128, channels: Sequence[str] | None = None,
    subjects: Sequence[str] | None = None,
) -> Cycles:  # fmt: skip
    """Segment sequences into cycles: `estimate_period` of each, `align`, `to_reference` (paper A, section 3).

    Args:
        sequences, fps, samples, channels, subjects: as in `to_reference`.
        steer: channels that determine periods and offsets, as an index into the m channels (a slice, a list of numbers,
            or a mask); all by default. Exclude channels that drift, such as root position.
        weights: weight per steering channel in `align`.

    Raises:
        MotionError: as in the three steps; names the sequence that has no period.
    """
    sequences = [checked_series(z)[0] for z in sequences]
    rates = positive(fps, len(sequences), "fps")
    steering = [z if steer is None else z[:, steer] for z in sequences]
    periods = []
    for i, (z, rate) in enumerate(zip(steering, rates, strict=True)):
        try:
            periods.append(estimate_period(z, rate).frames)
        except MotionError as error:
            raise type(error)(f"sequence {i}: {error}") from error
    alignment = align(steering, periods, weights=weights)
    return to_reference(sequences, alignment, rates, samples=samples, channels=channels, subjects=subjects)


def _cycles(z: np.ndarray, offset: float, period: float, grid: np.ndarray):
    """Yield (samples, m) for each cycle of one sequence with at least one supported point."""
    place = (np.arange(len(z)) - offset) / period
    number = np.floor(place).astype(np.int64)
    for k in np.unique(number):
        inside = number == k
        cycle = _resample(place[inside] - k, z[inside], 1 / period, grid)
        if not np.isnan(cycle).all():
            yield cycle


def _resample(phase: np.ndarray, z: np.ndarray, frame: float, grid: np.ndarray) -> np.ndarray:
    """Spline values (samples, m) of one cycle on the grid; channels with the same gaps share one factorisation."""
    out = np.full((len(grid), z.shape[1]), np.nan)
    masks, which = np.unique(~np.isnan(z), axis=1, return_inverse=True)
    for j, seen in enumerate(masks.T):
        keep, hat = _hat(phase[seen], frame, grid)
        same = np.flatnonzero(which.reshape(-1) == j)
        out[np.ix_(keep, same)] = hat @ z[np.ix_(seen, same)]
    return out


def _hat(phase: np.ndarray, frame: float, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mask of the grid points that samples at these phases support, and the matrix from samples to fitted values."""
    padded = np.concatenate([[-np.inf], phase, [np.inf]])
    after = np.searchsorted(phase, grid, side="right") + 1
    before, after = grid - padded[after - 1], padded[after] - grid
    keep = (np.minimum(before, after) <= frame) | (before + after <= SPACING)
    basis = spline_basis(grid[keep])
    u, s, vt = np.linalg.svd(spline_basis(phase), full_matrices=False)
    rank = int((s > 1e-9 * s.max(initial=0)).sum())
    rotated = basis @ vt[:rank].T
    determined = np.linalg.norm(basis - rotated @ vt[:rank], axis=1) < 1e-6
    hat = (rotated / s[:rank]) @ u[:, :rank].T
    good = determined & ((hat**2).sum(axis=1) <= LEVERAGE)
    keep[keep] = good
    return keep, hat[good]


def _channel_names(channels, m: int) -> tuple[str, ...]:
    """The given names, or those of the pose vector if m matches, or numbers."""
    if channels is None:
        return {25: POSE, 19: ANGLES}.get(m, tuple(str(a) for a in range(m)))
    names = tuple(str(c) for c in channels)
    if len(names) != m:
        raise MotionError(f"channels must name {m} channels, got {len(names)}")
    return names
