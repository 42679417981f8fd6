"""Synthetic reaching movements of one arm, which cover more postures than an arm does in a walk."""

import numpy as np

from motionenv.types import POSE

#: Indices into `POSE` of the right arm's angles.
RIGHT_ARM = tuple(POSE.index(f"right_{name}") for name in (
    "shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion"))  # fmt: skip

#: Ranges (4, 2) [rad] of the reached angles, well inside `motionenv.body.LIMITS` and clear of the trunk.
REACH = np.radians([(-30.0, 140.0), (5.0, 100.0), (-60.0, 60.0), (5.0, 130.0)])

_SECONDS = (0.5, 1.3)  # of one movement
_REST = 0.3  # seconds at most between movements


def reach(frames: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Angles (frames, 4) [rad] of an arm that moves from one random posture to the next, in the order of `RIGHT_ARM`.

    Each movement minimises jerk in joint angles (Flash & Hogan 1985, eq. 3); `rng` draws postures and durations.
    """
    count = int(np.ceil(frames / fps / _SECONDS[0])) + 2
    seconds, rests = rng.uniform(*_SECONDS, count), rng.uniform(0.0, _REST, count)
    postures = rng.uniform(REACH[:, 0], REACH[:, 1], (count + 1, 4))
    starts = np.concatenate([[0.0], np.cumsum(seconds + rests)[:-1]])
    clock = np.arange(frames) / fps + rng.uniform(0.0, seconds[0])
    now = np.searchsorted(starts, clock, side="right") - 1
    u = np.clip((clock - starts[now]) / seconds[now], 0.0, 1.0)[:, None]
    return postures[now] + (postures[now + 1] - postures[now]) * (10 * u**3 - 15 * u**4 + 6 * u**5)
