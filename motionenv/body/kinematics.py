r"""Forward kinematics of the 25-DOF body (paper A, fig. 1).

A three-DOF joint turns its limb by R = R_y(flexion) R_x(abduction) R_z(rotation): flexion about the axis fixed in
the parent, abduction about the floating axis, rotation about the limb's own length (the joint coordinate system of
Grood & Suntay 1983). Signs are clinical and the same on both sides, so that a symmetric gait has equal numbers left
and right:

    flexion    hip, shoulder, elbow: the limb swings forward; knee: the shin swings back; neck: chin to chest
    abduction  the limb moves away from the midline; neck_bend: towards the left shoulder
    rotation   the front of the limb turns towards the midline; neck_rotation: the face turns left

         zero pose            flexion of hip and knee (seen from the left, walking →)
            O                        O
          --+--                      |
          | | |                      |\_      hip 30°
            +                        +_ \
           / \                       | \
           | |                       |  |     knee 20°
           | |                       |  /

The root is turned by R_z(heading) R_x(obliquity) R_y(tilt) (Baker 2001: rotation, obliquity, tilt): heading
turns left, obliquity lifts the left side, tilt leans forward. The paper's limb frames, whose z points along the
limb, are these frames times diag(1, -1, -1) for arms and legs.
"""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.body.skeleton import ANKLE_HEIGHT, LIMB_NODES, LIMB_SEGMENT, LIMB_SHIFTS, LIMBS, NODES, SEGMENTS
from motionenv.errors import MotionError
from motionenv.types import Skeleton

# Tree: torso nodes; then per limb (pose index, signs of flexion/abduction/rotation, nodes, segments).
_TORSO_NODES = np.array([NODES.index(n) for n in (*NODES[1:5], "left_hip", "right_hip", "neck")])
_BALL_POSE = np.array([9, 13, 17, 21])
_BALL_SIGN = np.array([[-1, 1, -1], [-1, -1, 1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
#: Signs of flexion in the two elbows and the two knees.
HINGE_SIGN = np.array([-1.0, -1.0, 1.0, 1.0])
_CHAIN_NODES = np.array([[3, 5, 7], [4, 6, 8], [9, 11, 13], [10, 12, 14]])
_HEAD, _NECK, _PELVIS = NODES.index("head"), NODES.index("neck"), NODES.index("pelvis")
_FOOT = LIMB_SHIFTS[LIMBS.index("left_foot")]  # heel and toe in the foot's frame, relative to body height

#: Ball of the foot in the foot's frame, relative to the ankle and in units of body height.
FOOT_BALL = _FOOT[1]


def forward(poses, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics.

    Args:
        poses: (..., 25) [m, rad], in the order of `motionenv.types.POSE`.
        skeleton: the body.

    Returns:
        Node positions (..., 16, 3) [m] in the order of `NODES`, and rotations segment → world (..., 12, 3, 3) in the
        order of `SEGMENTS`. NaN in a pose propagates only to what depends on it.

    Raises:
        MotionError: the last axis of `poses` isn't 25 long.
    """
    flat, lead = _flat(poses)
    nodes = np.empty((len(flat), len(NODES), 3))
    rotations = np.empty((len(flat), len(SEGMENTS), 3, 3))
    _forward(flat, skeleton.offsets, skeleton.height, nodes, rotations)
    return nodes.reshape(*lead, *nodes.shape[1:]), rotations.reshape(*lead, *rotations.shape[1:])


def markers(poses, skeleton: Skeleton) -> np.ndarray:
    """The 15 markers (..., 15, 3) [m] of poses (..., 25), in the order of `motionenv.types.MARKERS`.

    Args:
        poses: (..., 25) [m, rad].
        skeleton: the body.
    """
    return forward(poses, skeleton)[0][..., :15, :]


def limb_segments(poses, skeleton: Skeleton) -> np.ndarray:
    """End points of the axes of the drawn limbs.

    Feet have no degrees of freedom: they follow the shin without lateral tilt, and flex at the ankle so that the toe
    stays above the ground z = 0, and the heel too if the ankle is high enough.

    Args:
        poses: (..., 25) [m, rad].
        skeleton: the body.

    Returns:
        (..., limbs, 2, 3) [m], in the order of `LIMBS`.
    """
    flat, lead = _flat(poses)
    ends = np.empty((len(flat), len(LIMBS), 2, 3))
    write_limb_segments(flat, skeleton.offsets, skeleton.height, LIMB_SEGMENT, LIMB_NODES, LIMB_SHIFTS, ends)
    return ends.reshape(*lead, *ends.shape[1:])


def feet(poses, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the feet, as from `forward` but faster.

    Args:
        poses: (..., 25) [m, rad].
        skeleton: the body.

    Returns:
        Ankles and balls of the feet, (..., 2, 3) [m] each, left then right.
    """
    flat, lead = _flat(poses)
    ankles, balls = np.empty((2, len(flat), 2, 3))
    feet_of(flat, skeleton.offsets, skeleton.height, ankles, balls)
    return ankles.reshape(*lead, 2, 3), balls.reshape(*lead, 2, 3)


def _flat(poses) -> tuple[np.ndarray, tuple]:
    """Poses as a contiguous (n, 25) array, and their leading axes."""
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim == 0 or poses.shape[-1] != 25:
        raise MotionError(f"poses must have shape (..., 25), got {poses.shape}")
    return np.ascontiguousarray(poses.reshape(-1, 25)), poses.shape[:-1]


@kernel
def _turn(parent, flexion, abduction, rotation, out):
    """Write parent · R_y(flexion) R_x(abduction) R_z(rotation) to `out`."""
    cy, sy = np.cos(flexion), np.sin(flexion)
    cx, sx = np.cos(abduction), np.sin(abduction)
    cz, sz = np.cos(rotation), np.sin(rotation)
    for i in range(3):
        a, b, c = parent[i, 0], parent[i, 1], parent[i, 2]
        p, q = a * cy - c * sy, a * sy + c * cy
        r, s = b * cx + q * sx, q * cx - b * sx
        out[i, 0] = p * cz + r * sz
        out[i, 1] = r * cz - p * sz
        out[i, 2] = s


@kernel
def _hinge(parent, flexion, out):
    """Write parent · R_y(flexion) to `out`."""
    c, s = np.cos(flexion), np.sin(flexion)
    for i in range(3):
        out[i, 0] = parent[i, 0] * c - parent[i, 2] * s
        out[i, 1] = parent[i, 1]
        out[i, 2] = parent[i, 0] * s + parent[i, 2] * c


@kernel
def _place(base, rotation, offset, out):
    """Write base + rotation · offset to `out`."""
    for i in range(3):
        out[i] = base[i] + rotation[i, 0] * offset[0] + rotation[i, 1] * offset[1] + rotation[i, 2] * offset[2]


@kernel
def _root(pose, out):
    """Write R_z(heading) R_x(obliquity) R_y(tilt) to `out`."""
    cy, sy = np.cos(pose[3]), np.sin(pose[3])
    cx, sx = np.cos(pose[4]), np.sin(pose[4])
    cz, sz = np.cos(pose[5]), np.sin(pose[5])
    out[0, 0], out[0, 1], out[0, 2] = cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy
    out[1, 0], out[1, 1], out[1, 2] = sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy
    out[2, 0], out[2, 1], out[2, 2] = -cx * sy, sx, cx * cy


@kernel
def _turn_foot(shin, ankle, height, out):
    """Write the rotation of a foot that follows `shin` but stays above the ground (see `limb_segments`)."""
    length = np.hypot(shin[0, 1], shin[1, 1])
    if not length > 1e-3:  # the shin's lateral axis is vertical: no horizontal direction is defined
        out[:] = shin
        return
    lx, ly = shin[0, 1] / length, shin[1, 1] / length  # left, level
    fx, fy = ly, -lx  # forward, level
    down = np.arctan2(-shin[2, 0], shin[0, 0] * fx + shin[1, 0] * fy)  # toe-down angle if rigid with the shin
    # The ankle's height above its height in stance limits how far the toe may drop: with the toe's centre at (a, -b) in
    # the foot's frame it drops by a·sin + b·cos - b; likewise the heel, at (-a', -b'), for toe-up angles.
    free = ankle[2] - ANKLE_HEIGHT * height
    a, b = _FOOT[1, 0] * height, -_FOOT[1, 2] * height
    most = np.arcsin(min(1.0, max(-1.0, (free + b) / np.hypot(a, b)))) - np.arctan2(b, a)
    a, b = -_FOOT[0, 0] * height, -_FOOT[0, 2] * height
    least = np.arctan2(b, a) - np.arcsin(min(1.0, max(-1.0, (free + b) / np.hypot(a, b))))
    down = min(max(down, min(least, 0.0)), max(most, -0.3))
    c, s = np.cos(down), np.sin(down)
    out[0, 0], out[0, 1], out[0, 2] = fx * c, lx, fx * s
    out[1, 0], out[1, 1], out[1, 2] = fy * c, ly, fy * s
    out[2, 0], out[2, 1], out[2, 2] = -s, 0.0, c


@kernel
def _nodes_one(pose, offsets, nodes, rotations):
    """Nodes (16, 3) of one pose (25,), and all rotations except those of the feet."""
    torso, head = rotations[0], rotations[1]
    _root(pose, torso)
    nodes[_PELVIS] = pose[:3]
    for n in _TORSO_NODES:
        _place(pose[:3], torso, offsets[n], nodes[n])
    _turn(torso, pose[6], -pose[7], pose[8], head)
    _place(nodes[_NECK], head, offsets[_HEAD], nodes[_HEAD])
    for i in range(4):
        at = _BALL_POSE[i]
        upper, lower = rotations[2 + 2 * i], rotations[3 + 2 * i]
        sign, (proximal, middle, distal) = _BALL_SIGN[i], _CHAIN_NODES[i]
        _turn(torso, sign[0] * pose[at], sign[1] * pose[at + 1], sign[2] * pose[at + 2], upper)
        _hinge(upper, HINGE_SIGN[i] * pose[at + 3], lower)
        _place(nodes[proximal], upper, offsets[middle], nodes[middle])
        _place(nodes[middle], lower, offsets[distal], nodes[distal])


@kernel
def _forward_one(pose, offsets, height, nodes, rotations):
    """Nodes (16, 3) and rotations (12, 3, 3) of one pose (25,)."""
    _nodes_one(pose, offsets, nodes, rotations)
    _turn_foot(rotations[7], nodes[13], height, rotations[10])
    _turn_foot(rotations[9], nodes[14], height, rotations[11])


@kernel
def _forward(poses, offsets, height, nodes, rotations):
    for i in range(len(poses)):
        _forward_one(poses[i], offsets, height, nodes[i], rotations[i])


@kernel
def feet_of(poses, offsets, height, ankles, balls):
    """Write ankles and balls (n, 2, 3) of poses (n, 25): `feet` for other kernels."""
    torso, thigh, shin, foot = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    hip, knee, ball = np.empty(3), np.empty(3), _FOOT[1] * height
    for k in range(len(poses)):
        pose = poses[k]
        _root(pose, torso)
        for side in range(2):
            at, sign, (first, middle, last) = _BALL_POSE[2 + side], _BALL_SIGN[2 + side], _CHAIN_NODES[2 + side]
            _place(pose[:3], torso, offsets[first], hip)
            _turn(torso, sign[0] * pose[at], sign[1] * pose[at + 1], sign[2] * pose[at + 2], thigh)
            _place(hip, thigh, offsets[middle], knee)
            _hinge(thigh, HINGE_SIGN[2 + side] * pose[at + 3], shin)
            _place(knee, shin, offsets[last], ankles[k, side])
            _turn_foot(shin, ankles[k, side], height, foot)
            _place(ankles[k, side], foot, ball, balls[k, side])


@kernel
def write_limb_segments(poses, offsets, height, segment, ends_at, shifts, out):
    """Write the ends (n, limbs, 2, 3) of all limbs of poses (n, 25): `limb_segments`, for other compiled loops."""
    nodes = np.empty((16, 3))
    rotations = np.empty((12, 3, 3))
    for i in range(len(poses)):
        _forward_one(poses[i], offsets, height, nodes, rotations)
        for limb in range(len(segment)):
            for end in range(2):
                _place(
                    nodes[ends_at[limb, end]], rotations[segment[limb]], shifts[limb, end] * height, out[i, limb, end]
                )
