"""The inner loop of the period search: fold a series at many periods and sum squares over the bins."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def sums_of_squares(z, seen, candidates, parents, of_means):
    """Σ_k S_k²/n_k (or Σ_k (S_k/n_k)² if `of_means`) and the number of non-empty bins, of `z` folded at each p.

    Args:
        z: (frames, m), centred, 0 where missing.
        seen: (frames, m), 1 or 0 in an integer type that can hold the largest count of a bin.
        candidates: (n,) sorted, ascending.
        parents: (n,) index of a candidate that is a multiple, or -1: folding the fold at k·p gives the fold at p, so
            that the series itself is read for about half of the candidates only.
        of_means: whether to sum squared means, every bin alike.

    Returns:
        Two arrays (n, m).
    """
    m = z.shape[1]
    start = np.zeros(len(candidates) + 1, np.int64)
    for i in range(len(candidates)):
        start[i + 1] = start[i] + candidates[i] * m
    sums = np.empty(start[-1], z.dtype)
    counts = np.empty(start[-1], seen.dtype)
    work = np.empty(candidates[-1] * m)
    squares = np.zeros((len(candidates), m))
    bins = np.empty((len(candidates), m), np.int64)
    for i in range(len(candidates) - 1, -1, -1):
        a, b, up = start[i], start[i + 1], parents[i]
        if up < 0:
            _fold(z.reshape(-1), sums[a:b])
            _fold(seen.reshape(-1), counts[a:b])
        else:
            _fold(sums[start[up] : start[up + 1]], sums[a:b])
            _fold(counts[start[up] : start[up + 1]], counts[a:b])
        _squares(sums[a:b], counts[a:b], work, of_means, squares[i])
        _nonempty(counts[a:b], bins[i])
    return squares, bins


@njit(nogil=True, cache=True, error_model="numpy")
def _fold(flat, out):
    """Sum of the consecutive stretches of `flat` as long as `out`; contiguous, four at a time, so that SIMD applies."""
    width, n = len(out), len(flat)
    out[:] = 0
    start = 0
    while start + 4 * width <= n:
        a = flat[start : start + width]
        b = flat[start + width : start + 2 * width]
        c = flat[start + 2 * width : start + 3 * width]
        d = flat[start + 3 * width : start + 4 * width]
        for j in range(width):
            out[j] += (a[j] + b[j]) + (c[j] + d[j])
        start += 4 * width
    while start < n:
        a = flat[start : start + width]
        for j in range(len(a)):
            out[j] += a[j]
        start += width


@njit(nogil=True, cache=True, error_model="numpy")
def _squares(sums, counts, work, of_means, out):
    """Adds each bin's S²/n, or (S/n)², to its channel's; empty bins add nothing since their S is 0."""
    for j in range(len(sums)):
        n = max(np.float64(counts[j]), 1.0)
        work[j] = sums[j] * sums[j] / n
        if of_means:
            work[j] /= n
    for row in range(0, len(sums), len(out)):
        for a in range(len(out)):
            out[a] += work[row + a]


@njit(nogil=True, cache=True, error_model="numpy")
def _nonempty(counts, out):
    """Number of non-empty bins per channel; most often all are, which one pass without columns tells."""
    least = counts[0]
    for j in range(len(counts)):
        least = min(least, counts[j])
    out[:] = len(counts) // len(out)
    if least == 0:
        for row in range(0, len(counts), len(out)):
            for a in range(len(out)):
                out[a] -= counts[row + a] == 0
