"""Ends of the limbs of many bodies at a time: `motionenv.body.limb_segments` in an eighth of its time.

Everything is laid out with the body as the last axis, in rows of `LANES` numbers of one flat array whose row numbers
are known to the compiler, so that each loop over bodies becomes vector instructions. For the same reason there are no
branches, and sines and cosines are polynomials (Moshier's Cephes, to about 1e-16 on an eighth of a turn). The foot's
angles are compared by where they lie on the unit circle, not by arcsines.
"""

import math

import numpy as np
from numba import njit

from motionenv.body.kinematics import _HINGE_SIGN
from motionenv.body.skeleton import ANKLE_HEIGHT, LIMB_SHIFTS, LIMBS, NODES

jit = njit(nogil=True, cache=True, error_model="numpy")
_inline = njit(inline="always", error_model="numpy")

#: Bodies in a block.
LANES = 32
#: Rows of the ends of limbs, (limbs, 2, 3), in a block's array; then come poses, sines and cosines.
END_ROWS = 6 * len(LIMBS)
_POSE, _SIN, _COS = END_ROWS, END_ROWS + 25, END_ROWS + 50
#: Length of a block's array.
WORK = (END_ROWS + 75) * LANES

_TWO_OVER_PI = 2.0 / math.pi
_HALF_PI_HIGH, _HALF_PI_LOW = 1.57079632673412561417, 6.07710050650619224932e-11

_NECK, _HEAD = NODES.index("neck"), NODES.index("head")
_FOOT = LIMB_SHIFTS[LIMBS.index("left_foot")]  # heel and toe in the foot's frame, shares of the height
_TOE_A, _TOE_B = _FOOT[1, 0] / np.hypot(*_FOOT[1, ::2]), -_FOOT[1, 2] / np.hypot(*_FOOT[1, ::2])
_HEEL_A, _HEEL_B = -_FOOT[0, 0] / np.hypot(*_FOOT[0, ::2]), -_FOOT[0, 2] / np.hypot(*_FOOT[0, ::2])
_TOE, _HEEL = float(np.hypot(*_FOOT[1, ::2])), float(np.hypot(*_FOOT[0, ::2]))
_TOE_A, _TOE_B, _HEEL_A, _HEEL_B = float(_TOE_A), float(_TOE_B), float(_HEEL_A), float(_HEEL_B)
_TOE_DROP, _HEEL_DROP = float(-_FOOT[1, 2]), float(-_FOOT[0, 2])
_COS_LEAST, _SIN_LEAST = math.cos(-0.3), math.sin(-0.3)
_RANK_LEAST = _COS_LEAST - 1.0
_HINGE_ARM, _HINGE_LEG = float(_HINGE_SIGN[0]), float(_HINGE_SIGN[2])


@jit
def _set_sines(w):
    """Write sines and cosines of the angles of a block."""
    for j in range(25 * LANES):
        x = w[_POSE * LANES + j]
        k = math.floor(x * _TWO_OVER_PI + 0.5)
        r = (x - k * _HALF_PI_HIGH) - k * _HALF_PI_LOW
        z = r * r
        s = 1.58962301576546568060e-10 * z - 2.50507477628578072866e-8
        s = ((s * z + 2.75573136213857245213e-6) * z - 1.98412698295895385996e-4) * z + 8.33333333332211858878e-3
        s = r + r * z * (s * z - 1.66666666666666307295e-1)
        c = -1.13585365213876817300e-11 * z + 2.08757008419747316778e-9
        c = ((c * z - 2.75573141792967388112e-7) * z + 2.48015872888517045348e-5) * z - 1.38888888888730564116e-3
        c = 1.0 - 0.5 * z + z * z * (c * z + 4.16666666666665929218e-2)
        quarter = k - 4.0 * math.floor(0.25 * k)
        odd = (quarter == 1.0) | (quarter == 3.0)
        sine, cosine = (c if odd else s), (s if odd else c)
        w[_SIN * LANES + j] = -sine if quarter >= 2.0 else sine
        w[_COS * LANES + j] = -cosine if (quarter == 1.0) | (quarter == 2.0) else cosine


@_inline
def _put(w, row, j, p, r, x, y, z):
    """Write p + r · (x, y, z) to three rows."""
    w[row * LANES + j] = p[0] + r[0] * x + r[1] * y + r[2] * z
    w[(row + 1) * LANES + j] = p[1] + r[3] * x + r[4] * y + r[5] * z
    w[(row + 2) * LANES + j] = p[2] + r[6] * x + r[7] * y + r[8] * z


@_inline
def _at(p, r, o):
    """Place p + r · o as a tuple."""
    x, y, z = o[0], o[1], o[2]
    return (
        p[0] + r[0] * x + r[1] * y + r[2] * z,
        p[1] + r[3] * x + r[4] * y + r[5] * z,
        p[2] + r[6] * x + r[7] * y + r[8] * z,
    )


@_inline
def _row_turned(a, b, c, sy, cy, sx, cx, sz, cz):
    """A row of parent · R_y R_x R_z."""
    p, q = a * cy - c * sy, a * sy + c * cy
    r, s = b * cx + q * sx, q * cx - b * sx
    return p * cz + r * sz, r * cz - p * sz, s


@_inline
def _turned(r, w, j, pose, flexion, abduction, rotation):
    """A joint with three angles from row `pose` on, each with its sign."""
    sy, cy = flexion * w[(_SIN + pose) * LANES + j], w[(_COS + pose) * LANES + j]
    sx, cx = abduction * w[(_SIN + pose + 1) * LANES + j], w[(_COS + pose + 1) * LANES + j]
    sz, cz = rotation * w[(_SIN + pose + 2) * LANES + j], w[(_COS + pose + 2) * LANES + j]
    a = _row_turned(r[0], r[1], r[2], sy, cy, sx, cx, sz, cz)
    b = _row_turned(r[3], r[4], r[5], sy, cy, sx, cx, sz, cz)
    c = _row_turned(r[6], r[7], r[8], sy, cy, sx, cx, sz, cz)
    return a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]


@_inline
def _hinged(r, w, j, pose, sign):
    """A hinge with its angle in row `pose`."""
    s, c = sign * w[(_SIN + pose) * LANES + j], w[(_COS + pose) * LANES + j]
    return (
        r[0] * c - r[2] * s, r[1], r[0] * s + r[2] * c,
        r[3] * c - r[5] * s, r[4], r[3] * s + r[5] * c,
        r[6] * c - r[8] * s, r[7], r[6] * s + r[8] * c,
    )  # fmt: skip


@_inline
def _root(w, j):
    """The torso's rotation."""
    sy, cy = w[(_SIN + 3) * LANES + j], w[(_COS + 3) * LANES + j]
    sx, cx = w[(_SIN + 4) * LANES + j], w[(_COS + 4) * LANES + j]
    sz, cz = w[(_SIN + 5) * LANES + j], w[(_COS + 5) * LANES + j]
    return (
        cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy,
        sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy,
        -cx * sy, sx, cx * cy,
    )  # fmt: skip


@_inline
def _rank(c, s):
    """A number that grows with the angle of (c, s) from -π to π."""
    return 1.0 - c if s >= 0.0 else c - 1.0


@_inline
def _foot_turned(shin, z, height):
    """Rotation of the foot: see `motionenv.body.kinematics._turn_foot`, whose angles are unit vectors here."""
    length = math.sqrt(shin[1] * shin[1] + shin[4] * shin[4])
    upright = length > 1e-3
    over = 1.0 / (length if upright else 1.0)
    lx, ly = shin[1] * over, shin[4] * over
    fx, fy = ly, -lx
    c, s = shin[0] * fx + shin[3] * fy, -shin[6]
    size = math.sqrt(c * c + s * s)
    size = size if size > 1e-300 else 1.0
    c, s = c / size, s / size
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
    over_most = _rank(c, s) > _rank(cm, sm)
    c, s = (cm if over_most else c), (sm if over_most else s)
    return (
        fx * c if upright else shin[0], lx if upright else shin[1], fx * s if upright else shin[2],
        fy * c if upright else shin[3], ly if upright else shin[4], fy * s if upright else shin[5],
        -s if upright else shin[6], 0.0 if upright else shin[7], c if upright else shin[8],
    )  # fmt: skip


@_inline
def _segment(w, j, limb, p, r, q, t, shifts, height):
    """Write the ends of drawn limb `limb`, from p to q, with frames r and t."""
    a, b = shifts[limb, 0], shifts[limb, 1]
    _put(w, 6 * limb, j, p, r, a[0] * height, a[1] * height, a[2] * height)
    _put(w, 6 * limb + 3, j, q, t, b[0] * height, b[1] * height, b[2] * height)


@_inline
def _arm(w, j, limb, pose, side, p, torso, nodes, offsets, shifts, height):
    """Write upper arm, forearm and hand."""
    upper = _turned(torso, w, j, pose, -1.0, side, -side)
    lower = _hinged(upper, w, j, pose + 3, _HINGE_ARM)
    elbow = _at(p, upper, offsets[nodes[0]])
    wrist = _at(elbow, lower, offsets[nodes[1]])
    _segment(w, j, limb, p, upper, elbow, upper, shifts, height)
    _segment(w, j, limb + 1, elbow, lower, wrist, lower, shifts, height)
    _segment(w, j, limb + 2, wrist, lower, wrist, lower, shifts, height)


@_inline
def _leg(w, j, limb, pose, side, p, torso, nodes, offsets, shifts, height):
    """Write thigh, shin and foot."""
    upper = _turned(torso, w, j, pose, -1.0, side, -side)
    lower = _hinged(upper, w, j, pose + 3, _HINGE_LEG)
    knee = _at(p, upper, offsets[nodes[0]])
    ankle = _at(knee, lower, offsets[nodes[1]])
    foot = _foot_turned(lower, ankle[2], height)
    _segment(w, j, limb, p, upper, knee, upper, shifts, height)
    _segment(w, j, limb + 1, knee, lower, ankle, lower, shifts, height)
    _segment(w, j, limb + 2, ankle, foot, ankle, foot, shifts, height)


@jit
def _trunk(w, offsets, shifts, height):
    """Write the limbs of torso and head."""
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        neck = _at(p, torso, offsets[15])
        skull = _turned(torso, w, j, 6, 1.0, -1.0, 1.0)
        head = _at(neck, skull, offsets[0])
        left, right = _at(p, torso, offsets[3]), _at(p, torso, offsets[4])
        left_hip, right_hip = _at(p, torso, offsets[9]), _at(p, torso, offsets[10])
        _segment(w, j, 0, p, torso, neck, torso, shifts, height)
        _segment(w, j, 1, left, torso, right, torso, shifts, height)
        _segment(w, j, 2, left_hip, torso, right_hip, torso, shifts, height)
        _segment(w, j, 3, neck, skull, head, skull, shifts, height)
        _segment(w, j, 4, head, skull, head, skull, shifts, height)


@jit
def _arms(w, offsets, shifts, height):
    """Write the limbs of both arms."""
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        _arm(w, j, 5, 9, 1.0, _at(p, torso, offsets[3]), torso, (5, 7), offsets, shifts, height)
        _arm(w, j, 11, 13, -1.0, _at(p, torso, offsets[4]), torso, (6, 8), offsets, shifts, height)


@jit
def _legs(w, offsets, shifts, height):
    """Write the limbs of both legs."""
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        _leg(w, j, 8, 17, 1.0, _at(p, torso, offsets[9]), torso, (11, 13), offsets, shifts, height)
        _leg(w, j, 14, 21, -1.0, _at(p, torso, offsets[10]), torso, (12, 14), offsets, shifts, height)


@jit
def set_limbs(poses, start, offsets, shifts, height, w):
    """Write the limbs' ends [m] of up to `LANES` poses to the first `END_ROWS` rows of `w`.

    Args:
        poses: (n, 25) [m, rad].
        start: the first of them; behind the last, the last is taken again.
        offsets: of the skeleton.
        shifts: (limbs, 2, 3), `LIMB_SHIFTS`.
        height: of the skeleton [m].
        w: (WORK,) to write.
    """
    last = len(poses) - 1
    for j in range(LANES):
        pose = poses[min(start + j, last)]
        for i in range(25):
            w[(_POSE + i) * LANES + j] = pose[i]
    _set_sines(w)
    _trunk(w, offsets, shifts, height)
    _arms(w, offsets, shifts, height)
    _legs(w, offsets, shifts, height)


@jit
def limb_ends(poses, offsets, shifts, height, out):
    """Write the limbs' ends (n, limbs, 2, 3) [m] of poses (n, 25): `motionenv.body.limb_segments`.

    Args:
        poses: [m, rad].
        offsets: of the skeleton.
        shifts: (limbs, 2, 3), `LIMB_SHIFTS`.
        height: of the skeleton [m].
        out: to write.
    """
    w = np.empty(WORK)
    for start in range(0, len(poses), LANES):
        set_limbs(poses, start, offsets, shifts, height, w)
        for j in range(min(LANES, len(poses) - start)):
            body = out[start + j].reshape(-1)
            for row in range(END_ROWS):
                body[row] = w[row * LANES + j]
