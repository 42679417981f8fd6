"""`points.mpjpe` where every joint is known, in a loop: for environments, which ask for one error at a time."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def mean_distances(estimates, truth, out):
    """Fill `out` (n,) with the mean distance between the joints of `estimates` and `truth`, (n, joints, 3) each."""
    joints = truth.shape[1]
    for i in range(len(out)):
        total = 0.0
        for j in range(joints):
            a, b = estimates[i, j], truth[i, j]
            x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
            total += np.sqrt(x * x + y * y + z * z)
        out[i] = total / joints
