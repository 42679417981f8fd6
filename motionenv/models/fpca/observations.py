"""Cycles with gaps as input of the functional models: Fourier coefficients of seen samples, runs of missing ones.

Two things make the models fast. As the basis is orthonormal, the observed samples enter through their coefficients,
which are computed once. And gaps are runs: a sum over a gap is a difference of cumulative sums, so a pass costs time
by the number of gaps, not of samples (`motionenv.models.fpca._gap_kernels`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.threads import in_chunks

CHUNK = 250  # cycles that a thread takes, at least
_TOGETHER = 32  # cycles projected on the basis at a time; small enough for the cache


def group_centres(values: np.ndarray, groups: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Means of the observed samples per group (fig. 8, step 1), projected on the `basis`: (G, n, m).

    Of cycles `values` (K, P, m), NaN where missing, of `groups` (K,) numbered from 0. A sample that a group lacks takes
    the mean of all; one that all cycles lack is interpolated around the cycle.
    """
    seen = np.isfinite(values)
    totals, counts = np.zeros((2, int(groups.max(initial=0)) + 1, *values.shape[1:]))
    for g in range(len(totals)):
        totals[g] = np.sum(values, axis=0, where=seen & (groups == g)[:, None, None])
        counts[g] = seen[groups == g].sum(axis=0)
    count = counts.sum(axis=0)
    pooled = totals.sum(axis=0) / np.maximum(count, 1)
    j = np.arange(len(pooled))
    for a in np.flatnonzero((count == 0).any(axis=0)):
        some = count[:, a] > 0
        pooled[:, a] = np.interp(j, j[some], pooled[some, a], period=len(j))
    centre = basis.T @ pooled
    if len(counts) == 1:
        return centre[None]
    own = totals / np.maximum(counts, 1) - basis @ centre
    return centre + basis.T @ np.where(counts > 0, own, 0.0)


class Observations:
    """Cycles prepared for a fit: coefficients of their zero-filled deviations from the centre, gaps, and sums.

    Args:
        values: (K, P, m), NaN where missing.
        basis: (P, n) orthonormal.
        centre: (G, n, m) coefficients of the function subtracted from each group's cycles.
        groups: (K,) group of each cycle, 0 … G - 1.

    Attributes:
        values, basis, centre, groups: the arguments.
        n: number of cycles K.
        coefficients: (K, n·m).
        offsets, runs: runs[offsets[k] : offsets[k + 1]] are cycle k's gaps.
        square: (K, m) sums of squared deviations of the observed samples, of each cycle.
        squares: (m,) of all cycles.
        y_sum: (G, n·m) sums of coefficients.
        sizes: (G,) numbers of cycles.
        n_missing: (G, P·m) numbers of cycles that lack each sample.
        n_seen: number of observed samples.
    """

    def __init__(self, values: np.ndarray, basis: np.ndarray, centre: np.ndarray, groups: ArrayLike) -> None:
        self.values, self.basis, self.centre = np.ascontiguousarray(values), basis, centre
        self.groups = np.asarray(groups, dtype=np.int64)
        self.n, p, m = self.values.shape
        self.coefficients = np.empty((self.n, centre[0].size))
        self.square = np.zeros((self.n, m))
        n_runs, curves = np.zeros(self.n, dtype=np.int64), basis @ centre
        gaps = in_chunks(lambda start, stop: self._observe(start, stop, curves, n_runs), self.n, CHUNK)
        self.runs, self.offsets = np.concatenate(gaps), np.r_[0, np.cumsum(n_runs)]
        self.squares = self.square.sum(axis=0)
        self.sizes = np.bincount(self.groups, minlength=len(centre)).astype(float)
        self.y_sum, self.n_missing = self._group_sums()
        self.n_seen = self.n * p * m - self.n_missing.sum()

    def every(self, step: int) -> Observations:
        """A subset: one of every `step` cycles."""
        return Observations(self.values[::step], self.basis, self.centre, self.groups[::step])

    def _observe(self, start, stop, curves, n_runs):
        """Coefficients and squares of some cycles; returns their gaps."""
        from motionenv.models.fpca._gap_kernels import observe, project

        _, p, m = self.values.shape
        rows = np.ascontiguousarray(self.basis.T)
        runs, found = np.empty(((stop - start) * m * ((p + 1) // 2), 2), dtype=np.int32), 0
        for first in range(start, stop, _TOGETHER):
            last = min(first + _TOGETHER, stop)
            y = np.empty((p, last - first, m))
            found = observe(first, last, self.values, self.groups, curves, y, self.square, n_runs, runs, found)
            projected = np.empty((len(rows), (last - first) * m))
            project(rows, y.reshape(p, -1), projected)
            by_cycle = projected.reshape(-1, last - first, m).transpose(1, 0, 2)
            self.coefficients[first:last] = by_cycle.reshape(last - first, -1)
        return runs[:found].copy()

    def _group_sums(self) -> tuple[np.ndarray, np.ndarray]:
        """`y_sum` and `n_missing`."""
        from motionenv.models.fpca._gap_kernels import group_sums

        g, (_, p, m) = len(self.centre), self.values.shape
        y_sum = np.zeros((g, self.centre[0].size))
        group_sums(self.coefficients, self.groups, y_sum)
        group = np.repeat(self.groups, np.diff(self.offsets)) * (p + 1) * m
        begin, end = (np.bincount(group + self.runs[:, i], minlength=g * (p + 1) * m) for i in (0, 1))
        n_missing = np.cumsum((begin - end).reshape(g, p + 1, m), axis=1)[:, :-1].reshape(g, -1).astype(float)
        return y_sum, n_missing

    def gap_sums(self, columns: np.ndarray) -> np.ndarray:
        """Sums (K, c) over each cycle's missing samples of `columns` (P, m, c)."""
        from motionenv.models.fpca._gap_kernels import gap_sums

        out = np.zeros((len(self.groups), columns.shape[-1]))
        gap_sums(self.offsets, self.runs, running(columns).reshape(-1, columns.shape[-1]), out)
        return out


def functions(coefficients: np.ndarray, basis: np.ndarray, m: int) -> np.ndarray:
    """Functions (P, m, c) of m channels from their `coefficients` (n·m, c) in the `basis` (P, n)."""
    n = basis.shape[1]
    return (basis @ coefficients.reshape(n, -1)).reshape(-1, m, coefficients.shape[1])


def running(rows: np.ndarray) -> np.ndarray:
    """Sums of the first 0 … P of `rows` (P, …); five times as fast as np.cumsum, which strides across memory."""
    total = np.zeros((len(rows) + 1, *rows.shape[1:]))
    for j, row in enumerate(rows):
        np.add(total[j], row, out=total[j + 1])
    return total


def missed(edges: np.ndarray, m: int) -> np.ndarray:
    """Sums (P·m, c) over the cycles that lack each sample, from `edges` ((P + 1)·m, c) of the gaps of m channels."""
    return running(edges.reshape(-1, m, edges.shape[1]))[1:-1].reshape(-1, edges.shape[1])


def in_parts(
    kernel: Callable, data: Observations, tables: Sequence[np.ndarray], found: Sequence[np.ndarray],
    shapes: Sequence[tuple[int, ...]], *more,
) -> list[np.ndarray]:  # fmt: skip
    """Run a kernel over the cycles of `data` in threads, each with its own tallies; return the sums of these.

    The kernel, from `_gap_kernels`, takes (start, stop, data, tables, found, tallies, …): `tables` are read-only input,
    `found` is output by cycle, `shapes` are those of the tallies, and `more` further arguments.
    """
    given = (data.coefficients, data.groups, data.offsets, data.runs)

    def part(start, stop):
        tallies = tuple(np.zeros(shape) for shape in shapes)
        kernel(start, stop, given, tables, found, tallies, *more)
        return tallies

    return [sum(parts) for parts in zip(*in_chunks(part, data.n, CHUNK), strict=True)]


def triangle(symmetric: np.ndarray) -> np.ndarray:
    """Lower triangles (…, q(q + 1)/2) of `symmetric` matrices (…, q, q), row by row."""
    rows, columns = np.tril_indices(symmetric.shape[-1])
    return symmetric[..., rows, columns]


def from_triangle(lower: np.ndarray, q: int) -> np.ndarray:
    """Symmetric matrices (…, q, q) of lower triangles `lower` (…, q(q + 1)/2)."""
    rows, columns = np.tril_indices(q)
    full = np.empty((*lower.shape[:-1], q, q))
    full[..., rows, columns] = full[..., columns, rows] = lower
    return full
