"""Markers of very many walkers of paper B at once, each in place as on a treadmill, without bodies."""

from dataclasses import dataclass

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.validation import random_generator
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.models.eigenwalkers.fourier_series import body_heights, grounded, stride_lengths
from motionenv.types import MARKERS


@dataclass(frozen=True, eq=False)
class WalkerBatch:
    """Walkers as Fourier series, standing on z = 0, with the pelvis on average at x = y = 0."""

    coefficients: np.ndarray  # (n, 5, 15, 3) [m]
    frequencies: np.ndarray  # (n,) strides per second [Hz]
    heights: np.ndarray  # (n,) body heights [m], from the lengths of legs and trunk
    strides: np.ndarray  # (n,) stride lengths [m], from the backward speed of the stance foot

    def positions(self, which: np.ndarray, phases: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Marker positions (k, 15, 3) [m] of the walkers `which` (k,) at `phases` (k,) ωt [rad].

        `sizes` (k,) are factors on all lengths; 1 keeps the walker's size.
        """
        out = np.empty((len(which), len(MARKERS), 3))
        _place(self.coefficients, which, phases, sizes, out)
        return out


def draw_walkers(model: FourierModel, n: int, seed: int | np.random.Generator | None = None) -> WalkerBatch:
    """Draw `n` walkers with scores from N(0, diag λ) and frequencies from the model's regression.

    Unlike `FourierModel.sample`, it builds no bodies and so doesn't reject walkers that exceed joint limits.

    Raises:
        ModelError: not fitted.
    """
    rng = random_generator(seed)
    scores = rng.standard_normal((n, len(model.components_))) * np.sqrt(model.explained_variance_)
    frequencies = model.frequency(scores) * np.exp(model.log_frequency_deviation_ * rng.standard_normal(n))
    w = grounded(model.inverse_transform(scores))
    return WalkerBatch(w, frequencies, body_heights(w), stride_lengths(w))


@kernel
def _place(coefficients, which, phases, sizes, out) -> None:
    """Fill `out` (k, 15, 3) [m] with the walkers `which` (k,) at their phases ωt (k,) [rad] (paper B, eq. 3.1).

    `coefficients` (n, 5, 15, 3) [m] are those of all walkers, `sizes` (k,) factors on all lengths.
    """
    for i in range(len(which)):
        w, body = coefficients[which[i]].reshape(5, 45), out[i].reshape(45)
        s, c = np.sin(phases[i]), np.cos(phases[i])
        s2, c2 = 2.0 * s * c, c * c - s * s
        for j in range(45):
            body[j] = sizes[i] * (w[0, j] + s * w[1, j] + c * w[2, j] + s2 * w[3, j] + c2 * w[4, j])
