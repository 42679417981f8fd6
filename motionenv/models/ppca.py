"""Functional probabilistic PCA: maximum likelihood by EM when samples are missing.

A cycle is x_k = B (m_g(k) + W z_k) + ε with z_k ~ N(0, I) and ε ~ N(0, diag σ²), B the truncated Fourier basis (per
channel), m_g the mean of the cycle's group, and only some samples of x_k seen (Tipping & Bishop 1999, section 3.3;
Roweis 1998). EM takes both z_k and the unseen samples for hidden, so each step is exact and the likelihood rises.

Two things make it fast. What was observed enters through its Fourier coefficients, computed once, since B is
orthonormal. And gaps are runs: a sum over a gap is a difference of cumulative sums, so a pass costs by the number of
gaps, not of samples; the sparse matrix that `runs` makes holds -1 where each begins and +1 where it ends.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse

FLOOR = 1e-9  # least noise variance, relative to the variance of the data: keeps exact data invertible
WARM = 500  # cycles enough to start a larger fit from


class Observations:
    """What an EM needs of cycles: coefficients of the zero-filled deviations, and the gaps; rows sorted by group.

    Args:
        values: (K, P, m), NaN where missing.
        centre: (P, m) subtracted first, or None.
        basis: (P, n) orthonormal.
        groups: (K,) group index of each cycle.
        n_groups: G.
    """

    def __init__(self, values, centre, basis, groups, n_groups: int):
        k, p, m = values.shape
        order = np.argsort(groups, kind="stable")
        y = values.copy() if centre is None else values - centre
        if n_groups > 1:
            y = y[order]
        missing = np.isnan(y)
        y[missing] = 0
        self.coefficients = (basis.T @ y).reshape(k, -1)
        self.square = np.einsum("kpm,kpm->km", y, y)
        edges = np.searchsorted(groups[order], np.arange(n_groups + 1))
        self.groups = [slice(a, b) for a, b in pairwise(edges)]
        self.gaps = [runs(missing[s]) for s in self.groups]
        self.sizes = np.diff(edges).astype(float)
        self.n_missing = np.stack([missing[s].sum(axis=0).ravel() for s in self.groups]).astype(float)
        self.y_sum = np.stack([self.coefficients[s].sum(axis=0) for s in self.groups])
        self.n_seen = k * p * m - self.n_missing.sum()


def runs(missing) -> sparse.csr_array:
    """(K, (P + 1)·m): -1 at the first sample of each run of missing ones, +1 just after its last."""
    k, p, m = missing.shape
    padded = np.zeros((k, p + 2, m), dtype=np.int8)
    padded[:, 1:-1] = missing
    return sparse.csr_array(-np.diff(padded, axis=1).reshape(k, (p + 1) * m)).astype(float)


def gap_sums(gaps, columns) -> np.ndarray:
    """Sums (K, c) over each cycle's missing samples of `columns` (P, m, c)."""
    return gaps @ _running(columns).reshape(-1, columns.shape[-1])


def gap_totals(gaps, rows, m: int) -> np.ndarray:
    """Sums ((P·m), c) over the cycles that miss each sample of their `rows` (K, c)."""
    edges = (gaps.T @ rows).reshape(-1, m, rows.shape[1])
    return -_running(edges)[1:-1].reshape(-1, rows.shape[1])


def _running(rows) -> np.ndarray:
    """Sums of the first 0 … P of `rows` (P, …); np.cumsum strides across memory here and takes five times as long."""
    total = np.zeros((len(rows) + 1, *rows.shape[1:]))
    for j, row in enumerate(rows):
        np.add(total[j], row, out=total[j + 1])
    return total


@dataclass
class Parameters:
    """Loadings and means in the basis and as functions, noise per channel."""

    w: np.ndarray  # (n·m, q)
    means: np.ndarray  # (G, n·m)
    noise: np.ndarray  # (m,) variances
    basis: np.ndarray  # (P, n)

    def functions(self, coefficients) -> np.ndarray:
        """(n·m, c) coefficients as functions (P, m, c)."""
        n = self.basis.shape[1]
        return (self.basis @ coefficients.reshape(n, -1)).reshape(-1, len(self.noise), coefficients.shape[1])


@dataclass
class Sums:
    """What an E step leaves: sufficient statistics over cycles, groups g, samples d = (sample, channel)."""

    zz: np.ndarray  # (q, q) Σ E[z zᵀ]
    z: np.ndarray  # (G, q) Σ E[z]
    missing_zz: np.ndarray  # (D, q, q) Σ E[z zᵀ] over the cycles that miss d
    missing_z: np.ndarray  # (G, D, q) Σ E[z] over the group's cycles that miss d
    yz: np.ndarray  # (n·m, q) Σ y E[z]ᵀ, y in the basis
    loglik: float  # of the observed samples


def posterior(coefficients, gaps, parameters: Parameters, group: int = 0):
    """Posterior of the latents of cycles that share a mean.

    Args:
        coefficients: (K, n·m) of the zero-filled deviations.
        gaps: (K, (P + 1)·m) as `runs` makes them.
        parameters: present parameters.
        group: whose mean.

    Returns:
        means (K, q), covariances (K, q, q), and of each cycle (K,) twice its observed log-likelihood plus y² / noise.
    """
    q, n = parameters.w.shape[1], parameters.basis.shape[1]
    scaled = parameters.w / np.tile(parameters.noise, n)[:, None]
    mean = parameters.means[group]
    both = parameters.functions(np.column_stack([parameters.w, mean]))
    loading, level, noise = both[..., :q], both[..., q:], parameters.noise[:, None]
    constant = level**2 / noise + np.log(2 * np.pi * noise)
    outer = (loading[..., :, None] * (loading / noise)[..., None, :]).reshape(*loading.shape[:2], q * q)
    columns = np.concatenate([outer, loading * level / noise, constant], axis=-1)
    seen = columns.sum(axis=(0, 1)) - gap_sums(gaps, columns)
    on_y = coefficients @ np.column_stack([scaled, mean / np.tile(parameters.noise, n)])
    precision = np.eye(q) + seen[:, : q * q].reshape(-1, q, q)
    right = on_y[:, :q] - seen[:, q * q : -1]
    covariance = np.linalg.inv(precision)
    z = (covariance @ right[..., None])[..., 0]
    twice = np.einsum("ki,ki->k", right, z) - np.linalg.slogdet(precision)[1] + 2 * on_y[:, -1] - seen[:, -1]
    return z, covariance, twice


def e_step(data: Observations, parameters: Parameters) -> Sums:
    """Expected sufficient statistics under the present parameters."""
    q, d = parameters.w.shape[1], data.n_missing.shape[1]
    z_sum, missing_z = np.zeros((len(data.groups), q)), np.zeros((len(data.groups), d, q))
    zz, missing_zz, yz = np.zeros((q, q)), np.zeros((d, q * q)), np.zeros((len(parameters.w), q))
    twice = -(data.square @ (1 / parameters.noise)).sum()
    for g, rows in enumerate(data.groups):
        y, gaps = data.coefficients[rows], data.gaps[g]
        z, covariance, part = posterior(y, gaps, parameters, g)
        second = covariance + z[:, :, None] * z[:, None, :]
        missed = gap_totals(gaps, np.column_stack([second.reshape(-1, q * q), z]), len(parameters.noise))
        missing_zz += missed[:, : q * q]
        missing_z[g] = missed[:, q * q :]
        yz += y.T @ z
        zz += second.sum(axis=0)
        z_sum[g] = z.sum(axis=0)
        twice += part.sum()
    return Sums(zz, z_sum, missing_zz.reshape(d, q, q), missing_z, yz, 0.5 * twice)


def m_step(data: Observations, sums: Sums, old: Parameters) -> Parameters:
    """Parameters that maximise the expected log-likelihood: completed cycles regressed on latents and groups."""
    q, m, (p, n) = old.w.shape[1], len(old.noise), old.basis.shape
    loading = old.functions(old.w).reshape(-1, q)
    means = old.functions(old.means.T).reshape(len(loading), -1).T
    mean_z = np.einsum("gd,gdi->di", means, sums.missing_z)
    filled_zz = (sums.missing_zz @ loading[:, :, None])[..., 0]
    filled_z = filled_zz + mean_z
    filled_1 = means * data.n_missing + np.einsum("di,gdi->gd", loading, sums.missing_z)
    filled = old.basis.T @ np.column_stack([filled_z, filled_1.T]).reshape(p, -1)
    right = filled.reshape(n * m, -1) + np.column_stack([sums.yz, data.y_sum.T])
    sizes = np.diag(np.maximum(data.sizes, 1))  # a warm start may lack a group
    found = np.linalg.solve(np.block([[sums.zz, sums.z.T], [sums.z, sizes]]), right.T).T
    square = (loading * (filled_zz + 2 * mean_z)).sum(axis=1) + (data.n_missing * means**2).sum(axis=0)
    square = square.reshape(p, m).sum(axis=0) + data.square.sum(axis=0)
    square += data.n_missing.reshape(-1, p, m).sum(axis=(0, 1)) * old.noise
    explained = (found * right).sum(axis=1).reshape(n, m).sum(axis=0)
    floor = FLOOR * data.square.sum() / data.n_seen
    noise = np.maximum((square - explained) / (p * len(data.square)), floor)
    # Parameter expansion (Liu, Rubin & Wu 1998): let the latents have any means and covariance, then absorb both.
    shift = sums.z / np.maximum(data.sizes, 1)[:, None]
    covariance = (sums.zz - sums.z.T @ shift) / len(data.square)
    means = found[:, q:].T + shift @ found[:, :q].T
    return Parameters(found[:, :q] @ np.linalg.cholesky(covariance), means, noise, old.basis)


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
    centre = pooled_mean(values, basis)
    data = Observations(values, basis @ centre, basis, groups, int(groups.max()) + 1)
    start = _start(data, basis, rank)
    if len(values) >= 2 * WARM:  # most iterations are spent where they are cheap
        some = slice(None, None, len(values) // WARM)
        part = Observations(values[some], basis @ centre, basis, groups[some], len(data.groups))
        start, _ = _em(part, start, tol, max_iter)
    found, errors = _em(data, start, tol, max_iter)
    left, scale, _ = np.linalg.svd(found.w, full_matrices=False)
    means = centre + found.means.reshape(-1, *centre.shape)
    return means, left.T.reshape(rank, *centre.shape), scale**2, found.noise, errors


def _em(data: Observations, parameters: Parameters, tol: float, max_iter: int) -> tuple[Parameters, list[float]]:
    """Parameters where EM stops, and the negative log-likelihood of each iteration."""
    errors: list[float] = []
    while True:
        sums = e_step(data, parameters)
        errors.append(-sums.loglik)
        if len(errors) >= max_iter or (len(errors) > 1 and errors[-2] - errors[-1] <= tol * abs(errors[-1])):
            return parameters, errors
        parameters = m_step(data, sums, parameters)


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


def _start(data: Observations, basis, rank: int) -> Parameters:
    """First parameters: principal components of (at most `WARM` of) the zero-filled deviations."""
    some = data.coefficients[:: max(1, len(data.coefficients) // WARM)]
    m = data.square.shape[1]
    values, vectors = np.linalg.eigh(some @ some.T if len(some) < some.shape[1] else some.T @ some)
    values, vectors = values[: -rank - 1 : -1], vectors[:, : -rank - 1 : -1]
    if len(some) < some.shape[1]:
        vectors = some.T @ (vectors / np.sqrt(np.maximum(values, 1e-300)))
    w = vectors * np.sqrt(np.maximum(values, 0) / len(some))
    variance = data.square.sum() / data.n_seen
    residual = np.clip(1 - values.sum() / data.square.sum() * len(data.square) / len(some), 0.05, 1)
    means = np.zeros((len(data.groups), len(w)))
    return Parameters(w, means, np.full(m, residual * variance), basis)
