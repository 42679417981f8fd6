"""Model of the components' residuals: they are smooth too, so the samples around a gap help to fill it.

The residual of each channel is a stationary periodic Gaussian process plus white noise: r = B u + ε, with
u_h ~ N(0, ψ_h), equal for the cosine and the sine of a harmonic, and ε ~ N(0, σ²). Its expectation, given the samples
around a gap, is a ridge regression (kriging; Rasmussen & Williams 2006, section 2.1).
"""

from collections.abc import Sequence

import numpy as np

from motionenv._core.threads import in_chunks
from motionenv.models.fpca.observations import from_triangle, running, triangle
from motionenv.models.storage.blocks import CHUNK


def residual_moments(residuals: np.ndarray, basis: np.ndarray) -> tuple:
    """The sums over cycles of which `residual_model` makes a model; those of blocks may be added.

    Residuals are (K, P, m), NaN where missing, the `basis` (P, J) orthonormal.
    """
    from motionenv.models.fpca._residual_kernels import moments

    k, _, m = residuals.shape
    j = basis.shape[1]
    outer = _running_outer(basis)

    def part(start, stop):
        out = np.zeros((m, j * (j + 1) // 2)), np.zeros((m, j)), np.zeros((m, j)), np.zeros((m, 2))
        moments(start, stop, residuals, basis, outer, *out)
        return out

    return tuple(sum(parts) for parts in zip(*in_chunks(part, k, CHUNK), strict=True))


def residual_model(moments: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Spectra ψ (m, J) and white variances σ² (m,) of residuals, by the method of moments.

    With F = Bᵀ B over the n seen samples of the orthonormal basis B (P, J) and g = Bᵀ r: E[g_i²] = Σ_j F_ij² ψ_j + σ²
    F_ii and E[Σ r²] = Σ_j F_jj ψ_j + σ² n. Summed over cycles (`residual_moments`), this is one linear system per
    channel.
    """
    squared, diagonal, g_squared, r_squared = moments
    m, j = diagonal.shape
    harmonic = harmonics(j)
    pool = np.eye(harmonic.max() + 1)[harmonic]
    system = np.empty((m, pool.shape[1] + 1, pool.shape[1] + 1))
    system[:, :-1, :-1] = pool.T @ from_triangle(squared, j) @ pool
    system[:, :-1, -1] = system[:, -1, :-1] = diagonal @ pool
    system[:, -1, -1] = r_squared[:, 1]
    right = np.column_stack([g_squared @ pool, r_squared[:, 0]])
    found = np.linalg.solve(system, right[..., None])[..., 0]
    least = 1e-3 * right[:, -1] / system[:, -1, -1]
    return np.maximum(found[:, :-1], least[:, None])[:, harmonic], np.maximum(found[:, -1], least)


def harmonics(columns: int) -> np.ndarray:
    """Harmonic of each column of the basis: 0, 1 … n - 1, 1 … n - 1."""
    n = (columns + 1) // 2
    return np.r_[0, np.arange(1, n), np.arange(1, n)]


def expected_residual(residuals: np.ndarray, basis: np.ndarray, spectrum: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Expected smooth part (K, P, m) of residuals, given the seen samples of each channel; as of `residual_model`."""
    from motionenv.models.fpca._residual_kernels import expect

    out = np.zeros(residuals.shape)
    in_chunks(lambda a, b: expect(a, b, residuals, basis, _running_outer(basis), spectrum, white, out), len(out), CHUNK)
    return out


def _running_outer(basis) -> np.ndarray:
    """Cumulative sums of b bᵀ over the rows b of the basis, (P + 1, J(J + 1)/2) lower triangles."""
    return running(triangle(basis[:, :, None] * basis[:, None, :]))
