"""Structure of the cylinder body: nodes, segments, proportions and joint limits.

Ten rigid segments form a tree (paper A, fig. 1): torso, head, and on each side upper arm, forearm, thigh and shin. In
the zero pose the body stands upright with hanging arms and faces x; all segment frames are then parallel to the world's
(x forward, y left, z up).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv.types import MARKERS

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

#: Height of the ankle joint above the sole, relative to standing height (Winter 2009, fig. 4.1).
ANKLE_HEIGHT = 0.039

#: Positions of the nodes in the frame of their segment, relative to standing height. Lengths along the limbs and
#: heights: Winter (2009, fig. 4.1, after Drillis & Contini 1966). Widths between joint centres and the depth of the
#: sternum marker: joint centres lie inside the breadths of that figure.
PROPORTIONS = {
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
#: How high the neck is above the pelvis, relative to the middle of the shoulders' centres: 14 people of CMU, ± 0.04;
#: other laboratories' captures, 1.08 to 1.11.
NECK_ABOVE = 1.09


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
