"""Compiled loop of the functional prior: many walkers, each at its own phase, one frame on."""

import math

import numpy as np
from numba import njit

from motionenv.estimation.tracking._gauss_kernel import gaussian
from motionenv.models.tree._random_kernels import restart

_jit = njit(nogil=True, cache=True, error_model="numpy")

#: Columns of `ways`: phase [cycles], log pace [cycles/s], heading [rad], x, y [m], forward and left flow [m/cycle].
PHASE, PACE, HEADING, X, Y, FORWARD, LEFT = range(7)


@_jit
def stirred(ways, scores, rest, key, noise, mean_pace, root, deviation, ways_out, scores_out, rest_out) -> None:
    """Write walkers with a step's noise to the arrays `_out`; `flowed` then says where that brings them.

    Walker i takes the random stream i of `key`.

    Args:
        ways: (n, 7).
        scores: (n, q), about the mean.
        rest: (n, 25).
        key: whole number from 0 to 2⁶⁴ - 1.
        noise: (11,) seconds that pass; what pace, scores and rest keep; deviations of pace, scores and rest that join,
            as shares of their stationary ones; deviations of phase, heading, forward and left place.
        mean_pace: to which log paces return.
        root: (q, q) Cholesky factor of the scores' covariance.
        deviation: (26,) stationary, of rest and of the log pace.
        ways_out, scores_out, rest_out: to write, as the first three; phase is where the walkers are afterwards.
    """
    n, q = scores.shape
    drawn = np.empty(q)
    state = np.empty(1, dtype=np.uint64)
    seconds, keep_pace, keep_scores, keep_rest = noise[0], noise[1], noise[2], noise[3]
    for i in range(n):
        restart(state, key, i)
        way, out = ways[i], ways_out[i]
        out[PACE] = mean_pace + keep_pace * (way[PACE] - mean_pace) + noise[4] * deviation[25] * gaussian(state)
        out[PHASE] = way[PHASE] + math.exp(out[PACE]) * seconds + noise[7] * gaussian(state)
        out[HEADING] = way[HEADING] + noise[8] * gaussian(state)
        c, s = math.cos(out[HEADING]), math.sin(out[HEADING])
        ahead, left = noise[9] * gaussian(state), noise[10] * gaussian(state)
        out[X] = way[X] + c * ahead - s * left
        out[Y] = way[Y] + s * ahead + c * left
        out[FORWARD], out[LEFT] = way[FORWARD], way[LEFT]
        for k in range(q):
            drawn[k] = gaussian(state)
        for k in range(q):
            total = 0.0
            for m in range(k + 1):
                total += root[k, m] * drawn[m]
            scores_out[i, k] = keep_scores * scores[i, k] + noise[5] * total
        for j in range(25):
            rest_out[i, j] = 0.0
            if deviation[j] > 0.0:
                rest_out[i, j] = keep_rest * rest[i, j] + noise[6] * deviation[j] * gaussian(state)


@_jit
def flowed(table, ways, before, scores, rest, moves, poses) -> None:
    """Write poses (n, 25), and move `ways` by the flow on the way from the phases `before`, half of it old, half new.

    Args:
        table: (phases, 1 + q, 25), mean first.
        ways: (n, 7), to change.
        before: (n, 7) ways one frame earlier.
        scores: (n, q), about the mean.
        rest: (n, 25) to add.
        moves: whether the flow moves the walkers.
        poses: (n, 25) to write.
    """
    for i in range(len(ways)):
        row, way = poses[i], ways[i]
        _channels(table, way[PHASE], scores[i], row)
        forward, left = row[0], row[1]
        if moves:
            turned = way[PHASE] - before[i, PHASE]
            ahead, aside = 0.5 * (forward + way[FORWARD]) * turned, 0.5 * (left + way[LEFT]) * turned
            c, s = math.cos(before[i, HEADING]), math.sin(before[i, HEADING])
            way[X] += c * ahead - s * aside
            way[Y] += s * ahead + c * aside
        way[FORWARD], way[LEFT] = forward, left
        for j in range(2, 25):
            row[j] += rest[i, j]
        row[0], row[1] = way[X], way[Y]
        row[5] += way[HEADING]


@_jit
def _channels(table, phase, scores, row) -> None:
    """Write mean + Σ_k scores_k · component_k to `row` (25,), linear between the table's phases."""
    phases, rows, width = table.shape
    at = (phase - math.floor(phase)) * phases
    first = int(at)
    u = at - first
    first = first if first < phases else 0
    second = first + 1 if first + 1 < phases else 0
    a, b = table[first], table[second]
    for j in range(width):
        row[j] = (1.0 - u) * a[0, j] + u * b[0, j]
    for k in range(1, rows):
        p, q = (1.0 - u) * scores[k - 1], u * scores[k - 1]
        for j in range(width):
            row[j] += p * a[k, j] + q * b[k, j]
