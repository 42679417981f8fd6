"""Variance components against dense normal distributions, and a closed form."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from benchmarks.models.variance_components import Evidence, effects, fit_covariances

PEOPLE, Q = np.array([0, 0, 0, 1, 1, 2, 2]), 3  # of trials
TRIALS = np.array([0, 0, 1, 2, 2, 2, 3, 4, 5, 6, 6])  # of strides


def random_covariance(rng, scale: float) -> np.ndarray:
    root = rng.standard_normal((Q, Q))
    return scale * (root @ root.T / Q + 0.1 * np.eye(Q))


@pytest.fixture
def problem():
    """Strides seen through matrices of their own, some of fewer than q samples, one of none, with white noise."""
    rng = np.random.default_rng(3)
    loadings = [rng.standard_normal((n, Q)) for n in (5, 2, 4, 1, 0, 6, 3, 3, 4, 2, 5)]
    values = [rng.standard_normal(len(a)) for a in loadings]
    evidence = Evidence(
        np.stack([a.T @ a for a in loadings]),
        np.stack([a.T @ x for a, x in zip(loadings, values, strict=True)]),
        np.array([-0.5 * x @ x - 0.5 * len(x) * np.log(2 * np.pi) for x in values]),
    )
    covariances = np.stack([random_covariance(rng, scale) for scale in (1.0, 0.3, 0.5)])
    return loadings, np.concatenate(values), evidence, covariances


def dense(loadings, covariances):
    """The samples' covariance (n, n), and that of all effects with samples, by level."""
    members = (PEOPLE[TRIALS], TRIALS, np.arange(len(TRIALS)))
    design = np.zeros((sum(map(len, loadings)), len(loadings) * Q))
    row = 0
    for k, a in enumerate(loadings):
        design[row : row + len(a), k * Q : (k + 1) * Q] = a
        row += len(a)
    cross = []
    for which, covariance in zip(members, covariances, strict=True):
        indicator = np.eye(which.max() + 1)[which]
        cross.append(np.kron(indicator.T, covariance) @ design.T)
    total = sum(np.kron(np.equal.outer(w, w), c) for w, c in zip(members, covariances, strict=True))
    return design @ total @ design.T + np.eye(len(design)), cross, design


def test_likelihood_and_posterior_are_those_of_the_dense_normal(problem):
    loadings, values, evidence, covariances = problem
    shift = np.array([0.3, -0.2, 0.5])
    found = effects(evidence, (PEOPLE, TRIALS), covariances, shift)
    total, cross, design = dense(loadings, covariances)
    mean = design @ np.tile(shift, len(loadings))
    assert found.log_p == pytest.approx(multivariate_normal(mean, total).logpdf(values))
    for level, own in enumerate(cross):
        expected = own @ np.linalg.solve(total, values - mean)
        np.testing.assert_allclose(found.means[level].ravel(), expected, atol=1e-10)
        whole = np.kron(np.eye(len(own) // Q), covariances[level]) - own @ np.linalg.solve(total, own.T)
        for i, covariance in enumerate(found.covariances[level]):
            part = slice(i * Q, (i + 1) * Q)
            np.testing.assert_allclose(covariance, whole[part, part], atol=1e-10)


def test_the_mean_is_generalised_least_squares(problem):
    loadings, values, evidence, covariances = problem
    total, _, design = dense(loadings, covariances)
    columns = design @ np.tile(np.eye(Q), (len(loadings), 1))
    weighted = np.linalg.solve(total, columns)
    expected = np.linalg.solve(columns.T @ weighted, weighted.T @ values)
    np.testing.assert_allclose(effects(evidence, (PEOPLE, TRIALS), covariances).shift, expected, atol=1e-10)


def balanced(people: int, strides: int, rng) -> tuple[Evidence, np.ndarray, np.ndarray]:
    """Latents seen nearly exactly: evidence, people of strides, and latents (people, strides, q)."""
    between, within = np.diag([4.0, 1.0, 0.2]), np.diag([0.5, 1.0, 0.1])
    person = rng.multivariate_normal(np.zeros(Q), between, size=(people, 1))
    latents = person + rng.multivariate_normal(np.zeros(Q), within, size=(people, strides))
    flat, precision = latents.reshape(-1, Q), 1e8
    information = np.broadcast_to(precision * np.eye(Q), (len(flat), Q, Q))
    constant = -0.5 * precision * (flat**2).sum(axis=1) + 0.5 * Q * np.log(precision / (2 * np.pi))
    return Evidence(information, precision * flat, constant), np.repeat(np.arange(people), strides), latents


def test_balanced_data_give_the_analysis_of_variance():
    people, strides = 40, 6
    evidence, who, latents = balanced(people, strides, np.random.default_rng(5))
    found = fit_covariances(evidence, (who,), 0.0, 1e-9, 5000)
    assert found.converged
    rest = latents - latents.mean(axis=1, keepdims=True)
    within = np.einsum("ksi,ksj->ij", rest, rest) / (people * (strides - 1))
    means = latents.mean(axis=1) - latents.mean(axis=(0, 1))
    between = means.T @ means / people - within / strides
    np.testing.assert_allclose(found.covariances[1], within, rtol=1e-2, atol=1e-3)
    np.testing.assert_allclose(found.covariances[0], between, rtol=1e-2, atol=2e-2)
    np.testing.assert_allclose(found.shift, latents.mean(axis=(0, 1)), atol=1e-5)


def test_shrinkage_takes_correlations_of_few_people_only():
    evidence, who, _ = balanced(12, 30, np.random.default_rng(6))
    raw, shrunk, diagonal = (fit_covariances(evidence, (who,), s, 1e-9, 5000).covariances for s in (0.0, 12.0, np.inf))
    for matrix in diagonal:
        np.testing.assert_allclose(matrix, np.diag(np.diag(matrix)), atol=1e-9)
    before, after = (np.abs(m / np.sqrt(np.outer(np.diag(m), np.diag(m)))) for m in (raw[0], shrunk[0]))
    off = ~np.eye(Q, dtype=bool)
    assert (after[off] < 0.8 * before[off]).all()
    np.testing.assert_allclose(shrunk[1], raw[1], atol=0.05)
