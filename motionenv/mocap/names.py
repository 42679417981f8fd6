"""Naming schemes: which source points form the nodes of the body.

For every node of `motionenv.body.NODES`, a table gives the source points and their weights, which sum to one: two
points with 0.5 each are a midpoint, and {"Head": 2, "Neck": -1} extrapolates the line from neck to head by its length.
"""

from collections.abc import Iterable

from motionenv.types import MARKERS


def _mid(*names: str) -> dict[str, float]:
    """Equal weights."""
    return dict.fromkeys(names, 1.0 / len(names))


def _sides(**table: str) -> dict[str, dict[str, float]]:
    """Left and right nodes from patterns in which {} is the source's word for the side: hip="{}UpLeg"."""
    left, right = table.pop("left"), table.pop("right")
    pairs = (("left", left), ("right", right))
    return {f"{side}_{node}": {name.format(word): 1.0} for node, name in table.items() for side, word in pairs}


#: CMU's ASF/AMC: a point is named after the bone that ends there. The forearm is two bones, radius and wrist.
_CMU = {
    "head": _mid("head"),
    "neck": _mid("lowerneck"),
    "sternum": _mid("thorax"),
    "pelvis": _mid("lhipjoint", "rhipjoint"),
    **_sides(
        left="l", right="r", shoulder="{}clavicle", elbow="{}humerus", wrist="{}wrist",
        hip="{}hipjoint", knee="{}femur", ankle="{}tibia",
    ),
}  # fmt: skip

_LIMB_JOINTS = _sides(
    left="Left", right="Right", shoulder="{}Arm", elbow="{}ForeArm", wrist="{}Hand",
    hip="{}UpLeg", knee="{}Leg", ankle="{}Foot",
)  # fmt: skip

#: CMU's BVH conversions: a joint is the start of its bone. The lengths of branching bones are lost: the thorax, so that
#: everything above is lower by about one spine bone, and the last third of the forearm.
_CMU_BVH = {
    "pelvis": _mid("LeftUpLeg", "RightUpLeg"),
    **_LIMB_JOINTS,
    **{
        node: {**weights, "Spine1": 1.0, "Spine": -1.0}
        for node, weights in {
            "head": _mid("Head_end"),
            "neck": _mid("Neck1"),
            "sternum": _mid("Neck"),
            **_sides(left="Left", right="Right", shoulder="{}Arm", elbow="{}ForeArm"),
            "left_wrist": {"LeftHand": 1.5, "LeftForeArm": -0.5},
            "right_wrist": {"RightHand": 1.5, "RightForeArm": -0.5},
        }.items()
    },
}

#: Mixamo and compatible rigs; the prefix "mixamorig:" is removed.
_MIXAMO = {
    "head": {"Head": 2.0, "Neck": -1.0},
    "neck": _mid("Neck"),
    "sternum": _mid("Spine2"),
    "pelvis": _mid("LeftUpLeg", "RightUpLeg"),
    **_LIMB_JOINTS,
}

_BANDAI = {
    "head": {"Head": 2.0, "Neck": -1.0},
    "neck": _mid("Neck"),
    "sternum": _mid("Chest", "Neck"),
    "pelvis": _mid("UpperLeg_L", "UpperLeg_R"),
    **_sides(
        left="L", right="R", shoulder="UpperArm_{}", elbow="LowerArm_{}", wrist="Hand_{}",
        hip="UpperLeg_{}", knee="LowerLeg_{}", ankle="Foot_{}",
    ),
}  # fmt: skip

#: Plug-in Gait and CMU's marker set, after `motionenv.mocap.joint_centres` has added the joint centres (…JC).
_PLUG_IN_GAIT = {
    "head": _mid("LFHD", "RFHD", "LBHD", "RBHD"),
    "neck": _mid("CLAV", "C7"),
    "sternum": _mid("CLAV", "STRN", "C7", "T10"),
    "pelvis": _mid("LHJC", "RHJC"),
    **_sides(
        left="L", right="R", shoulder="{}SJC", elbow="{}EJC", wrist="{}WJC", hip="{}HJC", knee="{}KJC", ankle="{}AJC"
    ),
}

#: The 15 markers as `motionenv.write` names them in C3D.
_MARKERS = {**{name: _mid(name) for name in MARKERS}, "neck": _mid("left_shoulder", "right_shoulder")}

#: By the name to pass to `retarget`: table, and the point with the head's rotation (None: markers have none).
SCHEMES: dict[str, tuple[dict[str, dict[str, float]], str | None]] = {
    "cmu": (_CMU, "head"),
    "cmu-bvh": (_CMU_BVH, "Head"),
    "mixamo": (_MIXAMO, "Head"),
    "bandai-namco": (_BANDAI, "Head"),
    "plug-in-gait": (_PLUG_IN_GAIT, None),
    "markers": (_MARKERS, "head"),
}


def missing(scheme: str, names: Iterable[str]) -> list[str]:
    """Source points that `scheme` needs and `names` lacks."""
    needed = {point for weights in SCHEMES[scheme][0].values() for point in weights}
    return sorted(needed - set(names))
