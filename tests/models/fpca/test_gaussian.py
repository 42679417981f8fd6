"""The normal distribution of cycles against dense normal distributions, and the residuals' model against its truth."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.gaussian import Gaussian, residual_model
from tests.models.fpca.made_cycles import with_gaps

K, P, M, Q = 8, 24, 3, 2


def dense(model: Gaussian) -> np.ndarray:
    """Covariance (P·m, P·m) of a cycle."""
    residual = np.zeros((P, M, P, M))
    for a in range(M):
        residual[:, a, :, a] = model.basis * model.spectrum[a] @ model.basis.T + model.white[a] * np.eye(P)
    flat = model.loadings.reshape(Q, -1)
    return flat.T @ flat + residual.reshape(P * M, -1)


@pytest.fixture(scope="module", params=[0, 3], ids=["white", "smooth"])
def case(request):
    """A distribution, and cycles in two groups: with gaps, without a channel or all samples, and complete."""
    rng = np.random.default_rng(request.param)
    basis = sampled_basis(P, request.param) if request.param else np.empty((P, 0))
    spectrum, white = np.exp(rng.standard_normal((M, basis.shape[1]))), np.exp(rng.standard_normal(M))
    model = Gaussian(rng.standard_normal((2, P, M)), rng.standard_normal((Q, P, M)), basis, spectrum, white)
    groups = np.arange(K) % 2
    values = with_gaps(model.means[groups] + rng.standard_normal((K, P, M)), 0.4)[0]
    values[1, :, 2], values[3], values[4, :20, 0] = np.nan, np.nan, np.nan
    values[5] = rng.standard_normal((P, M))
    return model, values, groups


def test_what_is_seen_tells_what_the_dense_normal_says(case):
    model, values, groups = case
    found, covariance, flat = model.infer(values, groups), dense(model), model.loadings.reshape(Q, -1)
    filled, width = model.fill(values, groups)
    np.testing.assert_array_equal(filled[np.isfinite(values)], values[np.isfinite(values)])
    for k, deviation in enumerate((values - model.means[groups]).reshape(K, -1)):
        seen = np.isfinite(deviation)
        inside = covariance[np.ix_(seen, seen)]
        log_p = multivariate_normal(np.zeros(seen.sum()), inside).logpdf(deviation[seen]) if seen.any() else 0.0
        assert found.log_p[k] == pytest.approx(log_p, abs=1e-9)
        gain = np.linalg.solve(inside, flat[:, seen].T).T
        np.testing.assert_allclose(found.z[k], gain @ deviation[seen], atol=1e-10)
        np.testing.assert_allclose(found.covariance[k], np.eye(Q) - gain @ flat[:, seen].T, atol=1e-10)
        across = np.linalg.solve(inside, covariance[np.ix_(seen, ~seen)]).T
        expected = model.means[groups[k]].ravel()[~seen] + across @ deviation[seen]
        left = covariance[np.ix_(~seen, ~seen)] - across @ covariance[np.ix_(seen, ~seen)]
        np.testing.assert_allclose(filled[k].ravel()[~seen], expected, atol=1e-10)
        np.testing.assert_allclose(width[k].ravel()[~seen], np.sqrt(np.diag(left)), atol=1e-10)


def test_expectations_of_residuals_are_those_of_the_dense_normal(case):
    """E[u²] and E[ε²], which the residuals' model is learned from."""
    model, values, groups = case
    found = model.infer(values, groups, learning=True)
    covariance, n = dense(model), model.basis.shape[1]
    smooth, rest = np.zeros((M, n)), np.zeros((M, 3))
    for deviation in (values - model.means[groups]).reshape(K, -1):
        seen = np.isfinite(deviation)
        inverse = np.linalg.pinv(covariance[np.ix_(seen, seen)])
        for a in range(M):
            own = seen.reshape(P, M)[:, a]
            if not own.any():
                continue
            across = np.zeros((n, P, M))
            across[:, :, a] = (model.basis * model.spectrum[a]).T
            across = across.reshape(n, P * M)[:, seen]
            gain = across @ inverse
            left = np.diag(model.spectrum[a]) - gain @ across.T
            smooth[a] += (gain @ deviation[seen]) ** 2 + np.diag(left)
            white = np.zeros((P, M))
            white[:, a] = model.white[a]
            gain = np.diag(white.ravel()[seen]) @ inverse
            left = np.diag(white.ravel()[seen]) - gain @ np.diag(white.ravel()[seen])
            rest[a] += ((gain @ deviation[seen]) ** 2).sum() + np.trace(left), own.sum(), 1
    np.testing.assert_allclose(found.smooth, smooth, atol=1e-8)
    np.testing.assert_allclose(found.rest, rest, atol=1e-8)


def test_simultaneous_widths_hold_all_missing_samples_of_a_cycle_as_often_as_asked(case):
    model, values, groups = case
    rng = np.random.default_rng(5)
    size = Q + model.spectrum.size + P * M
    pointwise = model.fill(values, groups)[1]
    width = model.fill(values, groups, rng.standard_normal((2000, size)), 0.9)[1]
    covariance = dense(model)
    for k in (0, 1, 4):
        seen = np.isfinite(values[k]).ravel()
        across = np.linalg.solve(covariance[np.ix_(seen, seen)], covariance[np.ix_(seen, ~seen)]).T
        left = covariance[np.ix_(~seen, ~seen)] - across @ covariance[np.ix_(seen, ~seen)]
        errors = rng.multivariate_normal(np.zeros(len(left)), left, 4000)
        inside = (np.abs(errors) <= width[k].ravel()[~seen]).all(axis=1).mean()
        assert inside == pytest.approx(0.9, abs=0.03)
        assert (width[k].ravel()[~seen] > 1.6 * pointwise[k].ravel()[~seen]).all()


def test_the_spectrum_of_residuals_is_recovered():
    rng = np.random.default_rng(6)
    basis = sampled_basis(64, 4)
    true = np.array([4.0, 2.0, 1.0, 0.5, 2.0, 1.0, 0.5])
    u = rng.standard_normal((800, 2, 7)) * np.sqrt(true)
    residuals = np.moveaxis(u @ basis.T, 1, 2) + 0.1 * rng.standard_normal((800, 64, 2))
    spectrum, white = residual_model(with_gaps(residuals)[0], basis, np.ones(2), 1e-8)
    np.testing.assert_allclose(spectrum, np.tile(true, (2, 1)), rtol=0.15)
    np.testing.assert_allclose(white, 0.01, rtol=0.05)
    drawn = Gaussian(np.zeros((1, 64, 2)), np.empty((0, 64, 2)), basis, spectrum, white).draw_residuals(4000, rng)
    expected = np.diag(basis * true @ basis.T) + 0.01
    np.testing.assert_allclose(drawn.var(axis=0), np.tile(expected[:, None], 2), rtol=0.2)


def test_noise_alone_has_no_spectrum_and_variances_stay_above_zero():
    residuals = np.random.default_rng(0).standard_normal((400, 32, 1))
    spectrum, white = residual_model(residuals, sampled_basis(32, 4), np.ones(1), 1e-9)
    assert ((spectrum > 0) & (spectrum < 0.2)).all()
    np.testing.assert_allclose(white, 1.0, rtol=0.05)
