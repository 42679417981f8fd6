"""Joint positions of many people, each with their own body."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.body.kinematics import write_nodes


@kernel
def joints_of(start, stop, poses, offsets, out):
    """Fill `out` (n, k, 15, 3) [m] with the markers of people `start` to `stop` in `poses` (n, k, 25), k of each.

    `offsets` (n, 16, 3) [m] are those of their bodies.
    """
    nodes, rotations = np.empty((16, 3)), np.empty((12, 3, 3))
    for i in range(start, stop):
        for j in range(poses.shape[1]):
            write_nodes(poses[i, j], offsets[i], nodes, rotations)
            for node in range(15):
                for axis in range(3):
                    out[i, j, node, axis] = nodes[node, axis]
