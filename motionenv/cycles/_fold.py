"""Kernels of the period search: fold a series at many periods and sum squares over the bins."""

import numpy as np

from motionenv._core.compilation import kernel


@kernel
def sums_of_squares(z, seen, candidates, of_means):
    """Σ_k S_k²/n_k, Σ_k (S_k/n_k)² (0 unless `of_means`) and non-empty bins, (n, m), of `z` folded at each candidate.

    Folding the fold at 2p gives the fold at p, so the series itself is read only for candidates whose double isn't a
    candidate. All folds share one buffer, which stays in the cache. `z` (frames, m) is centred, 0 where missing; `seen`
    (frames, m) is 1 or 0, of an integer type that can hold the largest count of a bin; `candidates` (n,) ascend.
    """
    m, last = z.shape[1], candidates[-1]
    index = np.full(2 * last + 1, -1, np.int64)
    for i in range(len(candidates)):
        index[candidates[i]] = i
    sums, counts = np.empty(last * m, z.dtype), np.empty(last * m, seen.dtype)
    work = np.empty(last * m)
    squares, means = np.zeros((len(candidates), m)), np.zeros((len(candidates), m))
    bins = np.empty((len(candidates), m), np.int64)
    for p in candidates:
        if index[2 * p] >= 0:
            continue
        _fold(z.reshape(-1), sums[: p * m])
        _fold(seen.reshape(-1), counts[: p * m])
        i = index[p]
        while i >= 0:
            width = p * m
            _squares(sums[:width], counts[:width], work, 1, squares[i])
            if of_means:
                _squares(sums[:width], counts[:width], work, 2, means[i])
            _nonempty(counts[:width], bins[i])
            i = index[p // 2] if p % 2 == 0 else -1
            p //= 2
            if i >= 0:
                _halve(sums[:width])
                _halve(counts[:width])
    return squares, means, bins


@kernel
def _halve(fold):
    """Fold in place at half the period: the first half becomes the sum of both halves."""
    half = len(fold) // 2
    for j in range(half):
        fold[j] += fold[half + j]


@kernel
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


@kernel
def _fold(flat, out):
    """Sum of the consecutive segments of `flat` with the length of `out`; contiguous, eight at a time, for SIMD."""
    width, n = len(out), len(flat)
    out[:] = 0
    start = 0
    while start + 8 * width <= n:
        part = flat[start : start + 8 * width].reshape(8, width)
        for j in range(width):
            low = (part[0, j] + part[1, j]) + (part[2, j] + part[3, j])
            out[j] += low + ((part[4, j] + part[5, j]) + (part[6, j] + part[7, j]))
        start += 8 * width
    while start < n:
        rest = flat[start : start + width]
        for j in range(len(rest)):
            out[j] += rest[j]
        start += width


@kernel
def _squares(sums, counts, work, power, out):
    """Add each bin's S²/n, or S²/n² for power 2, to its channel's sum; empty bins add 0, because their S is 0."""
    for j in range(len(sums)):
        n = max(np.float64(counts[j]), 1.0)
        work[j] = sums[j] * sums[j] / (n if power == 1 else n * n)
    lanes = np.empty(8 * len(out))
    _fold(work[: len(sums)], lanes)
    for row in range(0, len(lanes), len(out)):
        for a in range(len(out)):
            out[a] += lanes[row + a]


@kernel
def _nonempty(counts, out):
    """Number of non-empty bins per channel; a fast path handles the common case that no bin is empty."""
    least = counts[0]
    for j in range(len(counts)):
        least = min(least, counts[j])
    out[:] = len(counts) // len(out)
    if least == 0:
        for row in range(0, len(counts), len(out)):
            for a in range(len(out)):
                out[a] -= counts[row + a] == 0


@kernel
def squared_changes(z, lags):
    """Sum over the channels of (z(t + lag) - z(t))², and the number of channels observed at both, each (lags, frames).

    Each pair is stored at its middle frame, relative to the middle of the pair of shortest lag that starts at frame 0.
    z: (frames, m), NaN where missing.
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


@kernel
def fold_on_grid(z, scale, parts, out):
    """Add counts, then scaled sums, of `z` (frames, m), NaN where missing, to `out` (P, 2m); frame t goes to t·parts.

    Returns the sum of the scaled squares.
    """
    m = z.shape[1]
    place, energy = 0, 0.0
    for t in range(len(z)):
        for a in range(m):
            ok = z[t, a] == z[t, a]
            x = z[t, a] * scale[a] if ok else 0.0
            out[place, a] += ok
            out[place, m + a] += x
            energy += x * x
        place = (place + parts) % len(out)
    return energy


@kernel
def add_shifted(folds, shifts, out):
    """Add the folds (k, rows, P), each shifted back by its shift in [0, P), to `out` (rows, P)."""
    width = out.shape[1]
    for i in range(len(folds)):
        head = width - shifts[i]
        for r in range(len(out)):
            fold, total = folds[i, r], out[r]
            for j in range(head):
                total[j] += fold[shifts[i] + j]
            for j in range(shifts[i]):
                total[head + j] += fold[j]
