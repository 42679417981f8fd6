"""Compiled `points.mpjpe` for known joints, with little overhead for single errors as in environments."""

import numpy as np

from motionenv._core.compilation import kernel


@kernel
def mean_distances(estimates, truth, out, factor, centre):
    """Write the mean distance between the joints of `estimates` and `truth`, (n, joints, 3) each, to `out` (n,).

    `estimates` are first multiplied by `factor` (3,), and moved by `centre` (3,).
    """
    joints = truth.shape[1]
    for i in range(len(out)):
        total = 0.0
        for j in range(joints):
            a, b = estimates[i, j], truth[i, j]
            x = a[0] * factor[0] + centre[0] - b[0]
            y = a[1] * factor[1] + centre[1] - b[1]
            z = a[2] * factor[2] + centre[2] - b[2]
            total += np.sqrt(x * x + y * y + z * z)
        out[i] = total / joints
