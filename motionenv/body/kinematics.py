r"""Forward kinematics of the 25-DOF body (paper A, fig. 1).

A three-DOF joint turns its limb by R = R_y(flexion) R_x(abduction) R_z(rotation): flexion about the axis fixed in the
parent, abduction about the floating axis, rotation about the limb's own length (the joint coordinate system of Grood &
Suntay 1983). Signs are clinical and the same on both sides, so that a symmetric gait has equal numbers left and right:

    flexion    hip, shoulder, elbow: the limb swings forward; knee: the shin swings back; neck: chin to chest
    abduction  the limb moves away from the midline; neck_bend: towards the left shoulder
    rotation   the front of the limb turns towards the midline; neck_rotation: the face turns left

         zero pose            flexion of hip and knee (seen from the right, walking →)
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

import math

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.body.gaps import known_markers
from motionenv.body.limbs import LIMB_NODES, LIMB_SEGMENT, LIMB_SHIFTS, LIMBS, limb_shifts
from motionenv.body.simd import foot_rotation, hinged, placed, root_rotation, turned
from motionenv.body.skeleton import NODES, SEGMENTS
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


def forward(poses: np.ndarray, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics of `poses` (..., 25) [m, rad] of a `skeleton`, in the order of `motionenv.types.POSE`.

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


def markers(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """The 15 markers (..., 15, 3) [m] of `poses` (..., 25) of a `skeleton`, ordered as `motionenv.types.MARKERS`."""
    return forward(poses, skeleton)[0][..., :15, :]


def shown_markers(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """`markers`, but NaN also where a limb that `poses` (..., 25) don't show carries them on a `skeleton`."""
    return np.where(known_markers(poses)[..., None], markers(poses, skeleton), np.nan)


def limb_segments(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """End points (..., limbs, 2, 3) [m] of the axes of the drawn `LIMBS` of `poses` (..., 25) of a `skeleton`.

    Feet have no degrees of freedom: they follow the shin without lateral tilt, and flex at the ankle so that the toe
    stays above the ground z = 0, and the heel too if the ankle is high enough.
    """
    flat, lead = _flat(poses)
    ends = np.empty((len(flat), len(LIMBS), 2, 3))
    _limbs(flat, skeleton.offsets, skeleton.height, LIMB_SEGMENT, LIMB_NODES, limb_shifts(skeleton), ends)
    return ends.reshape(*lead, *ends.shape[1:])


def feet(poses: np.ndarray, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Ankles and balls of the feet, left then right, (..., 2, 3) [m] each, of `poses` (..., 25) of a `skeleton`.

    As from `forward` but faster.
    """
    flat, lead = _flat(poses)
    ankles, balls = np.empty((2, len(flat), 2, 3))
    _feet(flat, skeleton.offsets, skeleton.height, ankles, balls)
    return ankles.reshape(*lead, 2, 3), balls.reshape(*lead, 2, 3)


def _flat(poses) -> tuple[np.ndarray, tuple]:
    """Poses as a contiguous (n, 25) array, read-only so that each kernel has one version, and their leading axes."""
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim == 0 or poses.shape[-1] != 25:
        raise MotionError(f"poses must have shape (..., 25), got {poses.shape}")
    flat = np.ascontiguousarray(poses.reshape(-1, 25)).view()
    flat.flags.writeable = False
    return flat, poses.shape[:-1]


@part
def _torso(pose):
    """Rotation R_z(heading) R_x(obliquity) R_y(tilt) of the torso."""
    tilt, obliquity, heading = pose[3], pose[4], pose[5]
    return root_rotation(
        math.sin(tilt), math.cos(tilt), math.sin(obliquity), math.cos(obliquity), math.sin(heading), math.cos(heading)
    )


@part
def _ball(parent, flexion, abduction, rotation):
    """Rotation of the limb beyond a three-DOF joint."""
    return turned(
        parent, math.sin(flexion), math.cos(flexion), math.sin(abduction), math.cos(abduction), math.sin(rotation),
        math.cos(rotation),
    )  # fmt: skip


@part
def _limb(parent, pose, limb):
    """Rotations of both segments of a limb."""
    at = _BALL_POSE[limb]
    flexion, abduction, rotation = _BALL_SIGN[limb, 0], _BALL_SIGN[limb, 1], _BALL_SIGN[limb, 2]
    upper = _ball(parent, flexion * pose[at], abduction * pose[at + 1], rotation * pose[at + 2])
    bend = HINGE_SIGN[limb] * pose[at + 3]
    return upper, hinged(upper, math.sin(bend), math.cos(bend))


@part
def _row(rows, i):
    """A row of an array (..., 3) as three numbers."""
    return rows[i, 0], rows[i, 1], rows[i, 2]


@part
def _put(point, rows, i):
    """Write a point to row i of an array (..., 3)."""
    rows[i, 0], rows[i, 1], rows[i, 2] = point


@part
def _rotation(rotations, i):
    """Rotation i of an array (..., 3, 3) as nine numbers."""
    r = rotations[i]
    return r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]


@part
def _put_rotation(rotation, rotations, i):
    """Write a rotation to `rotations` (..., 3, 3) at i."""
    for k in range(3):
        for j in range(3):
            rotations[i, k, j] = rotation[3 * k + j]


@part
def write_nodes(pose, offsets, nodes, rotations):
    """Write the nodes (16, 3) of one pose (25,), and all rotations (12, 3, 3) except those of the feet."""
    root, torso = (pose[0], pose[1], pose[2]), _torso(pose)
    _put(root, nodes, _PELVIS)
    _put_rotation(torso, rotations, 0)
    for n in _TORSO_NODES:
        _put(placed(root, torso, _row(offsets, n)), nodes, n)
    head = _ball(torso, pose[6], -pose[7], pose[8])
    _put_rotation(head, rotations, 1)
    _put(placed(_row(nodes, _NECK), head, _row(offsets, _HEAD)), nodes, _HEAD)
    for i in range(4):
        proximal, middle, distal = _CHAIN_NODES[i, 0], _CHAIN_NODES[i, 1], _CHAIN_NODES[i, 2]
        upper, lower = _limb(torso, pose, i)
        _put_rotation(upper, rotations, 2 + 2 * i)
        _put_rotation(lower, rotations, 3 + 2 * i)
        joint = placed(_row(nodes, proximal), upper, _row(offsets, middle))
        _put(joint, nodes, middle)
        _put(placed(joint, lower, _row(offsets, distal)), nodes, distal)


@part
def _forward_one(pose, offsets, height, nodes, rotations):
    """Write nodes (16, 3) and rotations (12, 3, 3) of one pose (25,)."""
    write_nodes(pose, offsets, nodes, rotations)
    for side in range(2):
        shin = _rotation(rotations, 7 + 2 * side)
        _put_rotation(foot_rotation(shin, nodes[13 + side, 2], height), rotations, 10 + side)


@kernel
def _forward(poses, offsets, height, nodes, rotations):
    for i in range(len(poses)):
        _forward_one(poses[i], offsets, height, nodes[i], rotations[i])


@kernel
def _feet(poses, offsets, height, ankles, balls):
    feet_of(poses, offsets, height, ankles, balls)


@part
def feet_of(poses, offsets, height, ankles, balls):
    """Write ankles and balls (n, 2, 3) of poses (n, 25): `feet` for other kernels."""
    ball = _FOOT[1, 0] * height, _FOOT[1, 1] * height, _FOOT[1, 2] * height
    for k in range(len(poses)):
        pose = poses[k]
        root, torso = (pose[0], pose[1], pose[2]), _torso(pose)
        for side in range(2):
            first, middle, last = _CHAIN_NODES[2 + side, 0], _CHAIN_NODES[2 + side, 1], _CHAIN_NODES[2 + side, 2]
            thigh, shin = _limb(torso, pose, 2 + side)
            knee = placed(placed(root, torso, _row(offsets, first)), thigh, _row(offsets, middle))
            ankle = placed(knee, shin, _row(offsets, last))
            _put(ankle, ankles[k], side)
            _put(placed(ankle, foot_rotation(shin, ankle[2], height), ball), balls[k], side)


@kernel
def _limbs(poses, offsets, height, segment, ends_at, shifts, out):
    write_limb_segments(poses, offsets, height, segment, ends_at, shifts, out)


@part
def write_limb_segments(poses, offsets, height, segment, ends_at, shifts, out):
    """Write the ends (n, limbs, 2, 3) of all limbs of poses (n, 25): `limb_segments`, for other kernels.

    `shifts` (limbs, 2, 3) [m] are `motionenv.body.limbs.limb_shifts`.
    """
    nodes = np.empty((16, 3))
    rotations = np.empty((12, 3, 3))
    for i in range(len(poses)):
        _forward_one(poses[i], offsets, height, nodes, rotations)
        for limb in range(len(segment)):
            rotation = _rotation(rotations, segment[limb])
            for end in range(2):
                point = placed(_row(nodes, ends_at[limb, end]), rotation, _row(shifts[limb], end))
                _put(point, out[i, limb], end)
