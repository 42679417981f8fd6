"""The five points of the face that detectors of people find, on the drawn head."""

import numpy as np

from motionenv.body.kinematics import forward
from motionenv.body.limbs import head_size
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.types import Skeleton

#: Points of the face, in COCO's order.
FACE = ("nose", "left_eye", "right_eye", "left_ear", "right_ear")
# On the surface of the average head, from its marker, relative to standing height.
_AT = np.array([
    (0.0545, 0, -0.010), (0.0405, 0.0185, 0.008), (0.0405, -0.0185, 0.008), (-0.002, 0.0535, -0.003),
    (-0.002, -0.0535, -0.003),
])  # fmt: skip
_HEAD = NODES.index("head"), SEGMENTS.index("head")


def face_points(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Points (..., 5, 3) [m] of the face, in the order of `FACE`, of `poses` (..., 25) of a `skeleton`."""
    nodes, rotations = forward(poses, skeleton)
    head, turn = nodes[..., _HEAD[0], :], rotations[..., _HEAD[1], :, :]
    return head[..., None, :] + np.einsum("...ij,kj->...ki", turn, head_size(skeleton) * _AT)
