"""Walkers of paper B off the treadmill: over the ground, as markers and as the cylinder body.

The foot that stands moves back under the body as fast as the body moves forward. Two harmonics can't make that speed
even, and the ankle leaves its place while the foot rolls over its ball; so the body is carried by the ball of the foot
that stands, at each phase as fast as that moves back: on the straight CMU walks that is the captured speed, within 1 %
for half of them and within 8 % for all.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.body.kinematics import feet
from motionenv.body.skeleton import ANKLE_HEIGHT, NECK_ABOVE, limit_excess
from motionenv.errors import GapError
from motionenv.models.contact_rule import CONTACT, SAMPLES
from motionenv.models.eigenwalkers.fourier_series import PELVIS, WALKING, grounded, positions_at
from motionenv.models.types import Cycle
from motionenv.types import MARKERS, Motion, Skeleton

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_PHASES = np.arange(SAMPLES) * (2 * np.pi / SAMPLES)  # [rad]
_WAVES = 24  # harmonics kept of how the way differs from an even one
_PADDING = 0.375  # of a cycle, before and after it, so that what smooths over time sees no ends in it


@dataclass(frozen=True)
class Gait:
    """Body of a Fourier walker, and its way over the ground."""

    coefficients: np.ndarray  # (5, 15, 3) [m] or more, standing on z = 0
    skeleton: Skeleton  # the cylinder body, limbs as long as between the markers
    poses: np.ndarray  # (SAMPLES, 25) of the body that follows the markers in place
    lift: float  # by how much the fitted body is raised [m], so that its lowest foot touches the ground
    excess: float  # by how much the body goes beyond its joint limits at most [rad]; 0 for a body that can do this
    standing: np.ndarray  # (SAMPLES, 2) how much the left and the right foot stand
    waves: np.ndarray  # (25, 2) complex, Fourier series of the velocity forward and to the left [m per radian of phase]

    @property
    def stride_length(self) -> float:
        """Length of a stride [m]; times the frequency it is the speed."""
        return float(2 * np.pi * np.hypot(*self.waves[0].real))

    def way(self, phase: ArrayLike) -> np.ndarray:
        """Position (..., 2) [m] of the walker at phases ωt (...) [rad], any real numbers; 0 at 0, smooth."""
        phase = np.asarray(phase, dtype=np.float64)[..., None]
        k = np.arange(1, len(self.waves))
        periodic = 2 * np.real((np.exp(1j * k * phase) - 1.0) @ (self.waves[1:] / (1j * k)[:, None]))
        return self.waves[0].real * phase + periodic

    @property
    def turn(self) -> np.ndarray:
        """Rotation (3, 3) about the vertical, of a few degrees, that makes the way go along x."""
        c, s = self.waves[0].real / np.hypot(*self.waves[0].real)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def positions(self, phase: np.ndarray, *, overground: bool = True) -> np.ndarray:
        """Marker positions (frames, 15, 3) [m] at phases ωt (frames,) [rad].

        In the first frame the origin is where the treadmill would be, on which the walker stays unless `overground`.
        """
        positions = positions_at(self.coefficients, phase)
        if overground:
            positions[..., :2] += (self.way(phase) - self.way(phase[0]))[:, None]
            positions = positions @ self.turn.T
        return positions

    def motion(self, phase: np.ndarray, fps: float, *, overground: bool = True, name: str = "") -> Motion:
        """The cylinder body that follows the markers; they lie within about a centimetre, since limbs are rigid.

        Arguments as of `positions`; `fps` and `name` go into the motion.
        """
        poses = fit_poses(_nodes(self.positions(phase, overground=overground)), self.skeleton, fps)
        poses[:, 2] += self.lift
        return Motion(poses, self.skeleton, fps, name)

    def in_place(self, samples: int, seconds: float) -> Cycle:
        """One cycle of `samples` that lasts `seconds` [s]: as over the ground, less the even way."""
        phase = np.arange(samples) * (2 * np.pi / samples)
        positions = positions_at(self.coefficients, phase)
        poses = self.poses if samples == SAMPLES else _fitted(self.coefficients, self.skeleton, samples, self.lift)
        poses = poses.copy()
        sway = self.way(phase) - phase[:, None] * self.waves[0].real
        sway -= (sway + positions[:, PELVIS, :2]).mean(axis=0)
        positions[..., :2] += sway[:, None]
        poses[:, :2] = (poses[:, :2] + sway) @ self.turn[:2, :2].T
        poses[:, 5] += np.arctan2(self.turn[1, 0], self.turn[0, 0])
        standing = np.stack([np.interp(phase, _PHASES, side, period=2 * np.pi) for side in self.standing.T], axis=-1)
        return Cycle(positions @ self.turn.T, poses, standing, self.skeleton, self.stride_length, seconds)


def gait(coefficients: ArrayLike) -> Gait:
    """Body and way of a walker (5, 15, 3) [m], or with more harmonics; keeps the last ones.

    A GapError if a marker of pelvis or legs is unknown.
    """
    coefficients = np.asarray(coefficients, dtype=np.float64)
    unknown = [name for name in WALKING if np.isnan(coefficients[:, MARKERS.index(name)]).any()]
    if unknown:
        raise GapError(f"the walker has no {', '.join(unknown)}: use a walker whose pelvis and legs are known")
    return _gait(coefficients.tobytes())


@lru_cache(maxsize=64)
def _gait(coefficients: bytes) -> Gait:
    w = grounded(np.frombuffer(coefficients).reshape(-1, len(MARKERS), 3))
    skeleton = fit_skeleton(_nodes(positions_at(w, _PHASES)))
    poses = _fitted(w, skeleton, SAMPLES, 0.0)
    lift = float(ANKLE_HEIGHT * skeleton.height - feet(poses, skeleton)[0][..., 2].min())
    poses[:, 2] += lift
    excess = float(np.nanmax(np.abs(limit_excess(poses))))
    return Gait(w, skeleton, poses, lift, excess, *_contact(poses, skeleton))


def _fitted(w: np.ndarray, skeleton: Skeleton, samples: int, lift: float) -> np.ndarray:
    """Poses (samples, 25) of a cycle in place of the body that follows the markers of w (5, 15, 3), raised by `lift`.

    Angles are smoothed where they are undefined as in a cycle of a second.
    """
    pad = round(_PADDING * samples)
    nodes = _nodes(positions_at(w, np.arange(-pad, samples + pad) * (2 * np.pi / samples)))
    poses = fit_poses(nodes, skeleton, samples)[pad : pad + samples]
    poses[:, 2] += lift
    return poses


def _contact(poses: np.ndarray, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the feet (SAMPLES, 2), and the velocity that keeps the standing foot's ball in place.

    The velocity is a Fourier series (25, 2) [m per radian].
    """
    ball = feet(poses, skeleton)[1][..., :2]
    back = (np.roll(ball, 1, axis=0) - np.roll(ball, -1, axis=0)) * (SAMPLES / (4 * np.pi))
    fastest = back[..., 0].max(axis=1, keepdims=True)
    stands = np.exp((back[..., 0] - fastest) / (CONTACT.marker_firmness * fastest.max()))
    stands /= stands.sum(axis=1, keepdims=True)
    return stands, np.fft.rfft((stands[..., None] * back).sum(axis=1), axis=0)[: _WAVES + 1] / SAMPLES


def _nodes(positions: np.ndarray) -> np.ndarray:
    """The body's nodes (frames, 16, 3): the 15 markers, and the neck above the middle of the shoulders."""
    up = positions[:, _SHOULDERS].mean(axis=1, keepdims=True) - positions[:, PELVIS, None]
    return np.concatenate([positions, positions[:, PELVIS, None] + NECK_ABOVE * up], axis=1)
