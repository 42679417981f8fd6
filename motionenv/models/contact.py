"""The way of the root over the ground, from the feet that stand on it."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionenv.body.kinematics import feet
from motionenv.body.skeleton import NODES
from motionenv.types import POSE, Skeleton

_FIRMNESS = 0.15  # [m/s] how clearly one foot must move back faster than the other to stand alone
_SMOOTHING = 0.01  # [s] standard deviation of the smoothing of the root's velocity
_SHIFTING = 0.05  # [s] standard deviation of the smoothing with which weight shifts between the feet
_SETTLING = 0.015  # [s] standard deviation of the smoothing of what is corrected at the hips
_REACH = 0.04  # [m] a foot this far from its place has left it
_LOOSENESS = 0.1  # how little a foot must stand to be left alone, between 0 and 1
_MIDSWING = np.array([0.8, 0.3])  # [cycles] phase at which the left and the right foot is in the air
_HIPS = [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]  # abduction comes next
_HIP_NODES = [NODES.index("left_hip"), NODES.index("right_hip")]


def carry(poses: np.ndarray, heights: np.ndarray, phase: np.ndarray, rate: float, body: Skeleton) -> None:
    """Move the roots of poses (n, frames, 25) over the ground so that standing feet stand still.

    The foot that moves back fastest under the body stands: the body moves forward as fast, and is as high as that
    ankle's height says. What the feet still slip, a centimetre or two, is taken out at the hips.

    Args:
        poses: roots at the origin; x, y and z are filled in, hips are turned by a degree or so.
        heights: (n, frames, 2) [m] of the left and the right ankle over the ground.
        phase: (n, frames) in cycles; 0 is the left leg furthest ahead.
        rate: frames per second.
        body: the body.
    """
    ankles = feet(poses, body)[0]
    back = -np.gradient(ankles[..., 0], 1 / rate, axis=1)
    stands = np.exp((back - back.max(-1, keepdims=True)) / _FIRMNESS)
    stands /= stands.sum(-1, keepdims=True)
    bears = _smooth(stands, _SHIFTING * rate)
    poses[..., 2] = (bears * (heights - ankles[..., 2])).sum(-1)
    ankles, balls = feet(poses, body)
    ball = balls[..., :2]
    velocity = -(stands[..., None] * np.gradient(ball, 1 / rate, axis=1)).sum(2)
    velocity = _smooth(velocity, _SMOOTHING * rate)
    poses[:, 1:, :2] = np.cumsum(0.5 * (velocity[:, 1:] + velocity[:, :-1]), axis=1) / rate
    _plant(poses, _slip(ball + poses[:, :, None, :2], stands, phase, rate), ankles, body)


def _slip(ball, stands, phase, rate) -> np.ndarray:
    """By how much (n, frames, 2, 2) [m] to move the balls of the feet so that they stay where they are on average.

    Averaged over time, weighted by how surely the foot stands; in the air it fades away.
    """
    slip = _places(ball, stands, phase) - ball
    surely = (stands * np.exp(-((slip / _REACH) ** 2).sum(-1)))[..., None]
    return _smooth(surely * slip, _SETTLING * rate) / (_smooth(surely, _SETTLING * rate) + _LOOSENESS)


def _plant(poses, slip, ankles, body) -> None:
    """Turn the hips so that the feet move by `slip` (n, frames, 2, 2); `ankles` are those of roots at x = y = 0.

    Seen in the pelvis' heading, flexion moves the ankle forward by its depth under the hip, and abduction outwards
    by its distance from it; what the pelvis' tilt adds to that is small.
    """
    forward, left = np.cos(poses[..., 5]), np.sin(poses[..., 5])
    for side, outwards in enumerate((1, -1)):
        depth = poses[..., 2] + body.offsets[_HIP_NODES[side], 2] - ankles[..., side, 2]
        x, y = slip[..., side, 0], slip[..., side, 1]
        poses[..., _HIPS[side]] += (forward * x + left * y) / depth
        poses[..., _HIPS[side] + 1] += outwards * (forward * y - left * x) / np.hypot(depth, ankles[..., side, 0])


def _places(ball, stands, phase) -> np.ndarray:
    """Mean place (n, frames, 2, 2) of each foot's ball over the step that a frame belongs to, weighted by `stands`."""
    step = np.floor(phase[..., None] - _MIDSWING).astype(np.intp)
    step -= step.min()
    n, _, sides = step.shape
    count = step.max() + 1
    step += count * np.arange(n * sides).reshape(n, 1, sides)
    total = np.bincount(step.ravel(), stands.ravel(), n * sides * count)
    sums = [np.bincount(step.ravel(), (stands * ball[..., i]).ravel(), len(total)) for i in range(2)]
    return np.stack([s / np.maximum(total, 1e-9) for s in sums], axis=-1)[step]


def _smooth(values: np.ndarray, frames: float) -> np.ndarray:
    """`values` (n, frames, ...) smoothed over time by a Gaussian of standard deviation `frames`."""
    return gaussian_filter1d(values, frames, axis=1, mode="nearest")
