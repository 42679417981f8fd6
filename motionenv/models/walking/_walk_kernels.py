"""Walks of `motionenv.models.walking.model`, one walker at a time, and the way of the root over the ground.

The foot whose ball moves back fastest under the body stands, in double support the one behind, over which people roll
on while the other foot lands: the body moves forward as fast, and is as high as the lower ankle's height says
(`carry`). What the feet still slip is taken out at the hips (`plant`). Each walk is turned so that its even cycle goes
along x.

A block of `LANES` samples lies in rows of one flat array whose row numbers are known to the compiler, so that each loop
over samples becomes vector instructions; sines, cosines and exponentials are polynomials for the same reason. Time is
the last axis everywhere.

Within a segment of the score spline, scores are cubic in u from 0 to 1, so a channel is Σ_h b_h(phase) Σ_j u^j d_hj
with the Fourier basis b: 92 products instead of 9 · 23.
"""

import math

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.body.kinematics import FOOT_BALL, write_nodes
from motionenv.body.simd import foot_angle, foot_direction, hinged, placed, root_rotation, sine_cosine, turned
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.models.contact_rule import CONTACT

_FAST = {"contract", "arcp"}
jit = part(fastmath=_FAST)
_inline = part(fastmath=_FAST, forceinline=True)

#: Rows per leg: the ankle of a body whose root is at the origin [m]; the foot's level direction; cosine and sine of the
#: toe-down angle that follows the shin (both 0 for a foot that can't be level: then the direction holds its ball [body
#: heights]); height [m] of the ankle over the ground.
ANKLE_X, ANKLE_Y, ANKLE_Z, LEVEL_X, LEVEL_Y, COS, SIN, ANKLE = range(8)
LEG_ROWS = 8
#: Rows of both legs; then cosine and sine of the heading.
COS_HEADING, SIN_HEADING = 2 * LEG_ROWS, 2 * LEG_ROWS + 1
#: Rows that contact writes: the root, how much each foot stands, the balls of the feet, and by how much to move them.
X, Y, Z, STANDS, _BALLS, _SURELY, _SMOOTH = 18, 19, 20, 21, 23, 27, 30
_WORK, _MORE = 33, 34
ROWS = 35
#: Samples in a block.
LANES = 16
_COARSE = 64  # samples of a cycle that tell where it goes

_MIDSWING = (0.8, 0.3)  # [cycles] phase at which the left and the right foot is in the air
TRUNCATE = 4.0  # standard deviations at which Gaussians end
TOE_X, TOE_Z = float(FOOT_BALL[0]), float(FOOT_BALL[2])

#: Channels of `motionenv.models.walking.preprocessing.CHANNELS` in the order of a block's rows: the root's rotations,
#: both legs, the ankles' heights, the neck, and the arms, which contact doesn't need. Behind them come sines and
#: cosines of the first 11 rows, and the rows that contact wants.
ORDER = (19, 20, 21, *range(11, 19), 22, 23, 0, 1, 2, *range(3, 11))
_LEFT, _RIGHT, _HEIGHTS, _NECK, _ARMS, _SIN, _COS, _OUT = 3, 7, 11, 13, 16, 24, 35, 46
_BLOCK = _OUT + 2 * LEG_ROWS


@jit
def soften(values, softness):
    """Put values (LANES,) through a soft stop at 0: softness · log(1 + exp(value / softness))."""
    for j in range(LANES):
        x = values[j] / softness
        y = decay(x if x > 0.0 else -x)
        s = y / (2.0 + y)  # log(1 + y) = 2 artanh(s)
        z = s * s
        p = 1.0 / 31.0 + z * (1.0 / 33.0)
        p = 1.0 / 27.0 + z * (1.0 / 29.0 + z * p)
        p = 1.0 / 23.0 + z * (1.0 / 25.0 + z * p)
        p = 1.0 / 19.0 + z * (1.0 / 21.0 + z * p)
        p = 1.0 / 15.0 + z * (1.0 / 17.0 + z * p)
        p = 1.0 / 11.0 + z * (1.0 / 13.0 + z * p)
        p = 1.0 / 7.0 + z * (1.0 / 9.0 + z * p)
        p = 1.0 / 3.0 + z * (1.0 / 5.0 + z * p)
        values[j] = softness * ((x if x > 0.0 else 0.0) + 2.0 * s * (1.0 + z * p))


@jit
def _columns(turn, columns, first, step, segment, pace):
    """Write the Fourier columns of samples first, first + step, ... of a block, and where in `segment` each lies.

    Row 2k of `columns` is the sine of harmonic k and row 2k + 1 its cosine; the first row of `turn` is u.
    """
    rate, pad, seconds, phase = pace
    for j in range(LANES):
        sample = first + step * j
        cycles = phase + (sample - pad) / rate / seconds
        sine, cosine = sine_cosine(2.0 * math.pi * (cycles - np.floor(cycles)))
        turn[j] = sample / rate / seconds - segment
        turn[LANES + j], turn[2 * LANES + j] = sine, cosine
    for j in range(LANES):
        columns[j], columns[LANES + j] = 0.0, 1.0
    for k in range(2 * LANES, len(columns), 2 * LANES):
        two = columns[k - 2 * LANES : k + 2 * LANES]  # this harmonic's columns behind those of the one before
        for j in range(LANES):
            s, c = turn[LANES + j], turn[2 * LANES + j]
            before, ahead = two[j], two[LANES + j]
            two[2 * LANES + j] = s * ahead + c * before
            two[3 * LANES + j] = c * ahead - s * before


@jit
def _curves(scores, points, terms, out):
    """Write the Fourier coefficients (k, columns · 24) that scores (q,) plus each of control points (k, q) stand for.

    A B-spline's weights sum to 1, so what all points have in common may be added to each.
    """
    for i in range(len(out)):
        curve, last, mean = out[i], len(scores) - 1, terms[0]
        for j in range(len(curve)):
            curve[j] = mean[j]
        for k in range(0, last, 2):  # two at a time: half as often in and out of memory
            a, b = scores[k] + points[i, k], scores[k + 1] + points[i, k + 1]
            one, other = terms[1 + k], terms[2 + k]
            for j in range(len(curve)):
                curve[j] += a * one[j] + b * other[j]
        if last % 2 == 0:
            a, one = scores[last] + points[i, last], terms[1 + last]
            for j in range(len(curve)):
                curve[j] += a * one[j]


@jit
def _coefficients(curves, d):
    """Write d, (4, columns · 24), of the uniform cubic B-spline between the first four of `curves`."""
    c0, c1, c2, c3, d0, d1, d2, d3 = curves[0], curves[1], curves[2], curves[3], d[0], d[1], d[2], d[3]
    for i in range(len(c0)):
        d0[i] = (c0[i] + 4.0 * c1[i] + c2[i]) / 6.0
    for i in range(len(c0)):
        d1[i] = 0.5 * (c2[i] - c0[i])
    for i in range(len(c0)):
        d2[i] = 0.5 * (c0[i] + c2[i]) - c1[i]
    for i in range(len(c0)):
        d3[i] = (c3[i] - c0[i]) / 6.0 + 0.5 * (c1[i] - c2[i])


@jit
def _channels(w, turn, columns, d, first, last):
    """Write the channels in rows `first` to `last` of a block, four at a time."""
    for c in range(first, last, 4):
        out = w[c * LANES : (c + 4) * LANES]
        for j in range(4 * LANES):
            out[j] = 0.0
        for k in range(len(columns) // LANES - 1):
            column, i = columns[(k + 1) * LANES : (k + 2) * LANES], 24 * k + c
            a0, a1, a2, a3 = d[0, i], d[1, i], d[2, i], d[3, i]
            b0, b1, b2, b3 = d[0, i + 1], d[1, i + 1], d[2, i + 1], d[3, i + 1]
            c0, c1, c2, c3 = d[0, i + 2], d[1, i + 2], d[2, i + 2], d[3, i + 2]
            d0, d1, d2, d3 = d[0, i + 3], d[1, i + 3], d[2, i + 3], d[3, i + 3]
            for j in range(LANES):
                u, b = turn[j], column[j]
                out[j] += b * (a0 + u * (a1 + u * (a2 + u * a3)))
                out[LANES + j] += b * (b0 + u * (b1 + u * (b2 + u * b3)))
                out[2 * LANES + j] += b * (c0 + u * (c1 + u * (c2 + u * c3)))
                out[3 * LANES + j] += b * (d0 + u * (d1 + u * (d2 + u * d3)))


@jit
def _row(w, row):
    return w[row * LANES : (row + 1) * LANES]


@jit
def _keep(w, row, samples, first):
    for j in range(LANES):
        samples[first + j] = w[row * LANES + j]


@_inline
def _leg(w, j, pose, out, side, hip, knee, ankle):
    """Write what contact wants of one leg, whose root is at the origin."""
    torso = root_rotation(
        w[_SIN * LANES + j], w[_COS * LANES + j], w[(_SIN + 1) * LANES + j], w[(_COS + 1) * LANES + j],
        w[(_SIN + 2) * LANES + j], w[(_COS + 2) * LANES + j],
    )  # fmt: skip
    s, c = (_SIN + pose) * LANES + j, (_COS + pose) * LANES + j
    thigh = turned(
        torso, -w[s], w[c], side * w[s + LANES], w[c + LANES], -side * w[s + 2 * LANES], w[c + 2 * LANES]
    )  # fmt: skip
    shin = hinged(thigh, w[s + 3 * LANES], w[c + 3 * LANES])
    x, y, z = placed(placed(placed((0.0, 0.0, 0.0), torso, hip), thigh, knee), shin, ankle)
    w[out * LANES + j], w[(out + 1) * LANES + j], w[(out + 2) * LANES + j] = x, y, z
    level, forward_x, forward_y, c, s = foot_direction(shin)
    w[(out + 3) * LANES + j] = forward_x if level else shin[0] * TOE_X + shin[2] * TOE_Z
    w[(out + 4) * LANES + j] = forward_y if level else shin[3] * TOE_X + shin[5] * TOE_Z
    w[(out + 5) * LANES + j], w[(out + 6) * LANES + j] = (c if level else 0.0), (s if level else 0.0)


@_inline
def _offset(offsets, node):
    return offsets[node, 0], offsets[node, 1], offsets[node, 2]


@jit
def _legs(w, floor, offsets, height):
    """Write what contact wants of both legs, and bend their knees."""
    left = _offset(offsets, 9), _offset(offsets, 11), _offset(offsets, 13)
    right = _offset(offsets, 10), _offset(offsets, 12), _offset(offsets, 14)
    for side in range(2):
        soften(_row(w, _LEFT + 4 * side + 3), CONTACT.stiffness)
        over, ankle = _row(w, _HEIGHTS + side), _row(w, _OUT + side * LEG_ROWS + ANKLE)
        for j in range(LANES):
            ankle[j] = over[j] - floor[side]
        soften(ankle, CONTACT.give)
        for j in range(LANES):
            ankle[j] = height * (ANKLE_HEIGHT + ankle[j])
    for j in range(_HEIGHTS * LANES):
        w[_SIN * LANES + j], w[_COS * LANES + j] = sine_cosine(w[j])
    for j in range(LANES):
        _leg(w, j, _LEFT, _OUT, 1.0, left[0], left[1], left[2])
    for j in range(LANES):
        _leg(w, j, _RIGHT, _OUT + LEG_ROWS, -1.0, right[0], right[1], right[2])


@jit
def _show(w, first, pad, finer, stop, poses):
    """Put the angles of root, neck and legs into those poses (frames, 25) that are samples of this block."""
    for f in range(_frames_before(first, pad, finer, poses), _frames_before(stop, pad, finer, poses)):
        j = pad + f * finer - first
        for i in range(3):
            poses[f, 3 + i], poses[f, 6 + i] = w[i * LANES + j], w[(_NECK + i) * LANES + j]
        for i in range(8):
            poses[f, 17 + i] = w[(_LEFT + i) * LANES + j]


@_inline
def _frames_before(sample, pad, finer, poses):
    """Number of poses before `sample`."""
    return min(max(0, (sample - pad + finer - 1) // finer), len(poses))


@jit
def _arms(w, first, last, poses):
    """Put the angles of the arms into poses `first` to `last` (frames, 25), with elbows bent."""
    soften(_row(w, _ARMS + 3), CONTACT.stiffness)
    soften(_row(w, _ARMS + 7), CONTACT.stiffness)
    for f in range(first, last):
        for i in range(8):
            poses[f, 9 + i] = w[(_ARMS + i) * LANES + f - first]


@jit
def _move(curves, floor, pace, samples, finer, body, rows, poses):
    """Write what contact wants of all samples to `rows`, and angles to poses (frames, 25), which may be none.

    `curves` (k, columns · 24) are from `_curves`; `floor` is what the left and the right ankle's heights are over [body
    heights]; `pace` holds samples per second, sample of the first pose, stride time [s] and phase [cycles]; there are
    `finer` samples from pose to pose. `rows` has LANES columns to spare, and `body` is offsets (16, 3) and height [m].
    """
    (rate, pad, seconds, _), (offsets, height), size = pace, body, curves.shape[1]
    w, turn, d = np.empty(_BLOCK * LANES), np.empty(3 * LANES), np.empty((4, size))
    columns = np.empty((size // 24 + 1) * LANES)
    start = 0
    while start < samples:
        segment = int(start / rate / seconds)
        stop = min(samples, max(start + 1, math.ceil((segment + 1) * seconds * rate)))
        _coefficients(curves[segment:], d)
        for first in range(start, stop, LANES):
            _columns(turn, columns, first, 1, segment, pace)
            _channels(w, turn, columns, d, 0, _ARMS)
            _legs(w, floor, offsets, height)
            for row in range(2 * LEG_ROWS):
                _keep(w, _OUT + row, rows[row], first)
            _keep(w, _COS + 2, rows[COS_HEADING], first)
            _keep(w, _SIN + 2, rows[SIN_HEADING], first)
            _show(w, first, pad, finer, min(first + LANES, stop), poses)
        last = _frames_before(stop, pad, finer, poses)
        for first in range(_frames_before(start, pad, finer, poses), last, LANES):
            _columns(turn, columns, pad + first * finer, finer, segment, pace)
            _channels(w, turn, columns, d, _ARMS, 24)
            _arms(w, first, min(first + LANES, last), poses)
        start = stop


@kernel(fastmath=_FAST)
def walk(start, stop, scores, floors, seconds, speeds, points, clock, terms, bodies, poses):
    """Write the walks of walkers `start` to `stop`.

    Contact decides how far a cycle carries, whatever its pace; but the pace decides which cycles fit, so the steps to
    a stride time that goes at a speed are shorter than a fixed stride would ask for, and there are several.

    Args:
        start, stop: which walkers.
        scores: (n, q).
        floors: (n, 2) what the heights of the left and the right ankle are over [body heights].
        seconds: (n,) stride times [s].
        speeds: (n,) [m/s] to reach by another stride time, 0 for that of `seconds`.
        points: (n, k, q) control points of the splines by which scores leave their mean.
        clock: samples per second; sample of the first pose; samples from pose to pose; where in the cycle to start
            [cycles]; the least stride time [s] that `points` are enough for.
        terms: (1 + q, columns · 24) Fourier coefficients of mean and components, channels as in `ORDER`.
        bodies: offsets (n, 16, 3) and heights (n,) [m].
        poses: (n, frames, 25) to write.
    """
    rate, pad, finer, phase, shortest = clock
    frames = poses.shape[1]
    samples = (frames - 1) * finer + 1 + 2 * pad
    rows = np.empty((ROWS, samples + finer + LANES))
    curves = np.empty((points.shape[1], terms.shape[1]))
    even, cycle, ring = np.zeros((4, scores.shape[1])), np.empty((4, terms.shape[1])), np.empty((ROWS, _COARSE + LANES))
    for i in range(start, stop):
        speed, offsets, height = speeds[i], bodies[0][i], bodies[1][i]
        body = (offsets, height)
        _curves(scores[i], even, terms, cycle)
        _move(cycle, floors[i], (float(_COARSE), 0, 1.0, 0.0), _COARSE, 1, body, ring, poses[i, :0])
        _, _, x, y = _cycle_carried(ring, _COARSE, seconds[i], height)
        c, s = x / math.sqrt(x * x + y * y), y / math.sqrt(x * x + y * y)
        most = (samples + finer) / rate / (shortest if speed > 0.0 else seconds[i])  # strides
        _curves(scores[i], points[i], terms, curves[: int(most) + 5])
        floor, stride = floors[i], seconds[i]
        for _ in range(CONTACT.turns if speed > 0.0 else 0):
            _move(curves, floor, (rate, pad, stride, phase), samples + finer, finer, body, rows, poses[i, :0])
            carry(rows, samples + finer, rate, height)
            last = pad + frames * finer
            reached = c * (rows[X, last] - rows[X, pad]) + s * (rows[Y, last] - rows[Y, pad])
            reached *= rate / (finer * frames)
            stride = max(stride * (max(reached, 0.0) / speed) ** 0.75, shortest)
        pace = (rate, pad, stride, phase)
        _move(curves, floor, pace, samples, finer, body, rows, poses[i])
        carry(rows, samples, rate, height)
        plant(rows, samples, rate, pad, finer, _phases(pace, samples), offsets[9:11], poses[i])
        _head(poses[i], c, s)


@jit
def _phases(pace, samples):
    rate, pad, seconds, phase = pace
    cycles = np.empty(samples)
    for t in range(samples):
        cycles[t] = phase + (t - pad) / rate / seconds
    return cycles


@kernel(fastmath=_FAST)
def walk_in_place(scores, floors, speeds, finer, terms, bodies, out):
    """Write a cycle of each of n walkers, as `walk` repeats it, less its even way along x.

    Args:
        scores, floors, speeds, terms, bodies: as of `walk`.
        finer: samples of contact from one that is written to the next.
        out: to write: markers (n, samples, 15, 3) [m], poses (n, samples, 25), how much the left and the right foot
            stand (n, samples, 2), stride lengths (n,) [m]; and stride times (n,) [s], changed to reach the speeds.
    """
    markers, poses, standing, strides, seconds = out
    count = poses.shape[1] * finer
    points, curves = np.zeros((4, scores.shape[1])), np.empty((4, terms.shape[1]))
    ring, nodes, rotations = np.empty((ROWS, count + LANES)), np.empty((16, 3)), np.empty((12, 3, 3))
    for i in range(len(poses)):
        offsets, height = bodies[0][i], bodies[1][i]
        _curves(scores[i], points, terms, curves)
        _move(curves, floors[i], (float(count), 0, 1.0, 0.0), count, finer, (offsets, height), ring, poses[i])
        for _ in range(CONTACT.turns if speeds[i] > 0.0 else 1):
            rate = count / seconds[i]
            rows, pad, x, y = _cycle_carried(ring, count, seconds[i], height)
            total = count + 2 * pad
            strides[i] = math.sqrt(x * x + y * y)
            seconds[i] = strides[i] / speeds[i] if speeds[i] > 0.0 else seconds[i]
        plant(rows, total, rate, pad, finer, _phases((float(count), pad, 1.0, 0.0), total), offsets[9:11], poses[i])
        _stay(poses[i], x, y)
        for f in range(poses.shape[1]):
            for side in range(2):
                standing[i, f, side] = rows[STANDS + side, pad + f * finer]
            write_nodes(poses[i, f], offsets, nodes, rotations)
            for marker in range(15):
                for axis in range(3):
                    markers[i, f, marker, axis] = nodes[marker, axis]


@jit
def _cycle_carried(ring, count, seconds, height):
    """Rows of a cycle of `count` samples, carried over the ground; samples before it, and the way [m] that it goes."""
    rate = count / seconds
    # Steps that the cycle belongs to begin and end within 0.8 cycles of it; smoothing reaches beyond them.
    pad = int(count + TRUNCATE * CONTACT.shifting * rate)
    rows = _around(ring, count, pad, count + 2 * pad)
    carry(rows, count + 2 * pad, rate, height)
    return rows, pad, rows[X, pad + count] - rows[X, pad], rows[Y, pad + count] - rows[Y, pad]


@jit
def _around(ring, count, pad, total):
    """Rows (ROWS, total) of what contact wants, which repeats after `count` samples and starts at sample -pad."""
    rows = np.empty((ROWS, total + LANES))
    for row in range(SIN_HEADING + 1):
        for t in range(total + LANES):
            rows[row, t] = ring[row, (t - pad) % count]
    return rows


@jit
def _stay(poses, x, y):
    """Take the even way (x, y) [m] of a cycle out of poses (samples, 25), centre them and turn them towards it."""
    samples, mean_x, mean_y = len(poses), 0.0, 0.0
    for f in range(samples):
        poses[f, 0] -= f / samples * x
        poses[f, 1] -= f / samples * y
        mean_x += poses[f, 0] / samples
        mean_y += poses[f, 1] / samples
    for f in range(samples):
        poses[f, 0] -= mean_x
        poses[f, 1] -= mean_y
    length = math.sqrt(x * x + y * y)
    _head(poses, x / length, y / length)


@jit
def _head(poses, c, s):
    """Turn poses (samples, 25) so that the direction (c, s) is that of x."""
    heading = math.atan2(s, c)
    for f in range(len(poses)):
        ahead, left = poses[f, 0], poses[f, 1]
        poses[f, 0], poses[f, 1] = c * ahead + s * left, c * left - s * ahead
        poses[f, 5] -= heading


@_inline
def decay(a):
    """exp(-a) of a >= 0, to 3e-14 of itself; from 40 on exp(-40)."""
    r = (a if a < 40.0 else 40.0) * (-1.0 / 256.0)
    p = 1.0 + r * (1.0 / 10.0)
    p = 1.0 + r * (1.0 / 9.0) * p
    p = 1.0 + r * (1.0 / 8.0) * p
    p = 1.0 + r * (1.0 / 7.0) * p
    p = 1.0 + r * (1.0 / 6.0) * p
    p = 1.0 + r * (1.0 / 5.0) * p
    p = 1.0 + r * (1.0 / 4.0) * p
    p = 1.0 + r * (1.0 / 3.0) * p
    p = 1.0 + r * (1.0 / 2.0) * p
    p = 1.0 + r * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    return p * p


@jit
def carry(rows, samples, rate, height):
    """Write the root's x, y and z [m] in `rows` (ROWS, ...), how much each foot stands, and the balls of the feet.

    The legs' rows are filled in; there are `samples` of each, `rate` per second, of a body of `height` [m].
    """
    more, left, right = rows[_MORE], rows[STANDS], rows[STANDS + 1]
    _lift(rows, samples, rate)
    _balls(rows, samples, height)
    for axis in range(2):
        _gradient(rows[_BALLS + axis], samples, rate, rows[_SURELY + axis])
        _gradient(rows[_BALLS + 2 + axis], samples, rate, rows[_SMOOTH + axis])
    for t in range(samples):
        more[t] = (rows[_SMOOTH, t] - rows[_SURELY, t]) / CONTACT.firmness
    _share(more, samples, right)
    for axis in range(2):
        way, speed = rows[X + axis], rows[_SURELY + axis]
        for t in range(samples):
            more[t] = -(right[t] * speed[t] + (1.0 - right[t]) * rows[_SMOOTH + axis, t])
        smooth(more, samples, CONTACT.smoothing * rate, speed)
        way[0] = 0.0
        for t in range(1, samples):
            way[t] = way[t - 1] + 0.5 * (speed[t] + speed[t - 1]) / rate
    smooth(right, samples, CONTACT.shifting * rate, left)
    for t in range(samples):
        right[t] = 1.0 - left[t]


@jit
def _lift(rows, samples, rate):
    """Write the root's height [m] over the lower ankle."""
    z, work, more = rows[Z], rows[_WORK], rows[_MORE]
    for t in range(samples):
        more[t] = (rows[LEG_ROWS + ANKLE, t] - rows[ANKLE, t]) / CONTACT.lower
    _share(more, samples, work)
    smooth(work, samples, CONTACT.settling * rate, more)
    for t in range(samples):
        other = rows[LEG_ROWS + ANKLE, t] - rows[LEG_ROWS + ANKLE_Z, t]
        z[t] = other + more[t] * ((rows[ANKLE, t] - rows[ANKLE_Z, t]) - other)


@jit
def _share(ahead, samples, out):
    """Write the logistic function of `ahead` (samples,)."""
    for t in range(samples):
        a = ahead[t]
        swings = decay(a if a > 0.0 else -a)
        stands = 1.0 / (1.0 + swings)
        out[t] = stands if a > 0.0 else swings * stands


@jit
def plant(rows, samples, rate, pad, finer, phase, hips, poses):
    """Put roots into poses (frames, 25), and turn their hips so that standing feet stay where they are on average.

    Seen in the pelvis' heading, flexion moves the ankle forward by its depth under the hip, and abduction outwards by
    its distance from it; what the pelvis' tilt adds to that is small.

    There are `samples` of `rows`, as `carry` leaves them, `rate` per second, and `finer` from pose to pose, of which
    the first is at sample `pad`. `phase` (samples,) [cycles] is 0 when the left leg is furthest ahead; `hips` (2, 3)
    [m] are those of the left and the right hip from the pelvis.
    """
    for f in range(len(poses)):
        t = pad + f * finer
        poses[f, 0], poses[f, 1] = rows[X, t] - rows[X, pad], rows[Y, t] - rows[Y, pad]
        poses[f, 2] = rows[Z, t]
    for side in range(2):
        _slip(rows, samples, side, phase)
        for i in range(3):
            smooth(rows[_SURELY + i], samples, CONTACT.settling * rate, rows[_SMOOTH + i])
        leg, outwards = rows[LEG_ROWS * side :], 1.0 - 2.0 * side
        for f in range(len(poses)):
            t = pad + f * finer
            surely = rows[_SMOOTH, t] + CONTACT.looseness
            x, y = rows[_SMOOTH + 1, t] / surely, rows[_SMOOTH + 2, t] / surely
            forward, left = rows[COS_HEADING, t], rows[SIN_HEADING, t]
            depth, ankle = hips[side, 2] - leg[ANKLE_Z, t], leg[ANKLE_X, t]
            poses[f, 17 + 4 * side] += (forward * x + left * y) / depth
            poses[f, 18 + 4 * side] += outwards * (forward * y - left * x) / math.sqrt(depth * depth + ankle * ankle)


@jit
def _slip(rows, samples, side, phase):
    """Write how surely a foot stands, and that times how far it is from its place (x, y).

    A foot's place is the mean of its ball over the step that a sample belongs to, weighted by how much it stands.
    """
    stands, work = rows[STANDS + side], rows[_WORK]
    surely, x, y = rows[_SURELY], rows[_SURELY + 1], rows[_SURELY + 2]
    _add(rows[_BALLS + 2 * side], rows[X], samples, x)
    _add(rows[_BALLS + 2 * side + 1], rows[Y], samples, y)
    for t in range(samples):
        work[t] = np.floor(phase[t] - _MIDSWING[side])
    start = 0
    for t in range(1, samples + 1):
        if t == samples or work[t] != work[start]:
            _leave(stands, x, y, start, t)
            start = t
    for t in range(samples):
        surely[t] = stands[t] * decay((x[t] * x[t] + y[t] * y[t]) * (1.0 / CONTACT.reach**2))
    for t in range(samples):
        x[t] *= surely[t]
    for t in range(samples):
        y[t] *= surely[t]


@jit
def _add(one, other, samples, out):
    for t in range(samples):
        out[t] = one[t] + other[t]


@jit
def _leave(stands, x, y, start, stop):
    """Make of places x, y [m] from `start` to `stop` how far they are from their mean place."""
    total, mean_x, mean_y = 0.0, 0.0, 0.0
    for t in range(start, stop):
        total += stands[t]
        mean_x += stands[t] * x[t]
        mean_y += stands[t] * y[t]
    total = max(total, 1e-9)
    mean_x, mean_y = mean_x / total, mean_y / total
    for t in range(start, stop):
        x[t] = mean_x - x[t]
    for t in range(start, stop):
        y[t] = mean_y - y[t]


@jit
def _balls(rows, samples, height):
    """Write the balls of both feet (x, y) [m] of bodies at x = y = 0 with their roots at their heights."""
    w = np.empty(10 * LANES)
    for start in range(0, samples, LANES):
        for side in range(2):
            for row in range(7):
                for j in range(LANES):
                    w[row * LANES + j] = rows[LEG_ROWS * side + row, start + j]
            for j in range(LANES):
                w[7 * LANES + j] = rows[Z, start + j]
            _ball_block(w, height)
            for row in range(2):
                for j in range(LANES):
                    rows[_BALLS + 2 * side + row, start + j] = w[(8 + row) * LANES + j]


@jit
def _ball_block(w, height):
    """Write rows 8 and 9 of a block, the ball's x and y [m], from those of the leg and the root's height in row 7."""
    for j in range(LANES):
        c, s = w[COS * LANES + j], w[SIN * LANES + j]
        level = (c != 0.0) | (s != 0.0)
        c, s = foot_angle(c, s, w[ANKLE_Z * LANES + j] + w[7 * LANES + j], height)
        reach = (TOE_X * c + TOE_Z * s) * height if level else height
        w[8 * LANES + j] = w[ANKLE_X * LANES + j] + w[LEVEL_X * LANES + j] * reach
        w[9 * LANES + j] = w[ANKLE_Y * LANES + j] + w[LEVEL_Y * LANES + j] * reach


@jit
def _gradient(values, samples, rate, out):
    half, inside, after = 0.5 * rate, out[1 : samples - 1], values[2:samples]
    for t in range(samples - 2):
        inside[t] = (after[t] - values[t]) * half
    out[0] = (values[1] - values[0]) * rate
    out[samples - 1] = (values[samples - 1] - values[samples - 2]) * rate


@jit
def smooth(values, samples, deviation, out):
    """Write `values` (samples, ...) to `out`, smoothed by a Gaussian of standard deviation `deviation` [samples].

    As scipy's gaussian_filter1d with the ends repeated; `out` must not be `values`.
    """
    radius = int(TRUNCATE * deviation + 0.5)
    longer = np.empty(samples + 2 * radius)
    for t in range(radius):
        longer[t], longer[radius + samples + t] = values[0], values[samples - 1]
    for t in range(samples):
        longer[radius + t] = values[t]
    total = 1.0
    for k in range(1, radius + 1):
        total += 2.0 * math.exp(-0.5 * (k / deviation) ** 2)
    for t in range(samples):
        out[t] = values[t] / total
    for k in range(1, radius + 1):
        weight = math.exp(-0.5 * (k / deviation) ** 2) / total
        before, behind = longer[radius - k : radius - k + samples], longer[radius + k : radius + k + samples]
        for t in range(samples):
            out[t] += weight * (before[t] + behind[t])
