"""Linear algebra of the search for views: normal matrices from Gram blocks, and triangular systems.

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
