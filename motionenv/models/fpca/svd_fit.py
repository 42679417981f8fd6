"""Paper A's fig. 8: functional PCA by alternating a truncated SVD with the imputation of missing samples.

Both steps reduce ‖X⁽²⁾ - X⁽⁵⁾‖ (Theorem 1), and so does each part of them: scores given components, components given
scores, and gaps given both. Solving for the parts avoids filled cycles. One pass over the Fourier coefficients of the
seen samples computes all scores, and the sums from which the components follow; both steps impute the gaps several
times. Components are extrapolated from pass to pass; extrapolations that raise the error are rejected. The result is
that of fig. 8, after fewer passes, each far cheaper than an SVD.
"""

import numpy as np

from motionenv.models.fpca import observations as obs
from motionenv.models.fpca.em_fit import FLOOR, WARM, Anderson, Fit, first_parameters
from motionenv.models.fpca.observations import Observations

REPEATS = 3  # imputations per pass, of scores and of components
OVERSAMPLING = 2  # factor on q for the first components of a large fit (Halko, Martinsson & Tropp 2011)
LEAST = 1e-6  # relative error that counts as zero; its square is of the order of rounding errors


def fit_svd(data: Observations, rank: int, tol: float, max_iter: int) -> Fit:
    """Fig. 8 in the real orthonormal basis, in which Theorem 1 holds; means are those of the groups' observed samples.

    Stops when each of two iterations in a row gains less than the fraction `tol` of the error: ‖X⁽²⁾ - X⁽⁵⁾‖ with the
    gaps of X⁽²⁾ filled from X⁽⁵⁾, that is, the root of the squared error on the observed samples. Noise is the mean
    square of their residuals.
    """
    if data.n < 2 * WARM:
        loadings = np.linalg.qr(first_parameters(data, rank).w)[0]
    else:  # The first parameters are of a subset: of more components, keep those that explain all cycles best.
        wide = np.linalg.qr(first_parameters(data, OVERSAMPLING * rank).w)[0]
        wide, z, *_ = _descend(data, wide, tol, 1)
        loadings = wide @ np.linalg.eigh(z.T @ z)[1][:, : -rank - 1 : -1]
    loadings, z, noise, errors, converged = _descend(data, loadings, tol, max_iter)
    _, s, vt = np.linalg.svd(z, full_matrices=False)
    components = (loadings @ vt.T).T.reshape(rank, *data.centre.shape[1:])
    variance = s**2 / (len(z) - len(data.centre))
    return Fit(data.centre, components, variance, noise, z @ vt.T, errors, converged)


def _descend(data: Observations, loadings, tol, max_iter):
    """Loadings (n·m, q), scores (K, q), noise (m,), errors, and whether they converged, from orthonormal loadings."""
    m, total, least = len(data.squares), data.squares.sum(), LEAST**2 * data.squares.sum()
    z = np.zeros((data.n, loadings.shape[1]))
    errors: list[float] = []
    ahead, plain, small = Anderson(), (loadings, z), 0
    while True:
        z, squares, zz, missing_zz, yz = _imputed(data, loadings, z)
        error = float(np.sqrt(max(total + squares, least)))
        if loadings is not plain[0] and not error <= errors[-1]:
            loadings, z = plain
            ahead.forget()
            continue
        small = small + 1 if errors and errors[-1] - error <= tol * errors[-1] else 0
        errors.append(error)
        if len(errors) >= max_iter or small == 2:  # a single small gain may come from a poor extrapolation
            return loadings, z, _noise(data, loadings, zz, missing_zz, yz), errors, small == 2
        following, turn = _orthonormal(_regress(data.basis, loadings, zz, missing_zz, yz, m))
        plain = following, z @ turn
        loadings, z = _orthonormal(ahead.propose(loadings, following))[0], plain[1]


def _imputed(data: Observations, loadings, z):
    """Scores (K, q) after imputations that begin with scores `z`, and sums over all cycles.

    The sums: squared errors on the seen samples less y², z zᵀ (q, q), the same over the cycles that lack each sample
    (D, q, q), and y zᵀ (n·m, q).
    """
    from motionenv.models.fpca._gap_kernels import impute_scores

    q, m = loadings.shape[1], len(data.squares)
    curves = obs.functions(loadings, data.basis, m)
    outer = obs.running(obs.triangle(curves[..., :, None] * curves[..., None, :])).reshape(-1, q * (q + 1) // 2)
    z, squares, rows = z.copy(), np.empty(data.n), np.ascontiguousarray(loadings.T)
    yz, edges = obs.in_parts(impute_scores, data, (rows, outer), (z, squares), [rows.shape, outer.shape], REPEATS)
    return z, squares.sum(), z.T @ z, obs.from_triangle(obs.missed(edges, m), q), yz.T


def _orthonormal(w):
    """The orthonormal matrix nearest to `w`, which makes steps comparable, and the factor (q, q) from it to `w`."""
    left, scale, right = np.linalg.svd(w, full_matrices=False)
    return left @ right, (right.T * scale) @ right


def _regress(basis, loadings, zz, missing_zz, yz, m: int):
    """Regress the seen samples, and the gaps filled by the last loadings, on the scores; repeat. Loadings (n·m, q)."""
    inverse = np.linalg.pinv(zz, hermitian=True)
    for _ in range(REPEATS):
        curves = obs.functions(loadings, basis, m).reshape(len(missing_zz), -1, 1)
        filled = basis.T @ (missing_zz @ curves).reshape(len(basis), -1)
        loadings = (filled.reshape(yz.shape) + yz) @ inverse
    return loadings


def _noise(data: Observations, loadings, zz, missing_zz, yz):
    """Mean squared residual (m,) of each channel's observed samples."""
    m = len(data.squares)
    curves = obs.functions(loadings, data.basis, m).reshape(len(missing_zz), -1)
    explained = 2 * (loadings * yz).sum(axis=1).reshape(-1, m).sum(axis=0)
    explained -= np.einsum("di,dij,dj->d", curves, zz - missing_zz, curves).reshape(-1, m).sum(axis=0)
    seen = data.n * len(data.basis) - data.n_missing.reshape(-1, m).sum(axis=0)
    return np.maximum(data.squares - explained, FLOOR * data.squares.sum() / m) / seen
