"""Channels of many walkers, each at its own phase, from a table."""

import math

from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def channels_at(table, phase, scores, out) -> None:
    """Write mean + Σ_k scores_k · component_k at each phase, linear between the table's phases.

    Args:
        table: (phases, 1 + q, 25), mean first.
        phase: (n,) [cycles], any real number.
        scores: (n, q), about the mean.
        out: (n, 25) to write.
    """
    phases, rows, width = table.shape
    for i in range(len(phase)):
        at = (phase[i] - math.floor(phase[i])) * phases
        first = int(at)
        u = at - first
        first = first if first < phases else 0
        second = first + 1 if first + 1 < phases else 0
        a, b, row = table[first], table[second], out[i]
        for j in range(width):
            row[j] = (1.0 - u) * a[0, j] + u * b[0, j]
        for k in range(1, rows):
            p, q = (1.0 - u) * scores[i, k - 1], u * scores[i, k - 1]
            for j in range(width):
                row[j] += p * a[k, j] + q * b[k, j]
