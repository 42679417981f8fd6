r"""Global search for views: all local minima of the cost of eqs. 4.5 and 4.6, on a grid and refined by Newton's method.

Data terms are F_iᵀW y of mean and components F: coordinate i of the walker against axis y of the image. A phase φ
rotates each harmonic, which gives five terms for 1, sin φ, cos φ, sin 2φ, cos 2φ. With v = (1, k)

    J = ½ (τ² yᵀWy - 2 τ vᵀc(α, ε, φ) + vᵀH(α, ε) v + Σ k²/λ) - n log τ

where c is linear in products of sines and cosines of the three angles, and H is a sum of six blocks. For given angles,
the scores k and the scale 1/τ have closed forms. Angles are always in the order α, ε, φ.
"""

import numpy as np

from motionenv.lifting.views._view_kernels import (
    copy,
    dot,
    factorise,
    factorise_components,
    fast_kernel,
    fast_part,
    normal_matrix,
    solve_lower,
    solve_upper,
    subtract,
)

_ENOUGH = 1e-7  # [rad] convergence threshold; quadratic convergence makes the next step about its square
_STEPS = 100
_ROUNDING = 1e-13  # relative rounding error of the terms of the cost
_SAME = 1e-6  # [rad] minima closer than this are duplicates


@fast_kernel
def factor_views(alphas, elevations, blocks, precision, terms, root, inner, rest):
    """Factorise the normal matrices of a grid, elevation by elevation; False if one is singular.

    Args:
        alphas, elevations: the grid (A,), (E,).
        blocks, precision: (6, 1 + N, 1 + N) and (N,).
        terms: (E · A, 5), output: factors of the data terms.
        root, inner: (E · A, N, N) and (E · A, N), output: U with A = UᵀU, and U⁻ᵀ h, where h is the mean's row of H.
        rest: (E · A,), output: the mean's part that the components don't explain, H_00 - |inner|².
    """
    m = blocks.shape[1]
    full, f, g = np.empty((m, m)), np.empty((6, 6)), np.empty((6, 5))
    for v in range(len(rest)):
        view_terms(alphas[v % len(alphas)], elevations[v // len(alphas)], f, g)
        copy(g[0], terms[v])
        normal_matrix(blocks, f[0], full)
        if not factorise_components(full, precision, root[v]):
            return False
        copy(full[0, 1:], inner[v])
        solve_lower(root[v], inner[v])
        rest[v] = full[0, 0] - dot(inner[v], inner[v])
    return True


@fast_part
def _shown(terms, data, j, out):
    """Write the components' part of Σ terms · data[:, j] (5, 1 + N) into out (N,), and return the mean's."""
    first = 0.0
    for i in range(len(out)):
        out[i] = 0.0
    for a in range(5):
        if terms[a] == 0.0:  # two of them, for a level view
            continue
        first += terms[a] * data[a, j, 0]
        for i in range(len(out)):
            out[i] += terms[a] * data[a, j, i + 1]
    return first


@fast_part
def grid_costs(data, square, count, turns, terms, root, inner, rest, cost):
    """Write J (E, A, Φ) of one sequence with data terms (5, J, 1 + N) and yᵀWy `square` at phases `turns` (Φ, J)."""
    n, phases = inner.shape[1], data.shape[1]
    half = np.empty((phases, n))
    pair, linear = np.empty((phases, phases)), np.empty(phases)
    for v in range(len(rest)):
        for j in range(phases):
            linear[j] = _shown(terms[v], data, j, half[j])
            solve_lower(root[v], half[j])
            linear[j] -= dot(half[j], inner[v])
            for i in range(j + 1):
                pair[i, j] = pair[j, i] = dot(half[i], half[j])
        for f in range(len(turns)):
            p = square
            for i in range(phases):
                p -= turns[f, i] * dot(pair[i], turns[f])
            cost[v // cost.shape[1], v % cost.shape[1], f] = best_scale(p, dot(linear, turns[f]), rest[v], count)[1]


@fast_part
def grid_minima(cost, around, picks):
    """Write the indices of the lowest local minima of cost (E, A, Φ) into picks (K, 3); returns their number.

    Phase is circular; α is circular if `around` is True.
    """
    e, a, f = cost.shape
    found = np.int64(0)  # for a literal 0, `_insert` would be compiled a second time
    heights = np.empty(len(picks))
    for i in range(e):
        for j in range(a):
            for k in range(f):
                if _is_least(cost, around, i, j, k):
                    found = _insert(cost[i, j, k], i, j, k, heights, picks, found)
    return found


@fast_part
def _insert(height, i, j, k, heights, picks, found):
    """Insert a minimum into the sorted list of the `found` lowest; returns the new length."""
    room = len(picks)
    if found == room and heights[room - 1] <= height:
        return found
    place = min(found, room - 1)
    while place > 0 and heights[place - 1] > height:
        heights[place] = heights[place - 1]
        copy(picks[place - 1], picks[place])
        place -= 1
    heights[place], picks[place, 0], picks[place, 1], picks[place, 2] = height, i, j, k
    return min(found + 1, room)


@fast_part
def _is_least(cost, around, i, j, k):
    """Whether cost[i, j, k] is a local minimum; among equal neighbours only the first counts."""
    e, a, f = cost.shape
    for di in range(max(i - 1, 0), min(i + 2, e)):
        for dj in range(-1, 2):
            for dk in range(-1, 2):
                jj, kk = j + dj, (k + dk) % f
                if around:
                    jj %= a
                elif jj < 0 or jj >= a:
                    continue
                other = cost[di, jj, kk]
                before = (di * a + jj) * f + kk < (i * a + j) * f + k
                if other < cost[i, j, k] or (before and other == cost[i, j, k]):
                    return False
    return True


@fast_kernel
def search(
    grids, turns, low, high, reach, data, squares, count, blocks, precision, views, angles, tau, cost, variance, scores
):
    """Write the local minima of J of each sequence, lowest first; unused entries keep their values.

    Args:
        grids, turns: α, ε and φ of the grid, (A,), (E,), (Φ,), and (Φ, J) phase terms at φ.
        low, high, reach: (3,) bounds of α, ε, φ, equal where an angle is given, and largest step.
        data, squares: (n, 5, J, 1 + N) and (n,) yᵀWy.
        count: number of measured values of a sequence, or 0 if the scale is given.
        blocks, precision: (6, 1 + N, 1 + N) and (N,).
        views: output of `factor_views`: terms, root, inner, rest.
        angles, scores: (n, K, 3) and (n, K, N), output.
        tau, cost, variance: (n, K), output: 1 / scale, J, and variance of α.
    """
    alphas, elevations, phases = grids
    terms, root, inner, rest = views
    on_grid = np.empty((len(elevations), len(alphas), len(phases)))
    picks = np.empty((angles.shape[1], 3), np.int64)
    start, k = np.empty(3), np.empty(len(precision))
    around = np.isinf(low[0])
    for s in range(len(data)):
        grid_costs(data[s], squares[s], count, turns, terms, root, inner, rest, on_grid)
        kept = 0
        for pick in range(grid_minima(on_grid, around, picks)):
            e, a, f = picks[pick, 0], picks[pick, 1], picks[pick, 2]
            start[0], start[1], start[2] = (
                alphas[a] + reach[0] * _vertex(on_grid, e, a, f, around),
                elevations[e],
                phases[f],
            )
            found = polish(start, low, high, reach, data[s], squares[s], count, blocks, precision, k)
            for x in (0, 2):
                start[x] = np.pi - (np.pi - start[x]) % (2 * np.pi)
            place = kept
            for other in range(kept):
                if _distance(start, angles[s, other]) < _SAME:
                    place = -1
            if place < 0:
                continue
            while place > 0 and cost[s, place - 1] > found[0]:
                copy(angles[s, place - 1], angles[s, place])
                copy(scores[s, place - 1], scores[s, place])
                tau[s, place], cost[s, place] = tau[s, place - 1], cost[s, place - 1]
                variance[s, place] = variance[s, place - 1]
                place -= 1
            copy(start, angles[s, place])
            copy(k, scores[s, place])
            cost[s, place], tau[s, place], variance[s, place] = found
            kept += 1


@fast_part
def _vertex(cost, i, j, k, around):
    """Minimum of the parabola through cost[i, j - 1 : j + 2, k], in grid steps from j; 0 at a bound."""
    a = cost.shape[1]
    if not around and (j == 0 or j == a - 1):
        return 0.0
    before, after = cost[i, (j - 1) % a, k] - cost[i, j, k], cost[i, (j + 1) % a, k] - cost[i, j, k]
    return 0.5 * (before - after) / (before + after) if before + after > 0 else 0.0


@fast_part
def _distance(a, b):
    """Largest circular difference of two triples of angles."""
    largest = 0.0
    for x in range(3):
        largest = max(largest, abs((a[x] - b[x] + np.pi) % (2 * np.pi) - np.pi))
    return largest


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
