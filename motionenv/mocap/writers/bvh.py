"""BVH writer: the 25-DOF body as a hierarchy with Mixamo's joint names, in centimetres, y up, facing z.

The channels are the pose vector itself: R_y(flexion) R_x(abduction) R_z(rotation) about the world's axes is R_X R_Z R_Y
about the file's (X, Y, Z) = (y, z, x), hence "Xrotation Zrotation Yrotation", and the root's R_z(heading)
R_x(obliquity) R_y(tilt) is "Yrotation Zrotation Xrotation".
"""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from motionenv._core.rotations import to_euler, unwrap_euler
from motionenv.body.kinematics import forward
from motionenv.body.limbs import LIMBS, limb_shifts
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.mocap.writers.common import (
    check_sequence,
    local_rotations,
    shown_segments,
    text_rows,
    without_missing,
    y_up,
)  # fmt: skip
from motionenv.types import POSE, Motion, Skeleton

_CM = 100.0
_ROOT_CHANNELS = "CHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation Xrotation"
_CHANNELS = "CHANNELS 3 Xrotation Zrotation Yrotation"

_LEGS = {"{}UpLeg": ("Hips", "{}_hip"), "{}Leg": ("{}UpLeg", "{}_knee"), "{}Foot": ("{}Leg", "{}_ankle")}
_ARMS = {"{}Arm": ("Spine2", "{}_shoulder"), "{}ForeArm": ("{}Arm", "{}_elbow"), "{}Hand": ("{}ForeArm", "{}_wrist")}


def _sided(table: dict[str, tuple[str, str]], side: str) -> dict[str, tuple[str, str]]:
    word = side.title()
    return {joint.format(word): (parent.format(word), node.format(side)) for joint, (parent, node) in table.items()}


#: Joints in the order of the file, with parent and corresponding node of the body. Mixamo's Head is midway between the
#: neck and the head's centre.
_JOINTS = {
    "Hips": ("", "pelvis"), "Spine2": ("Hips", "sternum"), "Neck": ("Spine2", "neck"), "Head": ("Neck", "head"),
    **_sided(_ARMS, "left"), **_sided(_ARMS, "right"), **_sided(_LEGS, "left"), **_sided(_LEGS, "right"),
}  # fmt: skip

#: Joints with an end site, at the tip of a drawn limb.
_TIPS = {
    "Head": "head",
    "LeftHand": "left_hand", "RightHand": "right_hand",
    "LeftFoot": "left_foot", "RightFoot": "right_foot",
}  # fmt: skip

#: The segment that tells where a joint is, or how it turns: without it the joint is left out of the file.
_SEGMENT = {
    "Hips": "torso", "Spine2": "torso", "Neck": "head", "Head": "head",
    **{f"{s.title()}{joint}": f"{s}_{segment}" for s in ("left", "right") for joint, segment in (
        ("Arm", "upper_arm"), ("ForeArm", "forearm"), ("Hand", "forearm"),
        ("UpLeg", "thigh"), ("Leg", "shin"), ("Foot", "foot"),
    )},
}  # fmt: skip


def encode(motion: Motion) -> Iterator[bytes]:
    """The bytes of a BVH file, a few hundred frames of the sequence (frames, 25) at a time.

    `motionenv.mocap.read` reads the joints back. Feet are rotated as drawn (see `motionenv.body.limb_segments`),
    although they have no entry in the pose vector. Limbs that are missing in every frame are left out of the hierarchy,
    and the joint that would carry them ends in an end site there: a lower body is Hips, Spine2 and the legs.

    Raises:
        GapError: `motion` has gaps in time, which the format can't represent.
        MotionError: not one sequence.
    """
    check_sequence(motion, "BVH", gaps=False)
    known = shown_segments(motion.poses)
    joints = [joint for joint in _JOINTS if known[SEGMENTS.index(_SEGMENT[joint])]]
    motion = without_missing(motion)
    head = ["HIERARCHY", *_block("Hips", _rest(motion.skeleton), joints), "MOTION"]
    head += [f"Frames: {len(motion.poses)}", f"Frame Time: {1 / motion.fps:.17g}"]
    values = _channels(motion, joints)
    row = " ".join(["%.6f"] * values.shape[1]) + "\n"
    first = "".join(f"{line}\n" for line in head).encode()
    return chain([first], text_rows(values, 6, lambda _, frame: row % tuple(frame)))


def _rest(skeleton: Skeleton) -> dict[str, np.ndarray]:
    """Position of each joint, and of the tip behind it ("Head tip"), in the zero pose (3,) [cm], in the file's axes."""
    nodes = dict(zip(NODES, forward(np.zeros(25), skeleton)[0], strict=True))
    rest = {joint: nodes[node] for joint, (_, node) in _JOINTS.items()}
    for joint, limb in _TIPS.items():
        start, end = limb_shifts(skeleton)[LIMBS.index(limb)]
        radius = skeleton.radii[LIMBS.index(limb), 1]
        rest[f"{joint} tip"] = rest[joint] + end + radius * (end - start) / np.linalg.norm(end - start)
    rest["Head"] = 0.5 * (nodes["neck"] + nodes["head"])
    return {name: _CM * y_up(point) for name, point in rest.items()}


def _block(joint: str, rest: dict[str, np.ndarray], joints: list[str]) -> list[str]:
    """The lines of a joint and those of its descendants that are among `joints`."""
    parent = _JOINTS[joint][0]
    inner = [_offset(rest[joint] - rest[parent] if parent else np.zeros(3)), _CHANNELS if parent else _ROOT_CHANNELS]
    below = [child for child, (above, _) in _JOINTS.items() if above == joint]
    for child in below:
        if child in joints:
            inner += _block(child, rest, joints)
    if not set(below) & set(joints):
        end = below[0] if below else f"{joint} tip"
        inner += ["End Site", "{", "\t" + _offset(rest[end] - rest[joint]), "}"]
    return [f"{'JOINT' if parent else 'ROOT'} {joint}", "{", *(f"\t{line}" for line in inner), "}"]


def _offset(point: np.ndarray) -> str:
    return "OFFSET " + " ".join(f"{x:.6f}" for x in np.round(point, 6) + 0.0)


def _channels(motion: Motion, joints: list[str]) -> np.ndarray:
    turns = _turns(motion)
    at_rest = np.zeros((len(motion.poses), 3))
    rotations = np.degrees([turns.get(joint, at_rest) for joint in joints])
    return np.concatenate([_CM * y_up(motion.poses[:, :3]), *rotations], axis=1)


def _turns(motion: Motion) -> dict[str, np.ndarray]:
    """Angles (frames, 3) [rad] of the rotating joints, in the order of their channels."""
    entry = dict(zip(POSE, motion.poses.T, strict=True))
    zero = np.zeros(len(motion.poses))
    local = local_rotations(motion)
    turns = {
        "Hips": [entry["root_heading"], entry["root_obliquity"], entry["root_tilt"]],
        "Neck": [entry["neck_flexion"], -entry["neck_bend"], entry["neck_rotation"]],
    }
    for side, out in (("left", 1.0), ("right", -1.0)):
        word = side.title()
        for joint, node in (("Arm", "shoulder"), ("UpLeg", "hip")):
            flexion, abduction, rotation = (entry[f"{side}_{node}_{a}"] for a in ("flexion", "abduction", "rotation"))
            turns[word + joint] = [-flexion, out * abduction, -out * rotation]
        turns[f"{word}ForeArm"] = [-entry[f"{side}_elbow_flexion"], zero, zero]
        turns[f"{word}Leg"] = [entry[f"{side}_knee_flexion"], zero, zero]
        turns[f"{word}Foot"] = list(unwrap_euler(to_euler("YXZ", local[:, SEGMENTS.index(f"{side}_foot")])).T)
    return {joint: np.stack(angles, axis=-1) for joint, angles in turns.items()}
