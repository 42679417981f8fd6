"""What a camera makes of many bodies' markers: projection, noise, markers that can't be seen."""

import numpy as np
from numba import njit

from motionenv.models.tree._random_kernels import restart, uniform

_TURN = 2.0 * np.pi


@njit(nogil=True, cache=True, error_model="numpy")
def look(slots, walkers, alphas, keys, time, setting, joints, hidden, points, seen) -> None:
    """Turn walkers by their view angle and observe them.

    Everything random in a frame comes from the episode's key and the frame's number, in the same order for each marker.

    Args:
        slots: (k,) rows of the arrays below, but for `walkers`.
        walkers: (k, 15, 3) [m], walking along x.
        alphas: (n,) view angle [rad].
        keys: (n,) uint64.
        time: (n,) number of the frame; at 0 markers are hidden afresh, later they change as a Markov chain.
        setting: noise [m], dropout, share hidden, chance to become hidden, chance to stay so, distance and height of
            the camera [m].
        joints: (n, 15, 3) filled with the markers [m] with the camera at α = 0.
        hidden: (n, 15) bool, markers in a gap; moved on.
        points: (n, 15, 2) filled with what is seen of them [m], 0 where they aren't.
        seen: (n, 15) filled with 1 or 0.
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
            radius, angle = noise * np.sqrt(-2.0 * np.log(1.0 - first)), _TURN * second  # Box & Muller (1958), both
            seen[e, m] = 1
            points[e, m, 0] = scale * across + radius * np.cos(angle)
            points[e, m, 1] = height + scale * (z - height) + radius * np.sin(angle)
