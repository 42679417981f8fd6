"""Kinematics of one body for kernels: numbers in, numbers out, without branches, so that loops over bodies become SIMD.

Rotations are 9 numbers, row by row, and points are 3.
"""

import math

import numpy as np

from motionenv._core.compilation import part
from motionenv.body.limbs import LIMB_SHIFTS, LIMBS
from motionenv.body.skeleton import ANKLE_HEIGHT

_inline = part(fastmath={"contract", "arcp"}, forceinline=True)

_TWO_OVER_PI = 2.0 / math.pi
_HALF_PI_HIGH, _HALF_PI_LOW = 1.57079632673412561417, 6.07710050650619224932e-11

_FOOT = LIMB_SHIFTS[LIMBS.index("left_foot")].tolist()  # heel and toe in the foot's frame, relative to body height
_TOE, _HEEL = math.hypot(*_FOOT[1]), math.hypot(*_FOOT[0])
_TOE_DROP, _HEEL_DROP = -_FOOT[1][2], -_FOOT[0][2]
_TOE_A, _TOE_B = _FOOT[1][0] / _TOE, _TOE_DROP / _TOE
_HEEL_A, _HEEL_B = -_FOOT[0][0] / _HEEL, _HEEL_DROP / _HEEL
_COS_LEAST, _SIN_LEAST = math.cos(-0.3), math.sin(-0.3)
_RANK_LEAST = _COS_LEAST - 1.0


@_inline
def sine_cosine(x):
    """Sine and cosine of `x` [rad], after Moshier's Cephes, accurate to about 1e-16 on an eighth of a turn."""
    k = np.floor(x * _TWO_OVER_PI + 0.5)
    r = (x - k * _HALF_PI_HIGH) - k * _HALF_PI_LOW
    z = r * r
    s = 1.58962301576546568060e-10 * z - 2.50507477628578072866e-8
    s = ((s * z + 2.75573136213857245213e-6) * z - 1.98412698295895385996e-4) * z + 8.33333333332211858878e-3
    s = r + r * z * (s * z - 1.66666666666666307295e-1)
    c = -1.13585365213876817300e-11 * z + 2.08757008419747316778e-9
    c = ((c * z - 2.75573141792967388112e-7) * z + 2.48015872888517045348e-5) * z - 1.38888888888730564116e-3
    c = 1.0 - 0.5 * z + z * z * (c * z + 4.16666666666665929218e-2)
    quarter = k - 4.0 * np.floor(0.25 * k)
    odd = (quarter == 1.0) | (quarter == 3.0)
    sine, cosine = (c if odd else s), (s if odd else c)
    sine = -sine if quarter >= 2.0 else sine
    cosine = -cosine if (quarter == 1.0) | (quarter == 2.0) else cosine
    return sine, cosine


@_inline
def _rank(c, s):
    """A number that increases with the angle of (c, s) from -π to π."""
    return 1.0 - c if s >= 0.0 else c - 1.0


@_inline
def foot_angle(c, s, z, height):
    """The toe-down angle of a foot above the ground, as cosine and sine, from those (c, s) of the one after the shin.

    The ankle's height `z` [m] above its height in stance limits how far the toe may drop: with the toe's centre at
    (a, -b) in the foot's frame it drops by a·sin + b·cos - b; likewise the heel, at (-a', -b'), for toe-up angles.
    Angles are compared by their position on the unit circle. `height` [m] is the body's.
    """
    free = z / height - ANKLE_HEIGHT
    x = (free + _HEEL_DROP) / _HEEL
    x = x if x < 1.0 else 1.0
    x = x if x > -1.0 else -1.0
    y = math.sqrt(1.0 - x * x)
    cl, sl = _HEEL_A * y + _HEEL_B * x, _HEEL_B * y - _HEEL_A * x
    cl, sl = (cl if sl < 0.0 else 1.0), (sl if sl < 0.0 else 0.0)
    x = (free + _TOE_DROP) / _TOE
    x = x if x < 1.0 else 1.0
    x = x if x > -1.0 else -1.0
    y = math.sqrt(1.0 - x * x)
    cm, sm = _TOE_A * y + _TOE_B * x, _TOE_A * x - _TOE_B * y
    low = _rank(cm, sm) < _RANK_LEAST
    cm, sm = (_COS_LEAST if low else cm), (_SIN_LEAST if low else sm)
    under = _rank(c, s) < _rank(cl, sl)
    c, s = (cl if under else c), (sl if under else s)
    over = _rank(c, s) > _rank(cm, sm)
    return (cm if over else c), (sm if over else s)


@_inline
def foot_direction(shin):
    """Direction of a foot that follows a shin of this rotation without lateral tilt.

    Whether there is such a direction, which a level shin out to the side lacks; the level direction (x, y); cosine and
    sine of the toe-down angle.
    """
    length = math.sqrt(shin[1] * shin[1] + shin[4] * shin[4])
    level = length > 1e-3
    over = 1.0 / (length if level else 1.0)
    x, y = shin[4] * over, -shin[1] * over
    c, s = shin[0] * x + shin[3] * y, -shin[6]
    over = 1.0 / math.sqrt(c * c + s * s + 1e-300)
    return level, x, y, c * over, s * over


@_inline
def foot_rotation(shin, z, height):
    """Rotation of a foot that follows the shin but stays above the ground; ankle at `z` [m], body of `height` [m]."""
    level, x, y, c, s = foot_direction(shin)
    c, s = foot_angle(c, s, z, height)
    return (
        x * c if level else shin[0], -y if level else shin[1], x * s if level else shin[2],
        y * c if level else shin[3], x if level else shin[4], y * s if level else shin[5],
        -s if level else shin[6], 0.0 if level else shin[7], c if level else shin[8],
    )  # fmt: skip


@_inline
def root_rotation(sy, cy, sx, cx, sz, cz):
    """Rotation of the torso (9 numbers, row by row) from sines and cosines of tilt, obliquity and heading."""
    return (
        cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy,
        sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy,
        -cx * sy, sx, cx * cy,
    )  # fmt: skip


@_inline
def _row_turned(a, b, c, sy, cy, sx, cx, sz, cz):
    """A row of parent · R_y R_x R_z."""
    p, q = a * cy - c * sy, a * sy + c * cy
    r, s = b * cx + q * sx, q * cx - b * sx
    return p * cz + r * sz, r * cz - p * sz, s


@_inline
def turned(r, sy, cy, sx, cx, sz, cz):
    """`r` · R_y R_x R_z, 9 numbers, row-major."""
    a = _row_turned(r[0], r[1], r[2], sy, cy, sx, cx, sz, cz)
    b = _row_turned(r[3], r[4], r[5], sy, cy, sx, cx, sz, cz)
    c = _row_turned(r[6], r[7], r[8], sy, cy, sx, cx, sz, cz)
    return a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]


@_inline
def hinged(r, s, c):
    """`r` · R_y, 9 numbers, row-major."""
    return (
        r[0] * c - r[2] * s, r[1], r[0] * s + r[2] * c,
        r[3] * c - r[5] * s, r[4], r[3] * s + r[5] * c,
        r[6] * c - r[8] * s, r[7], r[6] * s + r[8] * c,
    )  # fmt: skip


@_inline
def placed(p, r, o):
    """World position of `o` in the frame `r` at `p`: p + r · o."""
    return (
        p[0] + r[0] * o[0] + r[1] * o[1] + r[2] * o[2],
        p[1] + r[3] * o[0] + r[4] * o[1] + r[5] * o[2],
        p[2] + r[6] * o[0] + r[7] * o[1] + r[8] * o[2],
    )
