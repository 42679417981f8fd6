"""Fits of components, with and without gaps, against dense linear algebra; Anderson acceleration of them."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from motionenv.models.fpca.em_fit import (
    Anderson,
    Parameters,
    e_step,
    first_parameters,
    log_likelihood,
    m_step,
    posterior_of,
)
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.observations import Observations, functions, group_centres
from motionenv.models.fpca.svd_fit import fit_svd
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


def test_posterior_and_likelihood_are_those_of_the_dense_gaussian():
    rng = np.random.default_rng(3)
    values = with_gaps(rng.standard_normal((5, 12, 3)), 0.3)[0]
    basis = sampled_basis(12, 3)
    w, mean, centre = rng.standard_normal((15, 2)), rng.standard_normal((1, 15)), rng.standard_normal((1, 5, 3))
    parameters = Parameters(w, mean, np.array([0.3, 0.5, 0.8]))
    data = Observations(values, basis, centre, np.zeros(5, int))
    found = posterior_of(data, parameters)
    z, covariance = found.z, found.covariance
    loglik = 0.5 * (found.twice - data.square @ (1 / parameters.noise))
    assert log_likelihood(data, parameters.noise, e_step(data, parameters)) == pytest.approx(loglik.sum())
    loading = functions(w, basis, 3).reshape(-1, 2)
    level, noise = (functions(mean.T, basis, 3)[..., 0] + basis @ centre[0]).ravel(), np.tile(parameters.noise, 12)
    for k, y in enumerate(values.reshape(5, -1)):
        o = np.isfinite(y)
        full = loading[o] @ loading[o].T + np.diag(noise[o])
        gain = loading[o].T @ np.linalg.inv(full)
        np.testing.assert_allclose(z[k], gain @ (y - level)[o])
        np.testing.assert_allclose(covariance[k], np.eye(2) - gain @ loading[o], atol=1e-12)
        np.testing.assert_allclose(loglik[k], multivariate_normal(level[o], full).logpdf(y[o]))


def test_without_gaps_maximum_likelihood_is_the_closed_form():
    """Tipping & Bishop (1999), eq. 7 and 8, where the basis leaves nothing out; noise is made the same by symmetry."""
    values = np.random.default_rng(0).standard_normal((40, 9, 1)) * np.linspace(1, 4, 9)[:, None]
    model = FunctionalPCA(2, n_harmonics=5, residual_harmonics=0, tol=1e-12, max_iter=5000).fit(as_cycles(values))
    eigenvalues = np.linalg.eigvalsh(np.cov(values[..., 0].T, bias=True))[::-1]
    noise = eigenvalues[2:].mean()
    np.testing.assert_allclose(model.noise_variance_, noise, rtol=1e-3)
    np.testing.assert_allclose(model.explained_variance_, eigenvalues[:2] - noise, rtol=1e-3)


def test_a_large_fit_that_starts_from_a_part_ends_where_others_do():
    values = with_gaps(low_rank(1100, 32, 2, noise=0.3)[0])[0]
    large = FunctionalPCA(3, n_harmonics=8, tol=1e-9).fit(as_cycles(values))
    part = FunctionalPCA(3, n_harmonics=8, tol=1e-9).fit(as_cycles(values[:999]))
    overlap = np.linalg.svd(large.components_.reshape(3, -1) @ part.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 0.999
    assert len(large.errors_) < len(part.errors_)


def test_every_step_raises_the_likelihood_of_what_is_seen():
    """Without extrapolation, with groups and gaps: the law of EM that the fit builds on."""
    values = with_gaps(low_rank(40, 32, 3, 2, noise=0.3)[0], 0.4)[0]
    groups = np.arange(40) % 2
    data = Observations(values, sampled_basis(32, 6), np.zeros((2, 11, 3)), groups)
    parameters, likelihoods = first_parameters(data, 2), []
    for _ in range(12):
        found = e_step(data, parameters)
        likelihoods.append(log_likelihood(data, parameters.noise, found))
        parameters = m_step(data, found, parameters)
    assert (np.diff(likelihoods) > 0).all()
    assert likelihoods[-1] - likelihoods[0] > 100


def test_without_gaps_fig_8_is_the_svd_of_the_smoothed_cycles():
    values = np.random.default_rng(0).standard_normal((12, 48, 3))
    model = FunctionalPCA(4, n_harmonics=6, method="svd").fit(as_cycles(values))
    spectrum = np.fft.rfft(values - values.mean(axis=0), axis=1)
    spectrum[:, 6:] = 0
    smooth = np.fft.irfft(spectrum, 48, axis=1).reshape(12, -1)
    _, s, vt = np.linalg.svd(smooth)
    np.testing.assert_allclose(model.singular_values_, s[:4])
    np.testing.assert_allclose(np.abs(np.sum(model.components_.reshape(4, -1) * vt[:4], axis=1)), 1)


def test_fig_8_ends_where_its_literal_steps_end(gappy):
    """Impute, project, truncate the SVD, repeat (real basis): the same error and components, in fewer iterations."""
    values = gappy[2]
    seen, basis = np.isfinite(values), sampled_basis(64, 10)
    x2 = np.where(seen, values - basis @ (basis.T @ np.nanmean(values, axis=0)), 0.0)
    errors = [np.inf]
    while len(errors) < 3 or errors[-2] - errors[-1] > 1e-9 * errors[-1]:
        u, s, vt = np.linalg.svd((basis.T @ x2).reshape(60, -1), full_matrices=False)
        x5 = basis @ ((u[:, :3] * s[:3]) @ vt[:3]).reshape(60, -1, 4)
        errors.append(np.linalg.norm(x2 - x5))
        x2 = np.where(seen, x2, x5)
    model = FunctionalPCA(3, n_harmonics=10, method="svd", tol=1e-9).fit(as_cycles(values))
    assert model.errors_[-1] <= errors[-1] * (1 + 1e-6)
    assert len(model.errors_) < len(errors)
    np.testing.assert_allclose(model.singular_values_, s[:3], rtol=1e-4)
    components = (basis @ vt[:3].reshape(3, -1, 4)).reshape(3, -1)
    np.testing.assert_allclose(np.abs(np.sum(model.components_.reshape(3, -1) * components, axis=1)), 1, rtol=1e-6)


def test_a_large_fig_8_starts_from_more_components_and_ends_where_small_steps_end():
    values = with_gaps(low_rank(1100, 32, 4, noise=0.3)[0])[0]
    large = FunctionalPCA(3, n_harmonics=8, method="svd").fit(as_cycles(values))
    exact = FunctionalPCA(3, n_harmonics=8, method="svd", tol=1e-12).fit(as_cycles(values))
    assert large.errors_[-1] <= exact.errors_[-1] * (1 + 1e-6)
    assert np.diff(large.errors_).max() <= 0
    overlap = np.linalg.svd(large.components_.reshape(3, -1) @ exact.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 1 - 1e-5


def test_errors_and_noise_are_those_of_the_samples_that_are_seen():
    """Against least-squares scores of each cycle, given the components that were found."""
    values, basis = with_gaps(low_rank(30, 32, 2, 2, noise=0.2)[0])[0], sampled_basis(32, 6)
    groups = np.zeros(30, dtype=int)
    data = Observations(values, basis, group_centres(values, groups, basis), groups)
    found = fit_svd(data, 2, 1e-12, 2000)
    curves = (basis @ found.components).reshape(2, -1)
    rest = (values - basis @ found.means[0]).reshape(30, -1)
    for row in rest:
        seen = np.isfinite(row)
        row[seen] -= curves[:, seen].T @ np.linalg.lstsq(curves[:, seen].T, row[seen], rcond=None)[0]
    np.testing.assert_allclose(found.errors[-1], np.sqrt(np.nansum(rest**2)), rtol=1e-5)
    np.testing.assert_allclose(found.noise, np.nanmean(rest.reshape(30, 32, 2) ** 2, axis=(0, 1)), rtol=1e-3)
    assert found.variance[0] > found.variance[1] > 0
    assert found.converged


def linear(n, seed=0):
    """A contraction x ← A x + b of n unknowns, and its fixed point."""
    rng = np.random.default_rng(seed)
    q = np.linalg.qr(rng.standard_normal((n, n)))[0]
    a, b = q @ np.diag(np.linspace(0.5, 0.95, n)) @ q.T, rng.standard_normal(n)
    return (lambda x: a @ x + b), np.linalg.solve(np.eye(n) - a, b)


def test_a_linear_problem_is_solved_in_as_many_steps_as_it_has_unknowns():
    step, solution = linear(3)
    ahead, x, errors = Anderson(), np.zeros(3), []
    for _ in range(4):
        x = ahead.propose(x, step(x))
        errors.append(np.abs(x - solution).max())
    assert errors[-1] < 1e-4
    assert errors[-2] > 1e-2


def test_larger_problems_take_far_fewer_steps_than_plain_iteration():
    step, solution = linear(40)
    ahead, x, plain = Anderson(), np.zeros((8, 5)), np.zeros(40)
    for _ in range(60):
        x = ahead.propose(x, step(x.ravel()).reshape(8, 5))
        plain = step(plain)
    assert np.abs(x.ravel() - solution).max() < 1e-3 * np.abs(plain - solution).max()


def test_nothing_is_extrapolated_from_a_single_step_or_after_forgetting():
    step, _ = linear(4)
    ahead, x = Anderson(), np.ones(4)
    first = ahead.propose(x, step(x))
    np.testing.assert_array_equal(first, step(x))
    assert not np.allclose(ahead.propose(first, step(first)), step(first))
    ahead.forget()
    np.testing.assert_array_equal(ahead.propose(first, step(first)), step(first))
