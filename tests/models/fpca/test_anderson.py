"""Anderson acceleration against the linear problems that it solves exactly (Walker & Ni 2011, theorem 2.2)."""

import numpy as np

from motionenv.models.fpca.anderson import Anderson


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
