"""Functional probabilistic PCA: maximum likelihood by EM with missing samples.

A cycle is x_k = B (m_g(k) + W z_k) + ε with z_k ~ N(0, I) and ε ~ N(0, diag σ²). B is the truncated Fourier basis of
each channel, m_g the mean of the cycle's group, and only some samples of x_k are seen (Tipping & Bishop 1999, section
3.3; Roweis 1998). Both z_k and the unseen samples are hidden variables, so each step is exact and never lowers the
likelihood.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.models.fpca import observations as obs
from motionenv.models.fpca.observations import Observations

FLOOR = 1e-9  # least noise variance relative to the data's; keeps exact data invertible
WARM = 500  # cycles of the subset to which a large fit is fitted first
START = 250  # cycles of the subset from which the first components are computed
DEPTH = 5  # former iterations from which the next is extrapolated
REPEATS = 3  # regressions per E step; they are cheap and save E steps


class Anderson:
    """Anderson acceleration of fixed-point iterations x ← g(x) (Anderson 1965; Walker & Ni 2011).

    Proposes the mixture of the last images g(x) whose residuals g(x) - x cancel best.

    A proposal may raise the objective. The caller must check, and then `forget` and continue from the plain g(x).
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Discard the history."""
        self.images: list[np.ndarray] = []
        self.residuals: list[np.ndarray] = []

    def propose(self, x: np.ndarray, image: np.ndarray) -> np.ndarray:
        """The next point, given the last one `x` and its `image` g(x), arrays of one shape."""
        self.images = [*self.images[-DEPTH:], image]
        self.residuals = [*self.residuals[-DEPTH:], image - x]
        if len(self.images) == 1:
            return image
        change = np.stack([(self.residuals[-1] - r).ravel() for r in self.residuals[:-1]])
        gram = change @ change.T
        gram[np.diag_indices_from(gram)] *= 1 + 1e-10
        weights = np.linalg.lstsq(gram, change @ self.residuals[-1].ravel(), rcond=None)[0]
        steps = np.stack([image - former for former in self.images[:-1]])
        return image - np.tensordot(weights, steps, axes=1)


@dataclass
class Parameters:
    """Loadings, means (relative to the centre of the observations) and noise."""

    w: np.ndarray  # (n·m, q), in the basis
    means: np.ndarray  # (G, n·m), in the basis
    noise: np.ndarray  # (m,) variances


@dataclass
class Fit:
    """What a fit finds."""

    means: np.ndarray  # (G, n, m) of the groups, in the basis
    components: np.ndarray  # (q, n, m) in the basis, orthonormal
    variance: np.ndarray  # (q,) of the scores
    noise: np.ndarray  # (m,) residual variance per sample
    scores: np.ndarray  # (K, q)
    errors: list[float]  # the objective at each iteration
    converged: bool

    def infer(self, data: Observations) -> np.ndarray:
        """Posterior means (K, q) of the scores of other cycles, about the same means."""
        w = self.components.reshape(len(self.variance), -1).T * np.sqrt(self.variance)
        shift = (self.means - data.centre).reshape(len(self.means), -1)
        return posterior_of(data, Parameters(w, shift, self.noise)).z * np.sqrt(self.variance)


@dataclass
class Statistics:
    """Result of an E step: sums over all cycles of what the posterior of the latents says."""

    twice: float  # twice the log-likelihood of the seen samples, plus Σ y² / σ²
    zz: np.ndarray  # (q, q) Σ E[z zᵀ]
    z_sum: np.ndarray  # (G, q) Σ E[z]
    missing_zz: np.ndarray  # (D, q, q) Σ E[z zᵀ] over the cycles that lack sample d
    missing_z: np.ndarray  # (G, D, q) Σ E[z] over the group's cycles that lack sample d
    yz: np.ndarray  # (n·m, q) Σ y E[z]ᵀ, y in the basis


@dataclass
class Posterior:
    """The latents of all cycles: normal with these means and covariances."""

    z: np.ndarray  # (K, q) means
    covariance: np.ndarray  # (K, q, q)
    twice: np.ndarray  # (K,) twice the log-likelihood of each cycle's seen samples, plus Σ y² / σ²
    sums: list[np.ndarray]  # Σ E[z] yᵀ (q, n·m), and at the edges of the gaps Σ E[z zᵀ] and Σ E[z]


def e_step(data: Observations, parameters: Parameters) -> Statistics:
    """Sums over the posterior of the latents of all cycles of `data` under the present `parameters`."""
    from motionenv.models.fpca._gap_kernels import group_sums

    m, q = len(parameters.noise), parameters.w.shape[1]
    found = posterior_of(data, parameters)
    yz, zz_edges, z_edges = found.sums
    z_sum = np.zeros((len(data.centre), q))
    group_sums(found.z, data.groups, z_sum)
    zz = found.covariance.sum(axis=0) + found.z.T @ found.z
    missing_z = np.stack([obs.missed(edges, m) for edges in z_edges])
    missing_zz = obs.from_triangle(obs.missed(zz_edges, m), q)
    return Statistics(found.twice.sum(), zz, z_sum, missing_zz, missing_z, yz.T)


def posterior_of(data: Observations, parameters: Parameters) -> Posterior:
    """Posterior of the latents of all cycles of `data` under `parameters`."""
    from motionenv.models.fpca._gap_kernels import posterior

    tables = tables_of(data.basis, parameters)
    weights, means, outer = tables[:3]
    q = len(weights)
    z, covariance, twice = np.empty((data.n, q)), np.empty((data.n, q, q)), np.empty(data.n)
    shapes = [weights.shape, outer.shape, (len(means), len(outer), q)]
    return Posterior(z, covariance, twice, obs.in_parts(posterior, data, tables, (z, covariance, twice), shapes))


def tables_of(basis: np.ndarray, parameters: Parameters) -> tuple[np.ndarray, ...]:
    """The `tables` of the kernel `posterior` for a `basis` (P, n) and `parameters`."""
    (size, q), m = parameters.w.shape, len(parameters.noise)
    noise, by_row = parameters.noise[:, None], np.tile(parameters.noise, size // m)
    loading = obs.functions(parameters.w, basis, m)
    products = obs.triangle(loading[..., :, None] * (loading / noise)[..., None, :])
    outer = obs.running(products).reshape(-1, q * (q + 1) // 2)
    levels = []
    for level in np.moveaxis(obs.functions(parameters.means.T, basis, m), -1, 0)[..., None]:
        constant = level**2 / noise + np.log(2 * np.pi * noise)
        levels.append(obs.running(np.concatenate([loading * level / noise, constant], axis=-1)))
    cross = np.stack(levels)
    weights = np.ascontiguousarray(parameters.w.T) / by_row
    all_outer, all_cross = outer[-m:].sum(axis=0), cross[:, -1].sum(axis=1)
    return weights, parameters.means / by_row, outer, all_outer, cross.reshape(len(cross), -1, q + 1), all_cross


def log_likelihood(data: Observations, noise: np.ndarray, found: Statistics) -> float:
    """Log-likelihood of the observed samples in `data`, with the `noise` (m,) under which `found` was computed."""
    return 0.5 * float(found.twice - data.squares @ (1 / noise))


def m_step(data: Observations, found: Statistics, old: Parameters, shared: bool = False) -> Parameters:
    """Parameters that raise the expected log-likelihood, from repeated regressions on latents and groups.

    The posterior `found` is that under the `old` ones, which fill the gaps in the first regression. With `shared`, all
    channels have the same noise.
    """
    parameters = old
    for _ in range(REPEATS):
        parameters = _regress(data, found, parameters)
        if shared:
            parameters.noise[:] = parameters.noise.mean()
    # Parameter expansion (Liu, Rubin & Wu 1998): absorb the latents' means and covariance in means and loadings.
    shift = found.z_sum / np.maximum(data.sizes, 1)[:, None]
    covariance = (found.zz - found.z_sum.T @ shift) / data.n
    means = parameters.means + shift @ parameters.w.T
    return Parameters(parameters.w @ np.linalg.cholesky(covariance), means, parameters.noise)


def _regress(data: Observations, found: Statistics, old: Parameters) -> Parameters:
    """Regress the seen samples, and the expectations of `old` in the gaps, on latents and groups."""
    q, m, (p, n) = old.w.shape[1], len(old.noise), data.basis.shape
    loading = obs.functions(old.w, data.basis, m).reshape(-1, q)
    means = obs.functions(old.means.T, data.basis, m).reshape(len(loading), -1).T
    mean_z = np.einsum("gd,gdi->di", means, found.missing_z)
    filled_zz = (found.missing_zz @ loading[:, :, None])[..., 0]
    filled_z = filled_zz + mean_z
    filled_1 = means * data.n_missing + np.einsum("di,gdi->gd", loading, found.missing_z)
    filled = data.basis.T @ np.column_stack([filled_z, filled_1.T]).reshape(p, -1)
    right = filled.reshape(n * m, -1) + np.column_stack([found.yz, data.y_sum.T])
    sizes = np.diag(np.maximum(data.sizes, 1))  # a warm start may lack a group
    w = np.linalg.solve(np.block([[found.zz, found.z_sum.T], [found.z_sum, sizes]]), right.T).T
    square = (loading * (filled_zz + 2 * mean_z)).sum(axis=1) + (data.n_missing * means**2).sum(axis=0)
    square = square.reshape(p, m).sum(axis=0) + data.squares
    square += data.n_missing.reshape(-1, p, m).sum(axis=(0, 1)) * old.noise
    explained = (w * right).sum(axis=1).reshape(n, m).sum(axis=0)
    floor = FLOOR * data.squares.sum() / data.n_seen
    noise = np.maximum((square - explained) / (p * data.n), floor)
    return Parameters(w[:, :q], w[:, q:].T, noise)


def fit_ppca(data: Observations, rank: int, tol: float, max_iter: int, shared: bool = False) -> Fit:
    """Maximum likelihood of the functional probabilistic PCA with `rank` components q; each group has its own mean.

    Stops when an iteration gains less than the fraction `tol` of the log-likelihood, whose negative is the objective.
    With `shared`, all channels have the same noise. Scores are posterior means.
    """
    start = first_parameters(data, rank)
    if data.n >= 2 * WARM:  # most iterations run on the cheap subset
        start = _em(data.every(data.n // WARM), start, tol, max_iter, shared)[0]
    found, errors, converged = _em(data, start, tol, max_iter, shared)
    left, scale, right = np.linalg.svd(found.w, full_matrices=False)
    shape = data.centre.shape[1:]
    means = data.centre + found.means.reshape(-1, *shape)
    scores = posterior_of(data, found).z @ right.T * scale
    return Fit(means, left.T.reshape(rank, *shape), scale**2, found.noise, scores, errors, converged)


def _em(data: Observations, parameters: Parameters, tol: float, max_iter: int, shared: bool) -> tuple:
    """Parameters at convergence, the negative log-likelihood of each accepted iteration, and whether it converged.

    Extrapolated steps that don't raise the likelihood are rejected. Two small gains in a row end the fit, since a
    single one may come from a poor extrapolation.
    """
    errors: list[float] = []
    ahead, plain, small = Anderson(), parameters, 0
    while True:
        found = e_step(data, parameters)
        error = -log_likelihood(data, parameters.noise, found)
        if parameters is not plain and not error <= errors[-1]:
            parameters = plain
            ahead.forget()
            continue
        small = small + 1 if errors and errors[-1] - error <= tol * abs(error) else 0
        errors.append(error)
        if len(errors) >= max_iter or small == 2:
            return parameters, errors, small == 2
        plain = m_step(data, found, parameters, shared)
        parameters = _extrapolate(ahead, parameters, plain)


def _extrapolate(ahead: Anderson, old: Parameters, new: Parameters) -> Parameters:
    """Extrapolate the step from `old` to `new` and those before, with coordinates weighted by Fisher information."""
    (size, q), m = new.w.shape, len(new.noise)
    scale, weight = np.sqrt(np.tile(new.noise, size // m))[:, None], np.sqrt(size / m / 2)
    points = [np.append(np.column_stack([p.w, p.means.T]) / scale, weight * np.log(p.noise)) for p in (old, new)]
    found = ahead.propose(*points)
    both = found[:-m].reshape(size, -1) * scale
    return Parameters(both[:, :q], np.ascontiguousarray(both[:, q:].T), np.exp(found[-m:] / weight))


def first_parameters(data: Observations, rank: int) -> Parameters:
    """Starting point: `rank` components of the zero-filled deviations of `data`, or of a subset if there are many."""
    subset = data.every(data.n // START) if data.n >= 2 * WARM else data
    some = subset.coefficients
    values, vectors = np.linalg.eigh(some @ some.T if len(some) < some.shape[1] else some.T @ some)
    values, vectors = values[: -rank - 1 : -1], vectors[:, : -rank - 1 : -1]
    if len(some) < some.shape[1]:
        vectors = some.T @ (vectors / np.sqrt(np.maximum(values, 1e-300)))
    w = vectors * np.sqrt(np.maximum(values, 0) / len(some))
    total = data.squares.sum()
    residual = np.clip(1 - values.sum() / total * data.n / len(some), 0.05, 1)
    return Parameters(
        w, np.zeros((len(data.sizes), len(w))), np.full(len(data.squares), residual * total / data.n_seen)
    )
