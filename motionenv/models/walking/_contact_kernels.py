"""The way of the root over the ground, from the feet that stand on it.

The foot that moves back fastest under the body stands: the body moves forward as fast, and is as high as that ankle's
height says. What the feet still slip, a centimetre or two, is taken out at the hips.

Time is the last axis everywhere, and loops over it stay short, so that each becomes vector instructions.
"""

import math

import numpy as np

from motionenv._core.compilation import part
from motionenv.body.kinematics import FOOT_BALL
from motionenv.body.simd import foot_angle
from motionenv.models.contact_rule import CONTACT

_FAST = {"contract", "arcp"}
jit = part(fastmath=_FAST)
_inline = part(fastmath=_FAST, forceinline=True)

#: Rows per leg that `motionenv.models.walking._walk_kernels` writes: the ankle of a body whose root is at the origin
#: [m]; the foot's level direction; cosine and sine of the toe-down angle that follows the shin (both 0 for a foot that
#: can't be level: then the direction holds its ball [body heights]); height [m] of the ankle over the ground.
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

_MIDSWING = (0.8, 0.3)  # [cycles] phase at which the left and the right foot is in the air
TRUNCATE = 4.0  # standard deviations at which Gaussians end
TOE_X, TOE_Z = float(FOOT_BALL[0]), float(FOOT_BALL[2])


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
    z, work, more = rows[Z], rows[_WORK], rows[_MORE]
    left, right = rows[STANDS], rows[STANDS + 1]
    for t in range(samples):
        work[t] = (rows[LEG_ROWS + ANKLE_X, t] - rows[ANKLE_X, t]) / CONTACT.firmness
    _gradient(work, samples, rate, more)
    for t in range(samples):
        ahead = more[t]
        swings = decay(ahead if ahead > 0.0 else -ahead)
        stands = 1.0 / (1.0 + swings)
        swings *= stands
        left[t], right[t] = (stands if ahead > 0.0 else swings), (swings if ahead > 0.0 else stands)
    smooth(left, samples, CONTACT.shifting * rate, work)
    for t in range(samples):
        more[t] = rows[LEG_ROWS + ANKLE, t] - rows[LEG_ROWS + ANKLE_Z, t]
    for t in range(samples):
        z[t] = more[t] + work[t] * ((rows[ANKLE, t] - rows[ANKLE_Z, t]) - more[t])
    _balls(rows, samples, height)
    for axis in range(2):
        way = rows[X + axis]
        _gradient(rows[_BALLS + axis], samples, rate, work)
        _gradient(rows[_BALLS + 2 + axis], samples, rate, more)
        for t in range(samples):
            more[t] = -(left[t] * work[t] + right[t] * more[t])
        smooth(more, samples, CONTACT.smoothing * rate, work)
        way[0] = 0.0
        for t in range(1, samples):
            way[t] = way[t - 1] + 0.5 * (work[t] + work[t - 1]) / rate


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
    """Write the derivative [per second] of `values`: central differences, one-sided at the ends."""
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
