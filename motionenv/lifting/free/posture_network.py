"""A temporal convolutional network that proposes postures from the directions in which the markers are seen.

Its input is invariant to the person's place, distance and size; its output is the posture in units of the person's
size, with an uncertainty. Gravity must be known; nothing else of the camera is. `benchmarks.free_walking.train` trains
it on CMU's capture, on models fitted to it and on runners from published joint angles.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from motionenv.types import MARKERS

#: Frame rate [Hz] and number of frames of the network's clips.
RATE, FRAMES = 15.0, 64
#: Dilations of the residual blocks, each of a convolution over 3 frames and one over 1.
DILATIONS = (1, 2, 4, 8, 1)
#: Least deviation of a coordinate, in units of the body's size.
LEAST = 0.02


@dataclass(frozen=True)
class Features:
    """The network's input, and what maps its output back.

    Attributes:
        values: (..., frames, 50) float32.
        azimuth: (...,) [rad] the mean direction of the clip, along which the output's x axis points.
    """

    values: np.ndarray
    azimuth: np.ndarray


def features(directions: np.ndarray, seen: np.ndarray) -> Features:
    """The network's input for clips of markers.

    Args:
        directions: (..., frames, 15, 2) azimuth and elevation [rad] of the rays from the camera to the markers.
        seen: (..., frames, 15) whether a marker was seen; other directions aren't used.
    """
    weight = seen[..., None].astype(float)
    count = np.maximum(weight.sum(axis=-2), 1.0)
    centre = (np.where(seen[..., None], directions, 0.0)).sum(axis=-2) / count
    any_seen = seen.any(axis=-1, keepdims=True).astype(float)
    frames = np.maximum(any_seen.sum(axis=-2, keepdims=True), 1.0)
    middle = (centre * any_seen).sum(axis=-2, keepdims=True) / frames
    off = np.where(seen[..., None], directions - centre[..., None, :], 0.0)
    spread = np.sqrt((off**2).sum(axis=(-2, -1))[..., None] / count)
    size = np.maximum((spread * any_seen).sum(axis=-2, keepdims=True) / frames, 1e-4)
    values = np.concatenate([
        (off / size[..., None]).reshape(*off.shape[:-2], -1), weight[..., 0], (centre - middle) / size, centre[..., 1:],
        spread / size, any_seen,
    ], axis=-1)  # fmt: skip
    return Features(values.astype(np.float32), middle[..., 0, 0])


class PostureNetwork:
    """The trained network.

    Attributes:
        weights: arrays by name: `in`, `wide0`, `narrow0`, ..., `out`, each (outputs, inputs, frames), and their biases.
    """

    def __init__(self, weights: dict[str, np.ndarray]) -> None:
        self.weights = {name: np.asarray(values, dtype=np.float32) for name, values in weights.items()}

    def forward(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Postures (clips, frames, 15, 3) and their deviations (clips, frames, 15) for `Features.values`."""
        hidden = _silu(self._convolved(values, "in", 1))
        for i, dilation in enumerate(DILATIONS):
            wide = _silu(self._convolved(hidden, f"wide{i}", dilation))
            hidden = hidden + self._convolved(wide, f"narrow{i}", 1)
        out = self._convolved(hidden, "out", 1)
        count = 3 * len(MARKERS)
        return out[..., :count].reshape(*out.shape[:-1], -1, 3), np.logaddexp(out[..., count:], 0) + LEAST

    def _convolved(self, values: np.ndarray, name: str, dilation: int) -> np.ndarray:
        """A convolution over time of values (clips, frames, inputs), with zeros beyond the ends."""
        kernel, bias = self.weights[name], self.weights[f"{name}_bias"]
        taps = kernel.shape[2]
        reach = dilation * (taps // 2)
        padded = np.pad(values, ((0, 0), (reach, reach), (0, 0)))
        frames = values.shape[1]
        out = np.tile(bias, (*values.shape[:2], 1))
        for k in range(taps):
            out += padded[:, k * dilation : k * dilation + frames] @ kernel[:, :, k].T
        return out


def _silu(values: np.ndarray) -> np.ndarray:
    return values * expit(values)
