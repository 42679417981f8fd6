"""The splines against appendix A taken literally: truncated powers, and the null space of its constraints by SVD."""

import numpy as np
import pytest

from motionenv.cycles import periodic_basis, spline_basis
from motionenv.cycles.splines import outer_products, solve
from motionenv.errors import MotionError

X = np.linspace(0, 1, 501)
KNOTS = np.arange(1, 10) / 10


def truncated_powers(x, derivative=0):
    """φ₀ ... φ₁₂ of appendix A, or a derivative of them, (n, 13)."""
    x = np.asarray(x, dtype=float)[:, None]
    falling = np.prod(3 - np.arange(derivative))
    powers = [np.polynomial.Polynomial(np.eye(4)[k]).deriv(derivative)(x) if derivative else x**k for k in range(4)]
    return np.hstack([*powers, falling * np.maximum(x - KNOTS, 0) ** (3 - derivative)])


def appendix_a(x):
    """Φ(x)ᵀU₂, (n, 10), with φ₀ among the functions."""
    constraints = np.vstack([truncated_powers([0], d) - truncated_powers([1], d) for d in range(3)])
    return truncated_powers(x) @ np.linalg.svd(constraints.T)[0][:, 3:]


def same_space(a, b):
    assert np.linalg.matrix_rank(a) == np.linalg.matrix_rank(b) == a.shape[1] == b.shape[1]
    for one, other in ((a, b), (b, a)):
        np.testing.assert_allclose(one @ np.linalg.lstsq(one, other)[0], other, atol=1e-10)


def test_unconstrained_space_is_appendix_a():
    assert spline_basis(X).shape == (501, 13)
    same_space(spline_basis(X), truncated_powers(X))
    assert np.linalg.cond(spline_basis(X)) < 20 < 1e4 < np.linalg.cond(truncated_powers(X))


def test_periodic_space_is_appendix_a():
    assert periodic_basis(X).shape == (501, 10)
    same_space(periodic_basis(X), appendix_a(X))


def test_periodic_in_value_and_two_derivatives():
    h = 1e-3
    for x in (0.0, 0.5):
        np.testing.assert_allclose(periodic_basis([x]), periodic_basis([x + 1]), atol=1e-12)
    near = periodic_basis([-2 * h, -h, 0, h, 2 * h])
    left, right = near[:3], near[2:]
    np.testing.assert_allclose(np.diff(left, axis=0)[-1], np.diff(right, axis=0)[0], atol=20 * 100 * h**2)
    np.testing.assert_allclose(np.diff(left, 2, axis=0), np.diff(right, 2, axis=0), atol=6e3 * h**3)


def test_functions_sum_to_one():
    np.testing.assert_allclose(spline_basis(X).sum(axis=1), 1)
    np.testing.assert_allclose(periodic_basis(X * 3 - 1).sum(axis=1), 1)


def test_normal_equations_leave_gaps_out():
    rng = np.random.default_rng(0)
    basis, z = periodic_basis(rng.random(200)), rng.normal(size=(200, 5))
    z[rng.random(z.shape) < 0.3] = np.nan
    seen = ~np.isnan(z)
    gram = (seen.T.astype(float) @ outer_products(basis)).reshape(5, 10, 10)
    got = solve(gram, np.where(seen, z, 0.0).T @ basis)
    for a in range(5):
        own = seen[:, a]
        np.testing.assert_allclose(got[:, a], np.linalg.lstsq(basis[own], z[own, a])[0], atol=1e-10)


@pytest.mark.parametrize("x", [[-0.01], [1.01], [np.nan]])
def test_phases_outside_are_refused(x):
    with pytest.raises(MotionError, match="from 0 to 1"):
        spline_basis(x)
