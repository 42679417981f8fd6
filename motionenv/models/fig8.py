"""Paper A's fig. 8: functional PCA by alternating a truncated SVD with the imputation of missing samples."""

import numpy as np

from motionenv.models.ppca import pooled_mean


def fit_svd(values, groups, basis, rank: int, tol: float, max_iter: int):
    """Fig. 8 in the real orthonormal basis, where Theorem 1 holds. Arguments and returns as `ppca.fit_ppca`.

    The errors are ‖X⁽²⁾ - X⁽⁵⁾‖ at step 6, before the imputation. Noise is the mean square of the observed residual.
    """
    k, _, m = values.shape
    seen = np.isfinite(values)
    centre = pooled_mean(values, basis)
    deviations = np.where(seen, values - basis @ centre, 0.0)
    own = np.stack([_group_mean(deviations[groups == g], seen[groups == g], basis) for g in range(groups.max() + 1)])
    x2 = np.where(seen, deviations - (basis @ own)[groups], 0.0)
    errors: list[float] = []
    while True:
        x3 = (basis.T @ x2).reshape(k, -1)
        u, s, vt = np.linalg.svd(x3, full_matrices=False)
        x5 = basis @ ((u[:, :rank] * s[:rank]) @ vt[:rank]).reshape(k, -1, m)
        errors.append(float(np.linalg.norm(x2 - x5)))
        if len(errors) >= max_iter or (len(errors) > 1 and errors[-2] - errors[-1] <= tol * errors[-2]):
            break
        x2 = np.where(seen, x2, x5)
    noise = (np.where(seen, x2 - x5, 0.0) ** 2).sum(axis=(0, 1)) / seen.sum(axis=(0, 1))
    variance = s[:rank] ** 2 / (k - len(own))
    return centre + own, vt[:rank].reshape(rank, -1, m), variance, noise, errors


def _group_mean(deviations, seen, basis) -> np.ndarray:
    """Column means of a group's zero-filled deviations from the pooled mean, in the basis; unseen counts as 0."""
    return basis.T @ (deviations.sum(axis=0) / np.maximum(seen.sum(axis=0), 1))
