"""Global search for views: all local minima of the cost, found on a grid and refined by Newton's method."""

import numpy as np

from motionenv.lifting.views._cost_kernels import best_scale, view_terms
from motionenv.lifting.views._newton_kernels import polish
from motionenv.lifting.views._view_kernels import (
    copy,
    dot,
    factorise_components,
    fast_kernel,
    fast_part,
    normal_matrix,
    solve_lower,
)

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
