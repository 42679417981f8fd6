"""Functional probabilistic PCA: maximum likelihood by EM when samples are missing.

A cycle is x_k = B (m_g(k) + W z_k) + ε with z_k ~ N(0, I) and ε ~ N(0, diag σ²), B the truncated Fourier basis (per
channel), m_g the mean of the cycle's group, and only some samples of x_k seen (Tipping & Bishop 1999, section 3.3;
Roweis 1998). EM takes both z_k and the unseen samples for hidden. All sums over cycles are then four matrix products
with the 0/1 mask and the zero-filled values, which is as fast as memory can be read.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

FLOOR = 1e-9  # least noise variance, relative to the variance of the data: keeps exact data invertible


@dataclass
class Sums:
    """What an E step leaves: sufficient statistics over cycles, groups g, samples d = (sample, channel)."""

    zz: np.ndarray  # (q, q) Σ E[z zᵀ]
    z: np.ndarray  # (groups, q) Σ E[z]
    seen_zz: np.ndarray  # (D, q, q) Σ E[z zᵀ] over the cycles that show d
    seen_z: np.ndarray  # (groups, D, q)
    yz: np.ndarray  # (D, q) Σ y E[z]ᵀ over the cycles that show d
    scores: np.ndarray  # (K, q) E[z]
    loglik: float


class Observations:
    """Zero-filled deviations and 0/1 mask of all cycles as two matrices, rows sorted by group.

    Args:
        values: (K, P, m), NaN where missing.
        centre: (P, m) subtracted first, so that float32 sums keep their digits.
        groups: (K,) group index of each cycle, 0 … G - 1.
    """

    def __init__(self, values, centre, groups):
        k = len(values)
        self.order = np.argsort(groups, kind="stable")
        seen = np.isfinite(values[self.order]).reshape(k, -1)
        self.y = np.where(seen, (values - centre)[self.order].reshape(k, -1), 0.0)
        self.mask = seen.astype(self.y.dtype)
        edges = np.searchsorted(groups[self.order], np.arange(groups.max() + 2))
        self.slices = [slice(a, b) for a, b in pairwise(edges)]
        self.sizes = np.diff(edges).astype(float)
        self.count = np.stack([self.mask[s].sum(axis=0) for s in self.slices])
        self.y_sum = np.stack([self.y[s].sum(axis=0) for s in self.slices])
        self.y_square = np.einsum("kd,kd->d", self.y, self.y)
        self.n_seen = self.mask.sum(axis=1)


def posterior(y, mask, loadings, mean, noise):
    """Posterior of the latents of cycles of one group.

    Args:
        y, mask: (K, D) zero-filled deviations and 0/1 mask.
        loadings: (D, q); mean: (D,); noise: (D,) variance.

    Returns:
        means (K, q), covariances (K, q, q) and the observed log-likelihood of each cycle (K,).
    """
    q = loadings.shape[1]
    scaled = loadings / noise[:, None]
    outer = (loadings[:, :, None] * scaled[:, None, :]).reshape(-1, q * q)
    constant = mean**2 / noise + np.log(2 * np.pi * noise)
    on_mask = mask @ np.column_stack([outer, scaled * mean[:, None], constant])
    precision = np.eye(q) + on_mask[:, : q * q].reshape(-1, q, q)
    on_y = y @ np.column_stack([scaled, mean / noise])
    right = on_y[:, :q] - on_mask[:, q * q : -1]
    covariance = np.linalg.inv(precision)
    z = np.einsum("kij,kj->ki", covariance, right)
    square = (y**2) @ (1 / noise) - 2 * on_y[:, -1] + on_mask[:, -1]
    loglik = -0.5 * (square - np.einsum("ki,ki->k", right, z) + np.linalg.slogdet(precision)[1])
    return z, covariance, loglik


def e_step(data: Observations, loadings, means, noise) -> Sums:
    """Expected sufficient statistics under the present parameters; `means` (groups, D)."""
    q = loadings.shape[1]
    d = len(loadings)
    scores = np.empty((len(data.y), q))
    z_sum, seen_z = np.zeros((len(means), q)), np.zeros((len(means), d, q))
    zz, seen_zz, yz, loglik = np.zeros((q, q)), np.zeros((d, q * q)), np.zeros((d, q)), 0.0
    for g, rows in enumerate(data.slices):
        y, mask = data.y[rows], data.mask[rows]
        z, covariance, part = posterior(y, mask, loadings, means[g], noise)
        second = covariance + z[:, :, None] * z[:, None, :]
        on_mask = mask.T @ np.concatenate([second.reshape(-1, q * q), z], axis=1)
        seen_zz += on_mask[:, : q * q]
        seen_z[g] = on_mask[:, q * q :]
        yz += y.T @ z
        zz += second.sum(axis=0)
        z_sum[g] = z.sum(axis=0)
        scores[rows] = z
        loglik += part.sum()
    return Sums(zz, z_sum, seen_zz.reshape(d, q, q), seen_z, yz, scores, loglik)


def m_step(data: Observations, sums: Sums, basis, loadings, means, noise):
    """Parameters that maximise the expected log-likelihood: coefficients of loadings and means, noise per channel.

    Returns:
        (n, m, q + groups) coefficients, loadings first, and (m,) noise variances.
    """
    p, n = basis.shape
    q, groups, d = loadings.shape[1], len(means), len(loadings)
    missing_zz = sums.zz - sums.seen_zz
    missing_z = sums.z[:, None, :] - sums.seen_z
    missing = data.sizes[:, None] - data.count
    x_z = sums.yz + np.einsum("dij,dj->di", missing_zz, loadings) + np.einsum("gd,gdi->di", means, missing_z)
    x_1 = data.y_sum + means * missing + np.einsum("di,gdi->gd", loadings, missing_z)
    sums_xu = np.concatenate([x_z, x_1.T], axis=1)
    gram = np.block([[sums.zz, sums.z.T], [sums.z, np.diag(data.sizes)]])
    right = (basis.T @ sums_xu.reshape(p, -1)).reshape(n, d // p, q + groups)
    coefficients = np.linalg.solve(gram, right.reshape(-1, q + groups).T).T.reshape(right.shape)
    square = (
        data.y_square
        + np.einsum("dij,di,dj->d", missing_zz, loadings, loadings)
        + np.einsum("gd,gd->d", missing, means**2)
        + 2 * np.einsum("gd,di,gdi->d", means, loadings, missing_z)
        + missing.sum(axis=0) * noise
    )
    explained = np.einsum("nmj,nmj->m", coefficients, right)
    residual = (square.reshape(p, -1).sum(axis=0) - explained) / (p * len(data.y))
    return coefficients, residual


def fit_ppca(values, groups, basis, rank: int, tol: float, max_iter: int):
    """Maximum likelihood of the functional probabilistic PCA.

    Args:
        values: (K, P, m), NaN where missing.
        groups: (K,) group of each cycle, 0 … G - 1; each has its own mean.
        basis: (P, n) orthonormal.
        rank: q.
        tol: stop when an iteration gains less than this fraction of the log-likelihood.
        max_iter: iterations at most.

    Returns:
        means (G, n, m) and orthonormal components (q, n, m) in the basis, score variances (q,), noise variances (m,),
        negative log-likelihood of the observed samples at each iteration.
    """
    k, p, m = values.shape
    centre = pooled_mean(values, basis)
    data = Observations(values, basis @ centre, groups)
    coefficients, noise = _start(data, basis, rank, m)
    floor = FLOOR * data.y_square.sum() / data.mask.sum()
    errors: list[float] = []
    while True:
        functions = (basis @ coefficients.reshape(len(basis.T), -1)).reshape(p * m, -1)
        loadings, means = functions[:, :rank], np.ascontiguousarray(functions[:, rank:].T)
        noise_d = np.tile(noise, p)
        sums = e_step(data, loadings, means, noise_d)
        errors.append(-sums.loglik)
        if len(errors) >= max_iter or (len(errors) > 1 and errors[-2] - errors[-1] <= tol * abs(errors[-1])):
            break
        coefficients, noise = m_step(data, sums, basis, loadings, means, noise_d)
        noise = np.maximum(noise, floor)
        # Parameter expansion (Liu, Rubin & Wu 1998): let the latents have any covariance, then absorb it in W.
        coefficients[..., :rank] = coefficients[..., :rank] @ np.linalg.cholesky(sums.zz / k)
    left, scale, _ = np.linalg.svd(coefficients[..., :rank].reshape(-1, rank), full_matrices=False)
    means = centre + np.moveaxis(coefficients[..., rank:], -1, 0)
    return means, left.T.reshape(rank, -1, m), scale**2, noise, errors


def pooled_mean(values, basis) -> np.ndarray:
    """Column means of the observed samples (fig. 8, step 1) projected on the basis, (n, m).

    Where nobody shows a sample, the mean is interpolated around the cycle.
    """
    seen = np.isfinite(values)
    count = seen.sum(axis=0)
    column = np.where(seen, values, 0.0).sum(axis=0) / np.maximum(count, 1)
    j = np.arange(len(column))
    for a in np.flatnonzero((count == 0).any(axis=0)):
        some = count[:, a] > 0
        column[:, a] = np.interp(j, j[some], column[some, a], period=len(j))
    return basis.T @ column


def _start(data: Observations, basis, rank: int, m: int):
    """First coefficients (n, m, q + G) and noise (m,): principal components of the zero-filled deviations."""
    k, (p, n) = len(data.y), basis.shape
    projected = (basis.T @ data.y.reshape(k, p, m)).reshape(k, -1)
    _, singular, right = np.linalg.svd(projected, full_matrices=False)
    coefficients = np.zeros((n, m, rank + len(data.sizes)))
    coefficients[..., :rank] = (right[:rank].T * (singular[:rank] / np.sqrt(k))).reshape(n, m, rank)
    total = data.y_square.sum()
    residual = np.clip(1 - (singular[:rank] ** 2).sum() / total, 0.05, 1)
    return coefficients, np.full(m, residual * total / data.mask.sum())
