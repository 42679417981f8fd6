r"""The cost of eqs. 4.5 and 4.6 and its derivatives by the view, with scores and scale eliminated.

Data terms are F_iᵀW y of mean and components F: coordinate i of the walker against axis y of the image. A phase φ
rotates each harmonic, which gives five terms for 1, sin φ, cos φ, sin 2φ, cos 2φ. With v = (1, k)

    J = ½ (τ² yᵀWy - 2 τ vᵀc(α, ε, φ) + vᵀH(α, ε) v + Σ k²/λ) - n log τ

where c is linear in products of sines and cosines of the three angles, and H is a sum of six blocks. For given angles,
k and τ have closed forms. Angles are always in the order α, ε, φ.
"""

import numpy as np

from motionenv.lifting.views._view_kernels import (
    copy,
    dot,
    factorise_components,
    fast_part,
    normal_matrix,
    solve_lower,
    solve_upper,
    subtract,
)

_ENOUGH = 1e-12  # [rad] convergence threshold of a step
_STEPS = 100
_ROUNDING = 1e-13  # relative rounding error of the terms of the cost


@fast_part
def _product(a0, a1, a2, e0, e1, e2, out):
    """Write value and derivatives by α, ε, αα, αε, εε of a product a(α) e(ε), given those of a and e, into out (6,)."""
    out[0], out[1], out[2], out[3], out[4], out[5] = a0 * e0, a1 * e0, a0 * e1, a2 * e0, a1 * e1, a0 * e2


@fast_part
def view_terms(alpha, elevation, f, g):
    """Write the factors of the six blocks f (6, 6) and of the five data terms g (6, 5), a row per derivative."""
    factors, terms = f.T, g.T
    ca, sa, ce, se = np.cos(alpha), np.sin(alpha), np.cos(elevation), np.sin(elevation)
    c2a, s2a, c2e, s2e = np.cos(2 * alpha), np.sin(2 * alpha), np.cos(2 * elevation), np.sin(2 * elevation)
    _product(-sa * sa, -s2a, -2 * c2a, ce * ce, -s2e, -2 * c2e, factors[0])
    _product(-ca * ca, s2a, 2 * c2a, ce * ce, -s2e, -2 * c2e, factors[1])
    f[0, 0] += 1.0
    f[0, 1] += 1.0
    _product(1.0, 0.0, 0.0, ce * ce, -s2e, -2 * c2e, factors[2])
    _product(s2a / 2, c2a, -2 * s2a, ce * ce, -s2e, -2 * c2e, factors[3])
    _product(-sa, -ca, sa, s2e / 2, c2e, -2 * s2e, factors[4])
    _product(ca, -sa, -ca, s2e / 2, c2e, -2 * s2e, factors[5])
    _product(ca, -sa, -ca, 1.0, 0.0, 0.0, terms[0])  # across: x, y
    _product(sa, ca, -sa, 1.0, 0.0, 0.0, terms[1])
    _product(-sa, -ca, sa, se, ce, -se, terms[2])  # upwards: x, y, z
    _product(ca, -sa, -ca, se, ce, -se, terms[3])
    _product(1.0, 0.0, 0.0, ce, -se, -ce, terms[4])


@fast_part
def phase_terms(phase, t):
    """Write 1, sin φ, cos φ, sin 2φ, cos 2φ and their first two derivatives into t (3, 5); or 1, 0, 0 into t (3, 1)."""
    t[0, 0], t[1, 0], t[2, 0] = 1.0, 0.0, 0.0
    for h in range(1, 1 + t.shape[1] // 2):
        c, s = np.cos(h * phase), np.sin(h * phase)
        t[0, 2 * h - 1], t[0, 2 * h] = s, c
        t[1, 2 * h - 1], t[1, 2 * h] = h * c, -h * s
        t[2, 2 * h - 1], t[2, 2 * h] = -h * h * s, -h * h * c


@fast_part
def best_scale(p, q, r, count):
    """τ and J = ½ (τ² p - 2 τ q + r) - count · log τ at its minimum; τ = 1 if count is 0."""
    if count == 0:
        return 1.0, 0.5 * (p - 2 * q + r)
    tau = (q + np.sqrt(q * q + 4 * p * count)) / (2 * p)
    return tau, 0.5 * (tau * tau * p - 2 * tau * q + r) - count * np.log(tau)


@fast_part
def evaluate(angles, data, square, count, blocks, precision, scores, gradient, hessian):
    """J and τ at `angles` (3,), scores and scale eliminated; writes scores (N,) and the derivatives by the angles."""
    n, phases = len(scores), data.shape[1]
    f, g, t = np.empty((6, 6)), np.empty((6, 5)), np.empty((3, phases))
    view_terms(angles[0], angles[1], f, g)
    phase_terms(angles[2], t)
    full, root = np.empty((n + 1, n + 1)), np.empty((n, n))
    normal_matrix(blocks, f[0], full)
    factorise_components(full, precision, root)
    c = _data_terms(data, g, t)
    half, inner = np.empty(n), np.empty(n)
    copy(c[0, 1:], half)
    copy(full[0, 1:], inner)
    solve_lower(root, half)
    solve_lower(root, inner)
    p, rest = square - dot(half, half), full[0, 0] - dot(inner, inner)
    tau, cost = best_scale(p, c[0, 0] - dot(half, inner), rest, count)
    for i in range(n):
        scores[i] = tau * half[i] - inner[i]
    solve_upper(root, scores)
    _derivatives(c, f, blocks, root, scores, half, tau, p + count / (tau * tau), count > 0, gradient, hessian)
    return cost, tau


@fast_part
def _data_terms(data, g, t):
    """Data terms c and their derivatives by α, ε, φ, αα, αε, εε, αφ, εφ, φφ: (10, 1 + N)."""
    turned, c = np.zeros((3, 5, data.shape[2])), np.zeros((10, data.shape[2]))
    for d in range(min(3, 2 * data.shape[1] - 1)):  # a given phase has no derivatives
        for a in range(5):
            for j in range(data.shape[1]):
                for i in range(data.shape[2]):
                    turned[d, a, i] += t[d, j] * data[a, j, i]
    for row, view, phase in ((0, 0, 0), (1, 1, 0), (2, 2, 0), (3, 0, 1), (4, 3, 0), (5, 4, 0), (6, 5, 0), (7, 1, 1),
                             (8, 2, 1), (9, 0, 2)):  # fmt: skip
        for a in range(5):
            for i in range(data.shape[2]):
                c[row, i] += g[view, a] * turned[phase, a, i]
    return c


@fast_part
def _through_blocks(blocks, v):
    """Each block times v (6, 1 + N), and vᵀ times that (6,)."""
    shaped, square = np.zeros((6, len(v))), np.empty(6)
    for b in range(6):
        for i in range(len(v)):
            for j in range(len(v)):
                shaped[b, j] += blocks[b, i, j] * v[i]
        square[b] = dot(shaped[b], v)
    return shaped, square


@fast_part
def _derivatives(c, f, blocks, root, scores, half, tau, curvature, scaled, gradient, hessian):
    """Gradient (3,) and Hessian (3, 3) of J with scores and scale eliminated (Schur complement)."""
    n = len(scores)
    v = np.empty(n + 1)
    v[0] = 1.0
    copy(scores, v[1:])
    shaped, square = _through_blocks(blocks, v)
    mixed, by_scale = np.zeros((3, n)), np.empty(3)
    for x in range(3):
        by_scale[x] = -dot(v, c[1 + x])
        gradient[x] = tau * by_scale[x]
        subtract(tau, c[1 + x, 1:], mixed[x])
        if x < 2:
            gradient[x] += 0.5 * dot(f[1 + x], square)
            for b in range(6):
                subtract(-f[1 + x, b], shaped[b, 1:], mixed[x])
        solve_lower(root, mixed[x])
        by_scale[x] += dot(half, mixed[x])
    for x, y, row in ((0, 0, 4), (0, 1, 5), (1, 1, 6), (0, 2, 7), (1, 2, 8), (2, 2, 9)):
        value = -tau * dot(v, c[row]) - dot(mixed[x], mixed[y])
        if row < 7:
            value += 0.5 * dot(f[row - 1], square)
        if scaled:
            value -= by_scale[x] * by_scale[y] / curvature
        hessian[x, y] = hessian[y, x] = value
