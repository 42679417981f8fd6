"""What the components leave of a cycle is smooth too, so the neighbourhood of a gap tells more about it.

The residual of each channel is taken for a stationary periodic Gaussian process plus white noise: r = B u + ε, with
u_h ~ N(0, ψ_h), the same for the cosine and the sine of a harmonic, and ε ~ N(0, σ²). Given the samples around a gap,
its expectation is a ridge regression (kriging; Rasmussen & Williams 2006, section 2.1).
"""

import numpy as np

from motionenv.models.ppca import gap_sums, runs


def seen_grams(missing, basis) -> np.ndarray:
    """Bᵀ B over the samples that are seen of each cycle and channel, (K, m, J, J), from `missing` (K, P, m)."""
    k, p, m = missing.shape
    j = basis.shape[1]
    gaps = runs(missing.transpose(0, 2, 1).reshape(-1, p, 1))
    outer = (basis[:, :, None] * basis[:, None, :]).reshape(p, 1, -1)
    return (np.eye(j) - gap_sums(gaps, outer).reshape(-1, j, j)).reshape(k, m, j, j)


def residual_model(residuals, basis) -> tuple[np.ndarray, np.ndarray]:
    """Spectra ψ (m, J) and white variances σ² (m,) of residuals (K, P, m), NaN where missing, by the method of moments.

    With F = Bᵀ B over the seen samples and g = Bᵀ r: E[g_i²] = Σ_j F_ij² ψ_j + σ² F_ii and
    E[Σ r²] = Σ_j F_jj ψ_j + σ² n; summed over cycles that is one linear system per channel.
    """
    missing = np.isnan(residuals)
    r = np.where(missing, 0.0, residuals)
    grams = seen_grams(missing, basis)
    harmonic = harmonics(basis.shape[1])
    pool = np.eye(harmonic.max() + 1)[harmonic]
    trace = np.einsum("kmii->mi", grams) @ pool
    system = np.empty((r.shape[2], pool.shape[1] + 1, pool.shape[1] + 1))
    system[:, :-1, :-1] = pool.T @ (grams**2).sum(axis=0) @ pool
    system[:, :-1, -1] = system[:, -1, :-1] = trace
    system[:, -1, -1] = (~missing).sum(axis=(0, 1))
    g = basis.T @ r
    right = np.column_stack([(g**2).sum(axis=0).T @ pool, (r**2).sum(axis=(0, 1))])
    found = np.linalg.solve(system, right[..., None])[..., 0]
    least = 1e-3 * right[:, -1] / system[:, -1, -1]
    return np.maximum(found[:, :-1], least[:, None])[:, harmonic], np.maximum(found[:, -1], least)


def harmonics(columns: int) -> np.ndarray:
    """Harmonic of each column of the basis: 0, 1 … n - 1, 1 … n - 1."""
    n = (columns + 1) // 2
    return np.r_[0, np.arange(1, n), np.arange(1, n)]


def expected_residual(residuals, basis, spectrum, white) -> np.ndarray:
    """Smooth part (K, P, m) of residuals (K, P, m), NaN where missing, given what is seen of each channel."""
    missing = np.isnan(residuals)
    g = np.moveaxis(basis.T @ np.where(missing, 0.0, residuals), 1, 2) / white[:, None]
    precision = seen_grams(missing, basis) / white[:, None, None]
    index = np.arange(basis.shape[1])
    precision[..., index, index] += 1 / spectrum
    return basis @ np.moveaxis(np.linalg.solve(precision, g[..., None])[..., 0], 1, 2)
