"""SIMD forward kinematics of limb ends: `motionenv.body.limb_segments` eight times as fast.

The body is the last axis: data are rows of `LANES` numbers in one flat array, and row numbers are compile-time
constants, so that each loop over bodies becomes SIMD instructions (`motionenv.body.simd`).
"""

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.body.kinematics import HINGE_SIGN
from motionenv.body.limbs import LIMBS
from motionenv.body.simd import foot_rotation, hinged, placed, root_rotation, sine_cosine, turned

_inline = part(forceinline=True)

#: Bodies in a block.
LANES = 32
#: Rows of the limb ends, (limbs, 2, 3), in a block's array; poses, sines and cosines follow.
END_ROWS = 6 * len(LIMBS)
_POSE, _SIN, _COS = END_ROWS, END_ROWS + 25, END_ROWS + 50
#: Length of a block's array.
WORK = (END_ROWS + 75) * LANES

_HINGE_ARM, _HINGE_LEG = float(HINGE_SIGN[0]), float(HINGE_SIGN[2])


@part
def _set_sines(w):
    """Write sines and cosines of the angles of a block."""
    for j in range(25 * LANES):
        w[_SIN * LANES + j], w[_COS * LANES + j] = sine_cosine(w[_POSE * LANES + j])


@_inline
def _put(w, row, j, p, r, x, y, z):
    """Write p + r · (x, y, z) to three rows."""
    w[row * LANES + j] = p[0] + r[0] * x + r[1] * y + r[2] * z
    w[(row + 1) * LANES + j] = p[1] + r[3] * x + r[4] * y + r[5] * z
    w[(row + 2) * LANES + j] = p[2] + r[6] * x + r[7] * y + r[8] * z


@_inline
def _turned(r, w, j, pose, flexion, abduction, rotation):
    """Rotation of a ball joint whose three angles start at row `pose`, each with its sign."""
    sy, cy = flexion * w[(_SIN + pose) * LANES + j], w[(_COS + pose) * LANES + j]
    sx, cx = abduction * w[(_SIN + pose + 1) * LANES + j], w[(_COS + pose + 1) * LANES + j]
    sz, cz = rotation * w[(_SIN + pose + 2) * LANES + j], w[(_COS + pose + 2) * LANES + j]
    return turned(r, sy, cy, sx, cx, sz, cz)


@_inline
def _hinged(r, w, j, pose, sign):
    """Rotation of a hinge joint with its angle in row `pose`."""
    return hinged(r, sign * w[(_SIN + pose) * LANES + j], w[(_COS + pose) * LANES + j])


@_inline
def _root(w, j):
    sy, cy = w[(_SIN + 3) * LANES + j], w[(_COS + 3) * LANES + j]
    sx, cx = w[(_SIN + 4) * LANES + j], w[(_COS + 4) * LANES + j]
    sz, cz = w[(_SIN + 5) * LANES + j], w[(_COS + 5) * LANES + j]
    return root_rotation(sy, cy, sx, cx, sz, cz)


@_inline
def _segment(w, j, limb, p, r, q, t, shifts):
    """Write the ends of limb `limb`, from p to q, with frames r and t."""
    a, b = shifts[limb, 0], shifts[limb, 1]
    _put(w, 6 * limb, j, p, r, a[0], a[1], a[2])
    _put(w, 6 * limb + 3, j, q, t, b[0], b[1], b[2])


@_inline
def _arm(w, j, limb, pose, side, p, torso, nodes, offsets, shifts):
    upper = _turned(torso, w, j, pose, -1.0, side, -side)
    lower = _hinged(upper, w, j, pose + 3, _HINGE_ARM)
    elbow = placed(p, upper, offsets[nodes[0]])
    wrist = placed(elbow, lower, offsets[nodes[1]])
    _segment(w, j, limb, p, upper, elbow, upper, shifts)
    _segment(w, j, limb + 1, elbow, lower, wrist, lower, shifts)
    _segment(w, j, limb + 2, wrist, lower, wrist, lower, shifts)


@_inline
def _leg(w, j, limb, pose, side, p, torso, nodes, offsets, shifts, height):
    upper = _turned(torso, w, j, pose, -1.0, side, -side)
    lower = _hinged(upper, w, j, pose + 3, _HINGE_LEG)
    knee = placed(p, upper, offsets[nodes[0]])
    ankle = placed(knee, lower, offsets[nodes[1]])
    foot = foot_rotation(lower, ankle[2], height)
    _segment(w, j, limb, p, upper, knee, upper, shifts)
    _segment(w, j, limb + 1, knee, lower, ankle, lower, shifts)
    _segment(w, j, limb + 2, ankle, foot, ankle, foot, shifts)


@part
def _trunk(w, offsets, shifts):
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        neck = placed(p, torso, offsets[15])
        skull = _turned(torso, w, j, 6, 1.0, -1.0, 1.0)
        head = placed(neck, skull, offsets[0])
        left, right = placed(p, torso, offsets[3]), placed(p, torso, offsets[4])
        left_hip, right_hip = placed(p, torso, offsets[9]), placed(p, torso, offsets[10])
        _segment(w, j, 0, p, torso, neck, torso, shifts)
        _segment(w, j, 1, p, torso, neck, torso, shifts)
        _segment(w, j, 2, neck, torso, left, torso, shifts)
        _segment(w, j, 3, neck, torso, right, torso, shifts)
        _segment(w, j, 4, left_hip, torso, right_hip, torso, shifts)
        _segment(w, j, 5, neck, skull, head, skull, shifts)
        _segment(w, j, 6, head, skull, head, skull, shifts)
        _segment(w, j, 19, head, skull, head, skull, shifts)
        _segment(w, j, 20, head, skull, head, skull, shifts)
        _segment(w, j, 21, head, skull, head, skull, shifts)


@part
def _arms(w, offsets, shifts):
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        _arm(w, j, 7, 9, 1.0, placed(p, torso, offsets[3]), torso, (5, 7), offsets, shifts)
        _arm(w, j, 13, 13, -1.0, placed(p, torso, offsets[4]), torso, (6, 8), offsets, shifts)


@part
def _legs(w, offsets, shifts, height):
    for j in range(LANES):
        p = (w[_POSE * LANES + j], w[(_POSE + 1) * LANES + j], w[(_POSE + 2) * LANES + j])
        torso = _root(w, j)
        _leg(w, j, 10, 17, 1.0, placed(p, torso, offsets[9]), torso, (11, 13), offsets, shifts, height)
        _leg(w, j, 16, 21, -1.0, placed(p, torso, offsets[10]), torso, (12, 14), offsets, shifts, height)


@part
def set_limbs(poses, start, offsets, shifts, height, w):
    """Write the limb ends [m] of up to `LANES` poses from `start` on to the first `END_ROWS` rows of `w` (WORK,).

    The last pose is repeated to fill the block. Poses and body are given as in `limb_ends`.
    """
    last = len(poses) - 1
    for j in range(LANES):
        pose = poses[min(start + j, last)]
        for i in range(25):
            w[(_POSE + i) * LANES + j] = pose[i]
    _set_sines(w)
    _trunk(w, offsets, shifts)
    _arms(w, offsets, shifts)
    _legs(w, offsets, shifts, height)


@kernel
def limb_ends(poses, offsets, shifts, height, out):
    """Write the limb ends (n, limbs, 2, 3) [m] of poses (n, 25) [m, rad]: `motionenv.body.limb_segments`.

    `offsets` and `height` [m] are the skeleton's; `shifts` (limbs, 2, 3) [m] are `limb_shifts`.
    """
    w = np.empty(WORK)
    for start in range(0, len(poses), LANES):
        set_limbs(poses, start, offsets, shifts, height, w)
        for j in range(min(LANES, len(poses) - start)):
            body = out[start + j].reshape(-1)
            for row in range(END_ROWS):
                body[row] = w[row * LANES + j]
