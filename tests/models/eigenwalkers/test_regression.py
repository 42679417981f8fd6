"""Shrunk regression against leaving each person out by hand."""

import numpy as np
import pytest

from motionenv.models.eigenwalkers.regression import shrunk_regression


def ridge(z, y, penalty) -> tuple[float, np.ndarray]:
    """Intercept and weights, the intercept unpenalised, by the normal equations."""
    a = np.column_stack([np.ones(len(y)), z])
    found = np.linalg.solve(a.T @ a + penalty * np.diag([0.0, *np.ones(z.shape[1])]), a.T @ y)
    return found[0], found[1:]


def left_out(z, y, penalty) -> float:
    """Root mean square error of predicting each from the others."""
    errors = []
    for i in range(len(y)):
        others = np.arange(len(y)) != i
        mean, weights = ridge(z[others], y[others], penalty)
        errors.append(y[i] - mean - z[i] @ weights)
    return float(np.sqrt(np.mean(np.square(errors))))


def test_the_deviation_is_that_of_leaving_each_out_and_no_penalty_has_a_smaller_one():
    rng = np.random.default_rng(0)
    z = rng.standard_normal((20, 3))
    y = 0.7 + z @ [0.5, -0.2, 0.0] + 0.3 * rng.standard_normal(20)
    mean, weights, deviation = shrunk_regression(z, y)
    errors = {penalty: left_out(z, y, penalty) for penalty in np.geomspace(0.02, 2e4, 200)}
    best = min(errors, key=errors.get)
    assert deviation == pytest.approx(errors[best], rel=1e-3)
    expected = ridge(z, y, best)
    assert mean == pytest.approx(expected[0], abs=0.01)
    np.testing.assert_allclose(weights, expected[1], atol=0.01)


def test_what_follows_exactly_is_found_exactly():
    z = np.random.default_rng(1).standard_normal((30, 2))
    mean, weights, deviation = shrunk_regression(z, 2.0 + z @ [3.0, -1.0])
    np.testing.assert_allclose([mean, *weights], [2.0, 3.0, -1.0], rtol=5e-3)
    assert deviation < 0.02


def test_frequencies_that_nothing_can_be_learned_of_do_not_hang_on_rounding():
    """With R - 1 components every penalty predicts left-out people as well; then the pace doesn't follow the scores."""
    rng = np.random.default_rng(1)
    z = np.linalg.qr(np.column_stack([np.ones(8), rng.standard_normal((8, 7))]))[0][:, 1:] * np.sqrt(7)
    y = rng.standard_normal(8)
    for turned in (z, z @ np.linalg.qr(rng.standard_normal((7, 7)))[0]):
        mean, weights, _ = shrunk_regression(turned, y)
        assert np.abs(weights).max() < 1e-2
        assert mean == pytest.approx(y.mean())
