"""Compiled marker positions of many Fourier walkers, each at its own phase."""

import numpy as np

from motionenv._core.compilation import kernel


@kernel
def place(coefficients, which, phases, sizes, out) -> None:
    """Fill `out` (k, 15, 3) [m] with the walkers `which` (k,) at their phases ωt (k,) [rad] (paper B, eq. 3.1).

    `coefficients` (n, 5, 15, 3) [m] are those of all walkers, `sizes` (k,) factors on all lengths.
    """
    for i in range(len(which)):
        w, body = coefficients[which[i]].reshape(5, 45), out[i].reshape(45)
        s, c = np.sin(phases[i]), np.cos(phases[i])
        s2, c2 = 2.0 * s * c, c * c - s * s
        for j in range(45):
            body[j] = sizes[i] * (w[0, j] + s * w[1, j] + c * w[2, j] + s2 * w[3, j] + c2 * w[4, j])
