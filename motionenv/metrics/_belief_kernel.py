"""The energy score's sum over all pairs of a belief's samples."""

import numpy as np

from motionenv._core.compilation import kernel


@kernel(fastmath={"reassoc", "contract", "nsz"})  # sums may be reordered, for SIMD, but NaN is kept
def mean_apart(samples, weights, out) -> None:
    """Write Σ w_i w_j |x_i - x_j| of `samples` (n, M, 45), with `weights` (n, M), to `out` (n,)."""
    for e in range(len(samples)):
        x, w, total = samples[e], weights[e], 0.0
        for i in range(len(x)):
            for j in range(i):
                square = 0.0
                for k in range(x.shape[1]):
                    square += (x[i, k] - x[j, k]) ** 2
                total += w[i] * w[j] * np.sqrt(square)
        out[e] = 2.0 * total
