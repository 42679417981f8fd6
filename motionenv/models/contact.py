"""The way of the root over the ground, from the feet that stand on it."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionenv.body.kinematics import FOOT_BALL, forward
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.types import Skeleton

_ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]
_FEET = [SEGMENTS.index("left_foot"), SEGMENTS.index("right_foot")]
_FIRMNESS = 0.15  # [m/s] how clearly one foot must move back faster than the other to stand alone
_SMOOTHING = 0.01  # [s] standard deviation of the smoothing of the root's velocity
_SHIFTING = 0.05  # [s] standard deviation of the smoothing with which weight shifts between the feet


def carry(poses: np.ndarray, heights: np.ndarray, rate: float, body: Skeleton) -> None:
    """Move the roots of poses (n, frames, 25) over the ground so that standing feet stand still.

    Args:
        poses: roots at the origin; x, y and z are filled in.
        heights: (n, frames, 2) [m] of the left and the right ankle over the ground.
        rate: frames per second.
        body: the body.
    """
    ankles = forward(poses, body)[0][..., _ANKLES, :]
    back = -np.gradient(ankles[..., 0], 1 / rate, axis=1)
    stands = np.exp((back - back.max(-1, keepdims=True)) / _FIRMNESS)
    stands /= stands.sum(-1, keepdims=True)
    bears = gaussian_filter1d(stands, _SHIFTING * rate, axis=1, mode="nearest")
    poses[..., 2] = (bears * (heights - ankles[..., 2])).sum(-1)
    nodes, rotations = forward(poses, body)
    ball = nodes[..., _ANKLES, :2] + (rotations[..., _FEET, :, :] @ (FOOT_BALL * body.height))[..., :2]
    velocity = -(stands[..., None] * np.gradient(ball, 1 / rate, axis=1)).sum(2)
    velocity = gaussian_filter1d(velocity, _SMOOTHING * rate, axis=1, mode="nearest")
    poses[:, 1:, :2] = np.cumsum(0.5 * (velocity[:, 1:] + velocity[:, :-1]), axis=1) / rate
