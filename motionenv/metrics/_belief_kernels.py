"""Kernels over all pairs of a belief's samples."""

import numpy as np

from motionenv._core.compilation import kernel

# Allow reordering of sums, for SIMD, but keep NaN semantics.
_sums = kernel(fastmath={"reassoc", "contract", "nsz"})

_PADDED = 48  # 45 coordinates, padded to whole SIMD registers
_ROWS = 4  # samples compared with another one at a time


@_sums
def energy(samples, weights, truth, near, apart) -> None:
    """Write the energy score's two terms (n,): `near` is Σ w_i |x_i - y| and `apart` is Σ w_i w_j |x_i - x_j|.

    `samples` are (n, M, 45), `weights` (n, M), each row with sum 1, and `truth` (n, 45).
    """
    m = samples.shape[1]
    whole = (m + _ROWS - 1) // _ROWS * _ROWS
    x = np.zeros((whole, _PADDED), np.float32)  # relative to the truth, for single precision
    w = np.zeros(whole, np.float32)
    distance = np.zeros((_ROWS, whole), np.float32)
    for e in range(len(samples)):
        near[e] = _centre(samples[e], weights[e], truth[e], x, w)
        total = 0.0
        for i in range(0, whole, _ROWS):
            for j in range(i + _ROWS):
                distance[0, j], distance[1, j], distance[2, j], distance[3, j] = _four_squares(x, i, j)
            for r in range(_ROWS):
                before, inside = (
                    _weighted(w[:i], distance[r, :i]),
                    _weighted(w[i : i + _ROWS], distance[r, i : i + _ROWS]),
                )
                total += w[i + r] * (2.0 * before + inside)
        apart[e] = total


@_sums
def _centre(samples, weights, truth, x, w):
    """Write the samples relative to the truth to x and their weights to w; returns the mean distance to the truth."""
    near = 0.0
    for i in range(len(samples)):
        square = 0.0
        for k in range(samples.shape[1]):
            difference = samples[i, k] - truth[k]
            x[i, k] = difference
            square += difference * difference
        w[i] = weights[i]
        near += weights[i] * np.sqrt(square)
    return near


@_sums
def _four_squares(x, i, j):
    a0, a1, a2, a3, b = x[i], x[i + 1], x[i + 2], x[i + 3], x[j]
    s0 = s1 = s2 = s3 = np.float32(0)
    for k in range(_PADDED):  # a compile-time length
        d0, d1, d2, d3 = a0[k] - b[k], a1[k] - b[k], a2[k] - b[k], a3[k] - b[k]
        s0 += d0 * d0
        s1 += d1 * d1
        s2 += d2 * d2
        s3 += d3 * d3
    return s0, s1, s2, s3


@_sums
def _weighted(w, square):
    total = np.float32(0)
    for j in range(len(w)):
        total += w[j] * np.sqrt(square[j])
    return total


@kernel
def centrality(samples, weights, truth, deeper, alike) -> None:
    """Write the weights (n, J) of pooled samples that are more central than the truth, and of those as central.

    Samples closer to the pool by mean distance are `deeper`; the truth counts as `alike`. `samples` are (n, M, J, 3),
    `truth` (n, J, 3), and `weights` (n, M + 1) those of the samples, then of the truth; each row has sum 1.
    """
    n, m, joints, _ = samples.shape
    pool = np.empty((m + 1, 3))
    mean = np.empty(m + 1)
    for e in range(n):
        w = weights[e]
        for joint in range(joints):
            pool[:m] = samples[e, :, joint]
            pool[m] = truth[e, joint]
            _mean_distances(pool, w, mean)
            slack = 1e-12 * mean[m]
            deeper[e, joint], alike[e, joint] = 0.0, 0.0
            for i in range(m + 1):
                if mean[i] < mean[m] - slack:
                    deeper[e, joint] += w[i]
                elif mean[i] <= mean[m] + slack:
                    alike[e, joint] += w[i]


@kernel
def _mean_distances(pool, w, mean):
    """Write each point's weighted mean distance to all points of the pool to `mean`."""
    mean[:] = 0.0
    for i in range(len(pool)):
        for j in range(i):
            a, b, c = pool[i, 0] - pool[j, 0], pool[i, 1] - pool[j, 1], pool[i, 2] - pool[j, 2]
            distance = np.sqrt(a * a + b * b + c * c)
            mean[i] += w[j] * distance
            mean[j] += w[i] * distance
