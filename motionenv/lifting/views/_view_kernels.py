"""Linear algebra of views: normal matrices from Gram blocks, and the solver for known views.

With rows r and u for the image axes and d for the viewing direction (`view_geometry.axes`), rᵀr + uᵀu = 1 - dᵀd, so the
normal matrix of a view is a sum of six blocks (`gram_blocks`) whose factors are trigonometric in α and ε. Matrices are
factorised as A = UᵀU with U stored by rows, so that every inner loop accesses contiguous memory.

Arrays are copied in loops (`copy`), because numba takes seconds to compile the checks of an assignment to a slice.
"""

import numpy as np

from motionenv._core.compilation import kernel, part

_FAST = {"reassoc", "nsz", "contract"}
fast_kernel, fast_part = kernel(fastmath=_FAST), part(fastmath=_FAST)

_SINGULAR = 1e-12  # a pivot below this fraction of its diagonal entry is rounding error


@fast_part
def factorise(a):
    """Factorise A = UᵀU in place, U in the upper triangle; False if A isn't positive definite."""
    n = len(a)
    for j in range(n):
        given = 0.0
        for i in range(j):
            given += a[i, j] * a[i, j]
        if not a[j, j] > _SINGULAR * (a[j, j] + given):
            return False
        scale = 1.0 / np.sqrt(a[j, j])
        for k in range(j, n):
            a[j, k] *= scale
        for i in range(j + 1, n):
            factor = a[j, i]
            for k in range(i, n):
                a[i, k] -= factor * a[j, k]
    return True


@fast_part
def solve_lower(u, b):
    """Solve Uᵀ x = b in place."""
    for j in range(len(b)):
        b[j] /= u[j, j]
        for k in range(j + 1, len(b)):
            b[k] -= u[j, k] * b[j]


@fast_part
def solve_upper(u, b):
    """Solve U x = b in place."""
    for j in range(len(b) - 1, -1, -1):
        total = b[j]
        for k in range(j + 1, len(b)):
            total -= u[j, k] * b[k]
        b[j] = total / u[j, j]


@fast_part
def solve_many(u, b):
    """Solve UᵀU x = b in place for all columns of b (N, n)."""
    for j in range(len(b)):
        _scale(1.0 / u[j, j], b[j])
        for k in range(j + 1, len(b)):
            subtract(u[j, k], b[j], b[k])
    for j in range(len(b) - 1, -1, -1):
        for k in range(j + 1, len(b)):
            subtract(u[j, k], b[k], b[j])
        _scale(1.0 / u[j, j], b[j])


@fast_part
def _scale(factor, b):
    for i in range(len(b)):
        b[i] *= factor


@fast_part
def subtract(factor, a, b):
    """Write b - factor · a into b."""
    for i in range(len(b)):
        b[i] -= factor * a[i]


@fast_part
def copy(a, b):
    """Write a into b."""
    for i in range(len(b)):
        b[i] = a[i]


@fast_part
def dot(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@fast_part
def normal_matrix(blocks, factors, a):
    """Write the upper triangle of a = Σ factors · blocks."""
    for i in range(len(a)):
        for j in range(i, len(a)):
            a[i, j] = 0.0
        for b in range(6):
            factor = factors[b]
            if factor == 0.0:  # two of them, for a level view
                continue
            for j in range(i, len(a)):
                a[i, j] += factor * blocks[b, i, j]


@fast_part
def factorise_components(full, precision, root):
    """Factorise the components' part (N, N) of a normal matrix (1 + N, 1 + N) plus `precision`: False if singular."""
    for i in range(len(root)):
        for j in range(i, len(root)):
            root[i, j] = full[i + 1, j + 1]
        root[i, i] += precision[i]
    return factorise(root)


@fast_part
def block_factors(d, factors):
    """Factors of the six blocks for viewing direction `d`."""
    for i in range(3):
        factors[i] = 1.0 - d[i] * d[i]
    factors[3], factors[4], factors[5] = -d[0] * d[1], -d[0] * d[2], -d[1] * d[2]


@fast_part
def combine(row, basis, out):
    """Write out (1 + N, 75) = Σ_i row_i basis_i: mean and components along one axis."""
    for n in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[n, i] = row[0] * basis[0, n, i] + row[1] * basis[1, n, i] + row[2] * basis[2, n, i]


@fast_kernel
def known_views(w2, order, starts, axes, basis, weights, blocks, precision, scores, depth):
    """Scores (eqs. 3.9, A.5) and missing dimension of sequences sorted by view; False if a normal matrix is singular.

    Args:
        w2, order: (n, 75, 2), 0 where missing, and its rows, group after group.
        starts, axes: (groups + 1,) start of each group in `order`, and (groups, 3, 3) axes of its view.
        basis, weights: (3, 1 + N, 75) and (75,), 0 where missing.
        blocks, precision: (6, 1 + N, 1 + N) and (N,).
        scores, depth: (n, N) and (n, 75), output.
    """
    n, p = basis.shape[1] - 1, basis.shape[2]
    normal, factors, full = np.empty((n, n)), np.empty(6), np.empty((n + 1, n + 1))
    shown, y = np.empty((3, n + 1, p)), np.empty((0, 0))
    for g in range(len(axes)):
        for c in range(3):
            combine(axes[g, c], basis, shown[c])
        block_factors(axes[g, 2], factors)
        normal_matrix(blocks, factors, full)
        if not factorise_components(full, precision, normal):
            return False
        rows = order[starts[g] : starts[g + 1]]
        if len(y) < len(rows):
            y = np.empty((len(rows), 2 * p))
        _differences(w2, rows, shown, y)
        right = np.dot(_weighted(shown, weights), y[: len(rows)].T)
        solve_many(normal, right)
        deep = np.dot(right.T, shown[2, 1:])
        for s in range(len(rows)):
            for i in range(n):
                scores[rows[s], i] = right[i, s]
            for i in range(p):
                depth[rows[s], i] = deep[s, i] + shown[2, 0, i]
    return True


@fast_part
def _differences(w2, rows, shown, y):
    """Write `rows` of w2 (n, 75, 2) minus the projected mean, shown[:, 0], into y (rows, 150)."""
    for s in range(len(rows)):
        for p in range(w2.shape[1]):
            y[s, 2 * p] = w2[rows[s], p, 0] - shown[0, 0, p]
            y[s, 2 * p + 1] = w2[rows[s], p, 1] - shown[1, 0, p]


@fast_part
def _weighted(shown, weights):
    """ÊᵀW (N, 150) of the projected components shown[:2, 1:] (2, N, 75)."""
    out = np.empty((shown.shape[1] - 1, 2 * shown.shape[2]))
    for i in range(len(out)):
        for p in range(shown.shape[2]):
            out[i, 2 * p] = weights[p] * shown[0, i + 1, p]
            out[i, 2 * p + 1] = weights[p] * shown[1, i + 1, p]
    return out


@fast_kernel
def fill(w2, seen, depth, scores, axes, basis, out):
    """Combine measured coordinates with the model's missing dimension and markers (eq. 3.16) in `out` (n, 75, 3).

    `w2` is (n, 75, 2), `seen` and `depth` (n, 75), `scores` (n, N), `axes` (n, 3, 3) and `basis` (3, 1 + N, 75).
    """
    for s in range(len(w2)):
        r, u, d = axes[s, 0], axes[s, 1], axes[s, 2]
        for p in range(w2.shape[1]):
            for i in range(3):
                if seen[s, p]:
                    out[s, p, i] = w2[s, p, 0] * r[i] + w2[s, p, 1] * u[i] + depth[s, p] * d[i]
                else:
                    out[s, p, i] = basis[i, 0, p]
                    for k in range(scores.shape[1]):
                        out[s, p, i] += scores[s, k] * basis[i, k + 1, p]
