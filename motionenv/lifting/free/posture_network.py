"""A temporal convolutional network that proposes postures from the directions in which the markers are seen.

Its input is invariant to the person's place, distance and size; its output is the posture in units of the person's
size, with an uncertainty. Gravity must be known; nothing else of the camera is. `benchmarks.free_walking.train` trains
it on CMU's capture, on models fitted to it and on runners from published joint angles.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.special import expit

from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE
from motionenv.types import MARKERS

#: Frame rate [Hz] and number of frames of the network's clips.
RATE, FRAMES = 15.0, 64
#: Dilations of the residual blocks, each of a convolution over 3 frames and one over 1.
DILATIONS = (1, 2, 4, 8, 1, 16)
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


#: [m] the body unit of an adult 1.72 m tall.
BODY_UNIT = 0.43
_SPINE = 2.88 * BODY_UNIT  # [m] from sternum to ankle along the body, which defines the unit
_CHAIN = [MARKERS.index(name) for name in ("sternum", "pelvis")]
_LEGS = [[MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")]
_FILE = Path(__file__).with_name("posture_network.npz")
_MIRROR = np.array([1.0, -1.0, 1.0])
_RAMP = 12  # frames over which overlapping clips are blended


@dataclass(frozen=True)
class Proposal:
    """Proposed postures: positions (frames, 15, 3) about the pelvis, and deviations (frames, 15), in body units."""

    posture: np.ndarray
    spread: np.ndarray


@cache
def shipped_network() -> PostureNetwork:
    with np.load(_FILE) as weights:
        return PostureNetwork(dict(weights))


def propose(network: PostureNetwork, rays: np.ndarray, fps: float) -> Proposal:
    """Postures for `rays` (frames, 15, 3), unit vectors in a frame whose z points up; NaN where nothing is seen.

    The sequence is dealt out to interleaved streams of about 15 frames per second, and each to overlapping clips.
    """
    frames, stride = len(rays), max(1, round(fps / RATE))
    total, spread, weight = np.zeros((frames, len(MARKERS), 3)), np.zeros((frames, len(MARKERS))), np.zeros(frames)
    mirrored = rays[:, OTHER_SIDE] * _MIRROR
    for indices in _clips(frames, stride):
        if not np.isfinite(rays[indices]).any():
            continue
        posture, deviation = _clip(network, rays[indices])
        other, its_deviation = _clip(network, mirrored[indices])
        posture = 0.5 * (posture + other[:, OTHER_SIDE] * _MIRROR)  # errors of the mirror image differ
        deviation = 0.5 * (deviation + its_deviation[:, OTHER_SIDE])
        ends = np.minimum(np.arange(len(indices)), np.arange(len(indices))[::-1]) + 1.0
        share = np.minimum(ends, _RAMP)
        total[indices] += share[:, None, None] * posture
        spread[indices] += share[:, None] * deviation
        weight[indices] += share
    # A stream may see nothing, as where every other frame was detected: its neighbours propose for it.
    near = distance_transform_edt(weight == 0, return_distances=False, return_indices=True)[0]
    return Proposal(total[near] / weight[near, None, None], spread[near] / weight[near, None])


def _clips(frames: int, stride: int) -> list[np.ndarray]:
    clips = []
    for first in range(min(stride, frames)):
        stream = np.arange(first, frames, stride)
        last = max(len(stream) - FRAMES, 0)
        starts = [*range(0, last, FRAMES // 2), last]
        clips += [stream[start : start + FRAMES] for start in starts]
    return clips


def _clip(network: PostureNetwork, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Posture and deviations of one clip in the axes of the rays, in body units."""
    seen = np.isfinite(rays[..., 0])
    mean = np.where(seen[..., None], rays, 0.0).sum(axis=(0, 1))
    ahead = np.arctan2(mean[1], mean[0])
    azimuth = np.arctan2(rays[..., 1], rays[..., 0]) - ahead
    elevation = np.arctan2(rays[..., 2], np.hypot(rays[..., 0], rays[..., 1]))
    directions = np.stack([(azimuth + np.pi) % (2 * np.pi) - np.pi, elevation], axis=-1)
    made = features(directions[None], seen[None])
    posture, deviation = (out[0].astype(float) for out in network.forward(made.values))
    angle = ahead + made.azimuth[0]
    c, s = np.cos(angle), np.sin(angle)
    turned = posture @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    unit = BODY_UNIT / _SPINE * _body_length(turned)
    return (turned - turned[:, [_CHAIN[1]]]) / unit, deviation / unit


def _body_length(posture: np.ndarray) -> float:
    """The length from sternum to ankle along the body, its median over frames."""
    length = np.linalg.norm(posture[:, _CHAIN[0]] - posture[:, _CHAIN[1]], axis=-1)
    for leg in _LEGS:
        length += 0.5 * np.linalg.norm(np.diff(posture[:, leg], axis=1), axis=-1).sum(axis=1)
    return float(np.median(length))
