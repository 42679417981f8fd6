"""The inner loop of the period search: fold a series at many periods and sum squares over the bins."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def sums_of_squares(z, seen, candidates, of_means):
    """Sums over the bins of `z` folded at every candidate period.

    Folding the fold at k·p gives the fold at p, so that the series itself is read for the candidates only that have
    no multiple among them.

    Args:
        z: (frames, m), centred, 0 where missing.
        seen: (frames, m), 1 or 0 in an integer type that can hold the largest count of a bin.
        candidates: (n,) sorted, ascending.
        of_means: whether to sum squared means as well.

    Returns:
        Σ_k S_k²/n_k, Σ_k (S_k/n_k)² (0 where not asked for), and the number of non-empty bins, each (n, m).
    """
    m = z.shape[1]
    start = np.zeros(len(candidates) + 1, np.int64)
    for i in range(len(candidates)):
        start[i + 1] = start[i] + candidates[i] * m
    multiples = _multiples(candidates)
    sums = np.empty(start[-1], z.dtype)
    counts = np.empty(start[-1], seen.dtype)
    work = np.empty(candidates[-1] * m)
    squares = np.zeros((len(candidates), m))
    means = np.zeros((len(candidates), m))
    bins = np.empty((len(candidates), m), np.int64)
    for i in range(len(candidates) - 1, -1, -1):
        a, b, up = start[i], start[i + 1], multiples[i]
        if up < 0:
            _fold(z.reshape(-1), sums[a:b])
            _fold(seen.reshape(-1), counts[a:b])
        else:
            _fold(sums[start[up] : start[up + 1]], sums[a:b])
            _fold(counts[start[up] : start[up + 1]], counts[a:b])
        _squares(sums[a:b], counts[a:b], work, 1, squares[i])
        if of_means:
            _squares(sums[a:b], counts[a:b], work, 2, means[i])
        _nonempty(counts[a:b], bins[i])
    return squares, means, bins


@njit(nogil=True, cache=True, error_model="numpy")
def _multiples(candidates):
    """For each candidate the index of its smallest proper multiple among them, or -1."""
    last = candidates[-1]
    index = np.full(last + 1, -1, np.int64)
    for i in range(len(candidates)):
        index[candidates[i]] = i
    out = np.full(len(candidates), -1, np.int64)
    for i in range(len(candidates)):
        p = 2 * candidates[i]
        while p <= last and out[i] < 0:
            out[i] = index[p]
            p += candidates[i]
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def centre(z):
    """Deviations from each channel's mean (0 where missing), their Σ of squares (m,), counts (m,), largest |z| (m,)."""
    frames, m = z.shape
    total, squares, peak, n = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m, np.int64)
    for t in range(frames):
        for a in range(m):
            x = z[t, a]
            ok = x == x
            n[a] += ok
            total[a] += x if ok else 0.0
            peak[a] = max(peak[a], abs(x) if ok else 0.0)
    for a in range(m):
        total[a] /= max(n[a], 1)
    deviation = np.empty((frames, m))
    for t in range(frames):
        for a in range(m):
            d = z[t, a] - total[a]
            d = d if d == d else 0.0
            deviation[t, a] = d
            squares[a] += d * d
    return deviation, squares, n, peak


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
def _squares(sums, counts, work, power, out):
    """Adds each bin's S²/n, or S²/n² for power 2, to its channel's; empty bins add nothing since their S is 0."""
    for j in range(len(sums)):
        n = max(np.float64(counts[j]), 1.0)
        work[j] = sums[j] * sums[j] / (n if power == 1 else n * n)
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


@njit(nogil=True, cache=True, error_model="numpy")
def squared_changes(z, lags):
    """Sum over the channels of (z(t + lag) - z(t))², and how many channels were seen at both, each (lags, frames).

    Each pair stands at the frame in its middle, counted from the middle of the pair that starts the shortest lag at
    frame 0. z: (frames, m), NaN where missing.
    """
    change = np.zeros((len(lags), len(z) - lags[0]))
    pairs = np.zeros(change.shape)
    for i in range(len(lags)):
        middle = (lags[i] - lags[0]) // 2
        for t in range(len(z) - lags[i]):
            for a in range(z.shape[1]):
                d = z[t + lags[i], a] - z[t, a]
                if d == d:
                    change[i, t + middle] += d * d
                    pairs[i, t + middle] += 1
    return change, pairs
