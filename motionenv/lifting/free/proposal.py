"""Postures that the network proposes for a sequence of any length."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from motionenv.lifting.free.posture_network import FRAMES, RATE, PostureNetwork, features
from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE
from motionenv.types import MARKERS

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
    """The network that ships with the library."""
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
    return Proposal(total / weight[:, None, None], spread / weight[:, None])


def _clips(frames: int, stride: int) -> list[np.ndarray]:
    """Frame indices of overlapping clips."""
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
