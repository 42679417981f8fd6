"""Compiled kriging of the residuals of each channel (`motionenv.models.fpca.residual`)."""

import numpy as np

from motionenv._core.compilation import kernel

sums = kernel(fastmath={"reassoc", "contract"})


@kernel
def _seen(residual, basis, outer, gram, g):
    """Bᵀ B (lower triangle) and Bᵀ r over the seen samples of `residual` (P,); returns Σ r² and their number."""
    gram[:] = outer[-1]
    g[:] = 0.0
    square, n, missing = 0.0, 0, False
    for p in range(len(residual)):
        x = residual[p]
        if (x != x) != missing:
            missing = not missing
            gram += outer[p] if missing else -outer[p]
        if not missing:
            square, n = square + x * x, n + 1
            for i in range(len(g)):
                g[i] += basis[p, i] * x
    if missing:
        gram -= outer[-1]
    return square, n


@kernel
def moments(start, stop, residuals, basis, outer, squared, diagonal, g_squared, r_squared):
    """Accumulate F² (m, triangle), F_jj (m, J), g² (m, J), and r² with the number of samples (m, 2)."""
    n_columns = basis.shape[1]
    gram, g = np.empty(outer.shape[1]), np.empty(n_columns)
    for k in range(start, stop):
        for a in range(residuals.shape[2]):
            square, n = _seen(residuals[k, :, a], basis, outer, gram, g)
            squared[a] += gram * gram
            g_squared[a] += g * g
            r_squared[a, 0] += square
            r_squared[a, 1] += n
            for i in range(n_columns):
                diagonal[a, i] += gram[i * (i + 3) // 2]


@kernel
def expect(start, stop, residuals, basis, outer, spectrum, white, out):
    """Write the smooth part of residuals, also in gaps, to `out` (K, P, m)."""
    n_columns = basis.shape[1]
    gram, g = np.empty(outer.shape[1]), np.empty(n_columns)
    for k in range(start, stop):
        for a in range(residuals.shape[2]):
            _seen(residuals[k, :, a], basis, outer, gram, g)
            gram /= white[a]
            g /= white[a]
            for i in range(n_columns):
                gram[i * (i + 3) // 2] += 1 / spectrum[a, i]
            _solve(gram, g)
            for p in range(len(basis)):
                for i in range(n_columns):
                    out[k, p, a] += basis[p, i] * g[i]


@sums
def _solve(lower, right):
    """Solve A x = right in place, A positive definite, given by its lower triangle; overwrites it by its root."""
    n = len(right)
    for i in range(n):
        row = i * (i + 1) // 2
        for j in range(i + 1):
            other = j * (j + 1) // 2
            total = lower[row + j]
            for h in range(j):
                total -= lower[row + h] * lower[other + h]
            lower[row + j] = total / lower[other + j] if j < i else np.sqrt(total)
        total = right[i]
        for h in range(i):
            total -= lower[row + h] * right[h]
        right[i] = total / lower[row + i]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for h in range(i + 1, n):
            total -= lower[h * (h + 1) // 2 + i] * right[h]
        right[i] = total / lower[i * (i + 3) // 2]
