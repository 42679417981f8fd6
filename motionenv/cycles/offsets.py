"""Offsets that align sequences of known period (Ormoneit et al. 2005, section 3.3, fig. 6).

The exhaustive search over all offsets of a sequence is a circular correlation. With S and n the sums and counts of the
sequence folded at its period, and R the reference on the same grid, the error at offset o is

    Σ z² + Σ_k [n(k) R(k - o)² - 2 S(k) R(k - o)],

so one Fourier transform gives it exactly for every o. The least-squares fit of the reference also needs only the folds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft

from motionenv._core.representation import OneLine
from motionenv.cycles.snr import checked_series, folded
from motionenv.cycles.splines import outer_products, periodic_basis, solve
from motionenv.errors import MotionError

#: Fractional periods are rounded to 1 / SUBFRAMES of a frame, well below their uncertainty.
SUBFRAMES = 4
#: Stopping threshold of fig. 6, step 4, interpreted as relative improvement of the squared error.
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Alignment(OneLine):
    """Aligned sequences: frame t of sequence i has phase ((t - offsets[i]) mod periods[i]) / periods[i].

    Attributes:
        periods: (n,) cycle lengths [frames].
        offsets: (n,) [frames], in [0, period).
        reference: (10, m) coefficients of the reference on `periodic_basis`.
        errors: squared error after every update of the reference; never increases.
    """

    periods: np.ndarray
    offsets: np.ndarray
    reference: np.ndarray
    errors: np.ndarray

    def phase(self, i: int, frames: ArrayLike) -> np.ndarray:
        """Phase ζ_i in [0, 1) of `frames` of sequence `i`."""
        return np.mod(np.asarray(frames) - self.offsets[i], self.periods[i]) / self.periods[i]


def align(sequences: Sequence[np.ndarray], periods: ArrayLike, *, weights: ArrayLike | None = None) -> Alignment:
    """Offsets and reference that minimise the squared deviation of all sequences from the reference (fig. 6).

    All offsets are updated, as in fig. 6. A shift common to all doesn't change the error, so phase 0 is arbitrary;
    fixing the first offset at 0 would define it, but on real walks leaves the first sequence half a cycle off. Periods
    may be fractional and are rounded to a quarter of a frame; offsets are whole frames, as in the paper. The threshold
    of step 4 is relative. The algorithm finds a local optimum.

    Args:
        sequences: n arrays (frames, m), NaN where missing; the same channels in each.
        periods: (n,) cycle lengths [frames].
        weights: (m,) weight of each channel's squared deviation; all 1 by default, as in the paper.

    Raises:
        MotionError: no sequences, channels that differ, or periods or weights that are not positive numbers.
        GapError: a sequence without observations.
    """
    folds = _folds(sequences, periods, weights)
    offsets = np.zeros(len(folds.steps), dtype=np.int64)
    errors = []
    while True:
        reference, error = folds.reference(offsets)
        errors.append(error)
        if len(errors) > 1 and errors[-2] - error <= TOLERANCE * errors[-2]:
            break
        offsets = folds.best_offsets(reference)
    return Alignment(folds.steps / folds.parts, offsets.astype(np.float64), reference / folds.scale, np.array(errors))


@dataclass(frozen=True, eq=False)
class _Group:
    """Sequences that share a period of P steps of 1/parts frame, folded onto a grid of P points."""

    members: np.ndarray  # (k,) their indices
    data: np.ndarray  # (k, 2m, P), counts and then sums of each channel
    spectrum: np.ndarray  # (k, 2m, P // 2 + 1), the Fourier transform of `data`
    basis: np.ndarray  # (P, 10), the periodic splines on the grid
    products: np.ndarray  # (P, 100), their outer products
    energy: float  # Σ z² of the members, weighted

    def aligned(self, shifts: np.ndarray) -> np.ndarray:
        """Counts and sums (2m, P) over the members, each shifted back."""
        return sum((np.roll(fold, -s, axis=1) for fold, s in zip(self.data, shifts, strict=True)), np.zeros(()))

    def errors(self, reference: np.ndarray) -> np.ndarray:
        """Squared error (k, P) of every member at every shift, minus its Σ z²."""
        curve = (self.basis @ reference).T
        spectrum = fft.rfft(np.concatenate([curve**2, -2 * curve]), axis=1).conj()
        return fft.irfft((self.spectrum * spectrum).sum(axis=1), n=curve.shape[1], axis=1)


@dataclass(frozen=True, eq=False)
class _Folds:
    """All sequences, folded. `steps`: periods in 1/parts frames; `scale`: square root of the weights."""

    groups: list[_Group]
    steps: np.ndarray
    parts: int
    scale: np.ndarray

    def reference(self, offsets: np.ndarray) -> tuple[np.ndarray, float]:
        """Step 2: the least-squares reference (10, m) at these offsets, and its squared error."""
        m = len(self.scale)
        gram, right = np.zeros((m, 100)), np.zeros((m, 10))
        for g in self.groups:
            total = g.aligned(offsets[g.members] * self.parts)
            gram += total[:m] @ g.products
            right += total[m:] @ g.basis
        coefficients = solve(gram.reshape(m, 10, 10), right)
        return coefficients, float(sum(g.energy for g in self.groups) - np.einsum("ka,ak->", coefficients, right))

    def best_offsets(self, reference: np.ndarray) -> np.ndarray:
        """Step 3: for each sequence the offset of least error, the smallest in case of ties."""
        offsets = np.zeros(len(self.steps), dtype=np.int64)
        for g in self.groups:
            offsets[g.members] = g.errors(reference)[:, :: self.parts].argmin(axis=1)
        return offsets


def _folds(sequences, periods, weights) -> _Folds:
    """Validate the arguments of `align` and fold every sequence at its period."""
    checked = [checked_series(z) for z in sequences]
    if not checked:
        raise MotionError("sequences must hold at least one sequence")
    m = checked[0][0].shape[1]
    if any(z.shape[1] != m for z, _ in checked):
        raise MotionError(f"all sequences must have the same channels, got {sorted({z.shape[1] for z, _ in checked})}")
    periods = positive(periods, len(checked), "periods")
    scale = np.sqrt(positive(np.ones(m) if weights is None else weights, m, "weights"))
    parts = 1 if (periods == np.round(periods)).all() else SUBFRAMES
    steps = np.maximum(np.round(periods * parts), 1).astype(np.int64)
    sequences = [z for z, _ in checked]
    groups = [_group(np.flatnonzero(steps == p), int(p), parts, sequences, scale) for p in np.unique(steps)]
    return _Folds(groups, steps, parts, scale)


def _group(members: np.ndarray, p: int, parts: int, sequences: list, scale: np.ndarray) -> _Group:
    """Fold the sequences of one period."""
    data, energy = np.zeros((len(members), 2 * len(scale), p)), 0.0
    places = np.arange(p // math.gcd(p, parts)) * parts % p  # of successive frames, until they come again
    for fold, i in zip(data, members, strict=True):
        seen = np.isfinite(sequences[i])
        scaled = np.where(seen, sequences[i], 0.0) * scale
        fold[:, places] = folded(np.hstack([seen, scaled]), len(places)).T
        energy += float((scaled**2).sum())
    basis = periodic_basis(np.arange(p) / p)
    return _Group(members, data, fft.rfft(data, axis=2), basis, outer_products(basis), energy)


def positive(values: ArrayLike, n: int, name: str) -> np.ndarray:
    """`values` as (n,) positive finite numbers, else a MotionError about `name`; one number stands for all."""
    try:
        array = np.broadcast_to(np.asarray(values, dtype=np.float64), (n,))
    except (TypeError, ValueError):
        raise MotionError(f"{name} must be {n} positive numbers, got {values!r}") from None
    if not ((array > 0) & np.isfinite(array)).all():
        raise MotionError(f"{name} must be {n} positive numbers, got {values!r}")
    return array
