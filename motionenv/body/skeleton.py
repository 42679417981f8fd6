"""Structure of the cylinder body: nodes, segments, drawn limbs, clothes, proportions, joint limits.

Ten rigid segments form a tree (paper A, fig. 1): torso, head, and on each side upper arm, forearm, thigh and shin. In
the zero pose the body stands upright with hanging arms and faces x; all segment frames are then parallel to the world's
(x forward, y left, z up).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number
from motionenv.types import HEIGHT_RANGE, MARKERS, Skeleton

#: Rows of `Skeleton.offsets`: the 15 markers, then the joint between torso and head.
NODES = (*MARKERS, "neck")

#: Rigid segments in the order of rotation arrays. Feet have no degrees of freedom: `kinematics` derives their rotation.
SEGMENTS = (
    "torso", "head",
    "left_upper_arm", "left_forearm", "right_upper_arm", "right_forearm",
    "left_thigh", "left_shin", "right_thigh", "right_shin",
    "left_foot", "right_foot",
)  # fmt: skip

#: Per segment: index of its parent (-1: the world), and of the node at its frame's origin.
SEGMENT_PARENT = (-1, 0, 0, 2, 0, 4, 0, 6, 0, 8, 7, 9)
SEGMENT_ORIGIN = tuple(
    NODES.index(n)
    for n in (
        "pelvis", "neck", "left_shoulder", "left_elbow", "right_shoulder", "right_elbow",
        "left_hip", "left_knee", "right_hip", "right_knee", "left_ankle", "right_ankle",
    )
)  # fmt: skip

#: Stick figure of the 15 markers, as pairs of indices into `MARKERS` (paper B, fig. 1).
EDGES = tuple(
    (MARKERS.index(a), MARKERS.index(b))
    for a, b in (
        ("head", "sternum"), ("sternum", "pelvis"),
        ("sternum", "left_shoulder"), ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"),
        ("sternum", "right_shoulder"), ("right_shoulder", "right_elbow"), ("right_elbow", "right_wrist"),
        ("pelvis", "left_hip"), ("left_hip", "left_knee"), ("left_knee", "left_ankle"),
        ("pelvis", "right_hip"), ("right_hip", "right_knee"), ("right_knee", "right_ankle"),
    )
)  # fmt: skip

# Drawn limbs: name, segment whose frame holds the local shifts, start node, shift, end node, shift, radii.
# Shifts (x, y, z) and radii are relative to standing height.
_HALF = (
    ("{}_upper_arm", "{}_upper_arm", "{}_shoulder", (0, 0, -0.008), "{}_elbow", (0, 0, 0), (0.031, 0.024)),
    ("{}_forearm", "{}_forearm", "{}_elbow", (0, 0, 0), "{}_wrist", (0, 0, 0), (0.025, 0.017)),
    ("{}_hand", "{}_forearm", "{}_wrist", (0, 0, -0.018), "{}_wrist", (0, 0, -0.070), (0.020, 0.017)),
    ("{}_thigh", "{}_thigh", "{}_hip", (0, 0, 0), "{}_knee", (0, 0, 0), (0.049, 0.031)),
    ("{}_shin", "{}_shin", "{}_knee", (0, 0, 0), "{}_ankle", (0, 0, 0), (0.032, 0.020)),
    ("{}_foot", "{}_foot", "{}_ankle", (-0.018, 0, -0.017), "{}_ankle", (0.086, 0, -0.023), (0.022, 0.016)),
)
_LIMB_TABLE = (
    ("torso", "torso", "pelvis", (0, 0, 0.040), "neck", (0.004, 0, -0.080), (0.062, 0.079)),
    ("shoulders", "torso", "left_shoulder", (0, -0.032, -0.017), "right_shoulder", (0, 0.032, -0.017), (0.044, 0.044)),
    ("pelvis", "torso", "left_hip", (0, -0.012, 0.006), "right_hip", (0, 0.012, 0.006), (0.052, 0.052)),
    ("neck", "head", "neck", (0, 0, -0.012), "head", (0, 0, -0.030), (0.034, 0.030)),
    ("head", "head", "head", (0.004, 0, -0.034), "head", (0.002, 0, 0.018), (0.038, 0.0505)),
    *(tuple(x.format("left") if isinstance(x, str) else x for x in row) for row in _HALF),
    *(tuple(x.format("right") if isinstance(x, str) else x for x in row) for row in _HALF),
)  # fmt: skip

#: Names of the drawn tapered cylinders; `Frame.limbs` holds 1 + index into this.
LIMBS = tuple(str(row[0]) for row in _LIMB_TABLE)

#: Per drawn limb: segment, start node, end node, and the local shifts relative to standing height.
LIMB_SEGMENT = np.array([SEGMENTS.index(row[1]) for row in _LIMB_TABLE])
LIMB_NODES = np.array([[NODES.index(row[2]), NODES.index(row[4])] for row in _LIMB_TABLE])
LIMB_SHIFTS = np.array([[row[3], row[5]] for row in _LIMB_TABLE], dtype=np.float64)
_LIMB_RADII = np.array([row[6] for row in _LIMB_TABLE])

#: Garment of each drawn limb, in the order of `LIMBS`, and default colours of garments (sRGB, 0 to 1).
CLOTHES = tuple(
    {"head": "skin", "neck": "skin", "hand": "skin", "pelvis": "trousers", "thigh": "trousers", "shin": "trousers",
     "foot": "shoes"}.get(limb.split("_")[-1], "shirt")
    for limb in LIMBS
)  # fmt: skip
COLOURS = {
    "skin": (0.87, 0.67, 0.55),
    "shirt": (0.22, 0.46, 0.68),
    "trousers": (0.26, 0.28, 0.35),
    "shoes": (0.16, 0.14, 0.14),
}

#: Height of the ankle joint above the sole, relative to standing height (Winter 2009, fig. 4.1).
ANKLE_HEIGHT = 0.039

# Positions of the nodes in the frame of their segment, relative to standing height. Lengths along the limbs and
# heights: Winter (2009, fig. 4.1, after Drillis & Contini 1966). Widths between joint centres and the depth of the
# sternum marker: joint centres lie inside the breadths of that figure.
_PROPORTIONS = {
    "pelvis": (0, 0, 0),
    "left_hip": (0, 0.050, 0), "right_hip": (0, -0.050, 0),
    "left_shoulder": (0, 0.108, 0.288), "right_shoulder": (0, -0.108, 0.288),
    "sternum": (0.045, 0, 0.225), "neck": (0, 0, 0.300),
    "head": (0.012, 0, 0.105),
    "left_elbow": (0, 0, -0.186), "right_elbow": (0, 0, -0.186),
    "left_wrist": (0, 0, -0.146), "right_wrist": (0, 0, -0.146),
    "left_knee": (0, 0, -0.245), "right_knee": (0, 0, -0.245),
    "left_ankle": (0, 0, -0.246), "right_ankle": (0, 0, -0.246),
}  # fmt: skip
#: Hip to ankle, and hips to neck, relative to standing height: from these a person's height is estimated.
LEG_SHARE = 0.245 + 0.246
TRUNK_SHARE = 0.300


def from_height(height: float = 1.75, *, girth: float = 1.0) -> Skeleton:
    """A body of average proportions (Winter 2009, fig. 4.1).

    Its `height` is 0.5 to 2.5 m standing; `girth`, 0.5 to 2, is a factor on the thickness of all limbs.

    Raises:
        MotionError: `height` or `girth` out of range.
    """
    checked_number(height, "height", *HEIGHT_RANGE)
    return Skeleton(np.array([_PROPORTIONS[n] for n in NODES]) * height, limb_radii(height, girth), height)


def limb_radii(height: float, girth: float = 1.0) -> np.ndarray:
    """Radii (limbs, 2) [m] at the ends of the drawn limbs of a person of `height` [m], times `girth`.

    Raises:
        MotionError: `girth` out of range.
    """
    checked_number(girth, "girth", 0.5, 2.0)
    return _LIMB_RADII * height * girth


_LIMITS_DEGREES: dict[str, list[tuple[float, float]]] = {
    "root": [(-np.inf, np.inf)] * 6,
    "neck": [(-60, 60), (-45, 45), (-80, 80)],
    "shoulder": [(-60, 180), (-50, 180), (-90, 90)], "elbow": [(0, 150)],
    "hip": [(-30, 125), (-30, 45), (-45, 45)], "knee": [(0, 150)],
}  # fmt: skip

#: Joint limits of the pose vector, (25, 2) [rad]: ranges of motion of healthy adults (AAOS, Norkin & White 2016,
#: appendix B), the root free.
LIMITS = np.radians(
    [row for j in "root neck shoulder elbow shoulder elbow hip knee hip knee".split() for row in _LIMITS_DEGREES[j]]
)


#: Middle of each angle's range (25,) [rad]; NaN for what has none: the root's position and heading.
MIDDLE = np.nan_to_num(LIMITS, posinf=0.0, neginf=0.0).mean(1)
MIDDLE[[0, 1, 2, 5]] = np.nan


def limit_excess(poses: ArrayLike) -> np.ndarray:
    """Excess of each entry of `poses` (..., 25) over its joint limit [rad]: 0 inside, negative below, NaN in gaps."""
    poses = np.asarray(poses, dtype=np.float64)
    return poses - np.clip(poses, LIMITS[:, 0], LIMITS[:, 1])


def symmetric(offsets: np.ndarray) -> np.ndarray:
    """The mean of node offsets (16, 3) and their left-right mirror image."""
    sides = {"left": "right", "right": "left"}
    other = [NODES.index("_".join(sides.get(word, word) for word in name.split("_"))) for name in NODES]
    return 0.5 * (offsets + np.asarray(offsets)[other] * [1.0, -1.0, 1.0])


def mirror(poses: ArrayLike) -> np.ndarray:
    """`poses` (..., 25) mirrored left-right: reflected in the world's plane y = 0."""
    poses = np.array(poses, dtype=np.float64)
    swapped = poses[..., [*range(9), *range(13, 17), *range(9, 13), *range(21, 25), *range(17, 21)]]
    swapped[..., [1, 4, 5, 7, 8]] *= -1.0
    return swapped
