"""Bounded Newton's method with exact derivatives for the angles of a view."""

import numpy as np

from motionenv.lifting.views._cost_kernels import evaluate
from motionenv.lifting.views._view_kernels import copy, factorise, fast_part, solve_lower, solve_upper

_ENOUGH = 1e-7  # [rad] convergence threshold; quadratic convergence makes the next step about its square
_STEPS = 100
_ROUNDING = 1e-13  # relative rounding error of the terms of the cost


@fast_part
def newton_step(gradient, hessian, free, damping, step):
    """Write the damped Newton step of the `free` (3,) angles, 0 for the others."""
    damped = np.empty((3, 3))
    largest = 0.0
    for x in range(3):
        if free[x]:
            largest = max(largest, abs(hessian[x, x]))
    while True:
        for x in range(3):
            step[x] = -gradient[x] if free[x] else 0.0
            for y in range(3):
                damped[x, y] = hessian[x, y] if free[x] and free[y] else 0.0
            damped[x, x] += damping if free[x] else 1.0
        if factorise(damped):
            solve_lower(damped, step)
            solve_upper(damped, step)
            return damping
        damping = max(10 * damping, 1e-3 * largest + 1e-300)


@fast_part
def polish(angles, low, high, reach, data, square, count, blocks, precision, scores):
    """Newton's method on `angles` (3,), in place, within `low` and `high`, with steps of at most `reach` (3,).

    Returns J, τ, and the variance of α from the curvature of J.
    """
    gradient, hessian, step, free = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3, np.bool_)
    new_gradient, new_hessian, new, new_scores = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(len(scores))
    cost, tau, size, damping = np.inf, 1.0, np.inf, 0.0
    copy(angles, new)
    for _ in range(1 + _STEPS):  # `evaluate` is called at one place, because each call is compiled anew
        new_cost, new_tau = evaluate(new, data, square, count, blocks, precision, new_scores, new_gradient, new_hessian)
        if new_cost <= cost + _ROUNDING * (abs(cost) + tau * tau * square):
            copy(new, angles)
            copy(new_scores, scores)
            copy(new_gradient, gradient)
            for x in range(3):
                copy(new_hessian[x], hessian[x])
            cost, tau = new_cost, new_tau
            if size < _ENOUGH and damping == 0.0:
                break
            damping = 0.1 * damping if damping > 1e-6 else 0.0
        else:
            damping = max(10 * damping, abs(hessian[0, 0]))
            if size < 1e-3 * _ENOUGH:
                break
        for x in range(3):
            outwards = (angles[x] <= low[x] and gradient[x] > 0) or (angles[x] >= high[x] and gradient[x] < 0)
            free[x] = low[x] < high[x] and not outwards
        damping = newton_step(gradient, hessian, free, damping, step)
        size = _move(angles, step, low, high, reach, new)
    return cost, tau, _first_variance(hessian, free)


@fast_part
def _move(angles, step, low, high, reach, new):
    """Write the angles after a step, shortened to `reach` (3,), within bounds; returns the largest change."""
    size, longest = 0.0, 1.0
    for x in range(3):
        longest = max(longest, abs(step[x]) / reach[x])
    for x in range(3):
        new[x] = min(max(angles[x] + step[x] / longest, low[x]), high[x])
        size = max(size, abs(new[x] - angles[x]))
    return size


@fast_part
def _first_variance(hessian, free):
    """First diagonal entry of the inverse Hessian of the `free` angles; NaN if it isn't positive."""
    unit, inverse = np.empty(3), np.empty(3)
    unit[0], unit[1], unit[2] = -1.0, 0.0, 0.0
    if not free[0]:
        return np.nan
    return inverse[0] if newton_step(unit, hessian, free, 0.0, inverse) == 0.0 else np.nan
