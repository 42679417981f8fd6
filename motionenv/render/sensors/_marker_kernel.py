"""Marker sensor for many bodies: projection, noise, and missing markers."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.random import restart, uniform

_TURN = 2.0 * np.pi


@kernel
def look(slots, walkers, alphas, keys, time, setting, joints, hidden, points, seen) -> None:
    """Rotate walkers (k, 15, 3) [m], who walk along x, by their view angle and observe them.

    All randomness in a frame is derived from the episode's key and the frame number, in the same order for each marker.
    At time 0 gaps are drawn from their stationary distribution, later by a Markov chain. `slots` (k,) are rows of the
    other arrays: `alphas` [rad], `keys` and `time` (n,), true `joints` (n, 15, 3) [m] with the camera at α = 0,
    `hidden` (n, 15), markers in a gap, and observed `points` (n, 15, 2) [m] with `seen` (n, 15), both 0 if missing.
    `setting` is noise [m], dropout, gap fraction, probabilities of starting and of continuing a gap, distance and
    height of the camera [m].
    """
    noise, dropout, share, start, stay, distance, height = setting
    state = np.empty(1, dtype=np.uint64)
    for i in range(len(slots)):
        e = slots[i]
        restart(state, keys[e], time[e])
        s, c = np.sin(alphas[e]), np.cos(alphas[e])
        for m in range(joints.shape[1]):
            x, y, z = walkers[i, m, 0], walkers[i, m, 1], walkers[i, m, 2]
            across, depth = c * x + s * y, c * y - s * x
            joints[e, m, 0], joints[e, m, 1], joints[e, m, 2] = across, depth, z
            chance = share if time[e] == 0 else stay if hidden[e, m] else start
            hidden[e, m] = uniform(state) < chance
            dropped = uniform(state) < dropout
            first, second = uniform(state), uniform(state)
            if hidden[e, m] or dropped:
                seen[e, m], points[e, m, 0], points[e, m, 1] = 0, 0.0, 0.0
                continue
            scale = distance / (distance + depth) if distance < np.inf else 1.0
            radius, angle = noise * np.sqrt(-2.0 * np.log(1.0 - first)), _TURN * second  # Box & Muller (1958)
            seen[e, m] = 1
            points[e, m, 0] = scale * across + radius * np.cos(angle)
            points[e, m, 1] = height + scale * (z - height) + radius * np.sin(angle)
