"""EM with gaps against the dense Gaussian, and against Tipping and Bishop's closed form without gaps."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from motionenv.models.fpca.em_fit import (
    Parameters,
    e_step,
    first_parameters,
    latent_means,
    log_likelihood,
    m_step,
    posterior_of,
    tables_of,
)
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.observations import Observations, functions
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


def test_posterior_and_likelihood_are_those_of_the_dense_gaussian():
    rng = np.random.default_rng(3)
    values = with_gaps(rng.standard_normal((5, 12, 3)), 0.3)[0]
    basis = sampled_basis(12, 3)
    w, mean, centre = rng.standard_normal((15, 2)), rng.standard_normal((1, 15)), rng.standard_normal((1, 5, 3))
    parameters = Parameters(w, mean, np.array([0.3, 0.5, 0.8]))
    data = Observations(values, basis, centre, np.zeros(5, int))
    (block,) = data.each(lambda block: block)
    found = posterior_of(block, tables_of(basis, parameters))
    z, covariance = found.z, found.covariance
    loglik = 0.5 * (found.twice - block.square @ (1 / parameters.noise))
    assert log_likelihood(data, parameters.noise, e_step(data, parameters)) == pytest.approx(loglik.sum())
    np.testing.assert_array_equal(latent_means(data, parameters), z)
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
