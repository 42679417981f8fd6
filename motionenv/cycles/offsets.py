"""Offsets that align sequences of known period (Ormoneit et al. 2005, section 3.3, fig. 6).

The exhaustive search over all offsets of a sequence is a circular correlation. With S and n the sums and counts of the
sequence folded at its period, and R the reference on the same grid, the error at offset o is

    Σ z² + Σ_k [n(k) R(k - o)² - 2 S(k) R(k - o)],

so that one Fourier transform gives it for every o, exactly. The least-squares fit of the reference needs the folds
only, too.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.cycles.snr import checked_series
from motionenv.cycles.splines import normal_equations, periodic_basis, solve
from motionenv.errors import MotionError

#: Fractional periods are rounded to, and their offsets sought on, this part of a frame.
SUBFRAMES = 8
#: Fig. 6, step 4, read as a relative improvement of the squared error.
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Alignment:
    """Sequences in step: frame t of sequence i lies at phase ((t - offsets[i]) mod periods[i]) / periods[i].

    Attributes:
        periods: (n,) cycle lengths [frames].
        offsets: (n,) [frames], in [0, period).
        reference: (10, m) coefficients of the reference on `periodic_basis`.
        errors: squared error after every update of the reference, in the order of the iterations; never rises.
    """

    periods: np.ndarray
    offsets: np.ndarray
    reference: np.ndarray
    errors: np.ndarray

    def phase(self, i: int, frames) -> np.ndarray:
        """Phase ζ_i in [0, 1) of the given frames of sequence `i`."""
        return np.mod(np.asarray(frames) - self.offsets[i], self.periods[i]) / self.periods[i]


def align(sequences, periods, *, weights=None) -> Alignment:
    """Offsets and reference that minimise the squared deviation of all sequences from the reference (fig. 6).

    A shift common to all leaves the error alone, so the first sequence keeps offset 0. Whole periods have whole
    offsets, as in the paper; where a period is fractional, all are sought in steps of 1/8 frame. The algorithm finds
    a local optimum.

    Args:
        sequences: n arrays (frames, m), NaN where missing; the same channels in each.
        periods: (n,) cycle lengths [frames].
        weights: (m,) weight of each channel's squared deviation; all 1 by default, as in the paper.

    Raises:
        MotionError: no sequences, channels that differ, or periods or weights that are not positive numbers.
        GapError: a sequence in which nothing is observed.
    """
    folds = _folds(sequences, periods, weights)
    shifts = np.zeros(len(folds.steps), dtype=np.int64)
    errors = []
    while True:
        reference, error = folds.reference(shifts)
        errors.append(error)
        if len(errors) > 1 and errors[-2] - error <= TOLERANCE * errors[-2]:
            break
        shifts = folds.best_shifts(reference)
    return Alignment(folds.steps / folds.parts, shifts / folds.parts, reference / folds.scale, np.array(errors))


@dataclass(frozen=True, eq=False)
class _Group:
    """Sequences that share a period of P steps: folds (k, P, m), their spectra and the basis (P, 10) on the grid."""

    members: np.ndarray
    sums: np.ndarray
    counts: np.ndarray
    basis: np.ndarray
    sums_spectrum: np.ndarray
    counts_spectrum: np.ndarray


@dataclass(frozen=True, eq=False)
class _Folds:
    """All sequences, folded; `steps` is each period in parts of a frame, `energy` the weighted Σ z²."""

    groups: list[_Group]
    steps: np.ndarray
    parts: int
    scale: np.ndarray
    energy: float

    def reference(self, shifts):
        """Step 2: the least-squares reference (10, m) at these shifts, and the squared error that it leaves."""
        gram = right = np.zeros(())
        for g in self.groups:
            sums, counts = np.zeros(g.sums.shape[1:]), np.zeros(g.sums.shape[1:])
            for j, i in enumerate(g.members):
                sums += np.roll(g.sums[j], -shifts[i], axis=0)
                counts += np.roll(g.counts[j], -shifts[i], axis=0)
            more = normal_equations(g.basis, sums, counts)
            gram, right = gram + more[0], right + more[1]
        coefficients = solve(gram, right)
        return coefficients, float(self.energy - np.einsum("ka,ak->", coefficients, right))

    def best_shifts(self, reference):
        """Step 3: for each sequence but the first the shift of least error, the smallest of equals."""
        shifts = np.zeros(len(self.steps), dtype=np.int64)
        for g in self.groups:
            curve = g.basis @ reference
            plain, squared = np.fft.rfft(curve, axis=0), np.fft.rfft(curve**2, axis=0)
            cost = np.einsum("kfa,fa->kf", g.counts_spectrum, squared.conj())
            cost -= 2 * np.einsum("kfa,fa->kf", g.sums_spectrum, plain.conj())
            shifts[g.members] = np.fft.irfft(cost, n=len(curve), axis=1).argmin(axis=1)
        shifts[0] = 0
        return shifts


def _folds(sequences, periods, weights) -> _Folds:
    """Checks the arguments of `align` and folds every sequence at its period."""
    checked = [checked_series(z) for z in sequences]
    if not checked:
        raise MotionError("nothing to align: give at least one sequence")
    m = checked[0][0].shape[1]
    if any(z.shape[1] != m for z, _ in checked):
        raise MotionError(f"all sequences must have the same channels, got {sorted({z.shape[1] for z, _ in checked})}")
    periods = positive(periods, len(checked), "periods")
    scale = np.sqrt(positive(np.ones(m) if weights is None else weights, m, "weights"))
    parts = 1 if (periods == np.round(periods)).all() else SUBFRAMES
    steps = np.maximum(np.round(periods * parts), 1).astype(np.int64)
    filled = [np.where(seen, z, 0.0) * scale for z, seen in checked]
    groups = []
    for p in np.unique(steps):
        members = np.flatnonzero(steps == p)
        sums, counts = np.zeros((2, len(members), p, m))
        for j, i in enumerate(members):
            k = np.arange(len(filled[i])) * parts % p
            np.add.at(sums[j], k, filled[i])
            np.add.at(counts[j], k, checked[i][1])
        spectra = np.fft.rfft(sums, axis=1), np.fft.rfft(counts, axis=1)
        groups.append(_Group(members, sums, counts, periodic_basis(np.arange(p) / p), *spectra))
    return _Folds(groups, steps, parts, scale, sum(float((z**2).sum()) for z in filled))


def positive(values, n: int, name: str) -> np.ndarray:
    """`values` as (n,) positive finite numbers; one number stands for all.

    Raises:
        MotionError: they are not.
    """
    try:
        array = np.broadcast_to(np.asarray(values, dtype=np.float64), (n,))
    except (TypeError, ValueError):
        raise MotionError(f"{name} must be {n} positive numbers, got {values!r}") from None
    if not ((array > 0) & np.isfinite(array)).all():
        raise MotionError(f"{name} must be {n} positive numbers, got {values!r}")
    return array
