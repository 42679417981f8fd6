"""Compiled loops of the functional prior: many walkers, each with its own phase, one frame forward."""

import math

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.random import gaussian, restart, uniform
from motionenv.models.paths.bending import AHEAD, GRAVITY, HEAD_MOST

#: Columns of a gait array: phase [cycles], log pace [cycles/s] at size 1, heading [rad], x, y [m], forward, left flow
#: [m/cycle], log body size, turning rate [rad/s], speed relative to the pace's (from 1 it is the full one, up to 0
#: none), and whether the person is turning and changing speed, 1 or 0.
PHASE, PACE, HEADING, X, Y, FORWARD, LEFT, SIZE, TURN, EASE, TURNING, CHANGING = range(12)
#: The discrete ones.
STATES = [TURNING, CHANGING]
_OBLIQUITY, _NECK = 4, 8


@kernel
def add_noise(gait, scores, rest, key, noise, means, root, deviation, gait_out, scores_out, rest_out) -> None:
    """Write walkers with one step of noise to the arrays `_out`; `advance` then moves them.

    Walker i uses random stream i of `key`.

    Args:
        gait: (n, 12).
        scores: (n, q), minus their mean.
        rest: (n, 25).
        key: integer from 0 to 2⁶⁴ - 1.
        noise: (21,) time step [s]; autoregressive coefficients of pace, scores and rest; their innovation deviations,
            relative to the stationary ones; deviations of phase, heading, forward and left position; coefficients of
            log size, turning rate and relative speed; their relative innovation deviations; probabilities of beginning
            and ending a turn, and a change of speed.
        means: (2,) of the log pace and the relative speed.
        root: (q, q) Cholesky factor of the scores' covariance.
        deviation: (29,) stationary, of rest, of the log pace, of the log size, of turning rate and relative speed.
        gait_out, scores_out, rest_out: outputs, shaped like the first three; phase is that after the step.
    """
    n, q = scores.shape
    drawn = np.empty(q)
    state = np.empty(1, dtype=np.uint64)
    seconds, keep_pace, keep_scores, keep_rest = noise[0], noise[1], noise[2], noise[3]
    for i in range(n):
        restart(state, key, i)
        way, out = gait[i], gait_out[i]
        out[PACE] = means[0] + keep_pace * (way[PACE] - means[0]) + noise[4] * deviation[25] * gaussian(state)
        _change(state, way, noise, means[1], deviation, out)
        cadence = math.exp(out[PACE] - 0.5 * way[SIZE]) * _slower(out[EASE])  # short legs are quick (Hof 1996)
        out[PHASE] = way[PHASE] + cadence * seconds + noise[7] * gaussian(state)
        out[HEADING] = way[HEADING] + out[TURN] * seconds + noise[8] * gaussian(state)
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
        out[SIZE] = way[SIZE]
        if deviation[26] > 0.0:
            out[SIZE] = noise[11] * way[SIZE] + noise[14] * deviation[26] * gaussian(state)


@kernel
def _change(state, way, noise, mean, deviation, out) -> None:
    """Write the discrete states after a step to `out`, and the relative speed and turning rate that depend on them."""
    out[CHANGING] = _switched(state, way[CHANGING], noise[19], noise[20])
    out[EASE], out[TURN] = way[EASE], 0.0
    if out[CHANGING]:
        out[EASE] = mean + noise[13] * (way[EASE] - mean) + noise[16] * deviation[28] * gaussian(state)
    out[TURNING] = _switched(state, way[TURNING], noise[17], noise[18])
    if out[TURNING]:
        out[TURN] = noise[12] * way[TURN] + noise[15] * deviation[27] * gaussian(state)


@kernel
def _switched(state, on, begins, ends) -> float:
    """The next state, 1 or 0, of what begins and ends with these probabilities."""
    return 1.0 - on if uniform(state) < (ends if on else begins) else on


@kernel
def advance(table, still, gait, before, scores, rest, moves, poses) -> None:
    """Write poses (n, 25), and move the walkers by the flow (trapezoidal rule) from the gaits `before`.

    Args:
        table: (phases, 1 + q, 25), mean first.
        still: (25,) of who stands.
        gait: (n, 12), updated in place.
        before: (n, 12) gaits one frame earlier.
        scores: (n, q), minus their mean.
        rest: (n, 25) to add.
        moves: whether the flow moves the walkers.
        poses: (n, 25), output.
    """
    for i in range(len(gait)):
        row, way = poses[i], gait[i]
        _channels(table, way[PHASE], scores[i], row)
        slower, size = _slower(way[EASE]), math.exp(way[SIZE])
        calm = slower * slower * (2.0 - slower * slower)
        for j in range(2, 25):
            row[j] = still[j] + calm * (row[j] - still[j])
        forward, left = size * slower * row[0], size * slower * row[1]
        row[2] *= size
        if moves:
            turned = way[PHASE] - before[i, PHASE]
            ahead, aside = 0.5 * (forward + way[FORWARD]) * turned, 0.5 * (left + way[LEFT]) * turned
            along = 0.5 * (before[i, HEADING] + way[HEADING])
            c, s = math.cos(along), math.sin(along)
            way[X] += c * ahead - s * aside
            way[Y] += s * ahead + c * aside
        way[FORWARD], way[LEFT] = forward, left
        for j in range(2, 25):
            row[j] += rest[i, j]
        row[0], row[1] = way[X], way[Y]
        row[5] += way[HEADING]
        speed = math.exp(way[PACE] - 0.5 * way[SIZE]) * slower * math.hypot(forward, left)
        row[_OBLIQUITY] -= math.atan(speed * way[TURN] / GRAVITY)
        row[_NECK] += HEAD_MOST * math.tanh(AHEAD * way[TURN] / HEAD_MOST)


@kernel
def _slower(ease) -> float:
    """Cadence and step length alike, relative to the full ones: their ratio stays (`motionenv.models.paths`)."""
    return math.sqrt(min(max(ease, 0.0), 1.0))


@kernel
def _channels(table, phase, scores, row) -> None:
    """Write mean + Σ_k scores_k · component_k to `row` (25,), interpolated linearly in phase."""
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
