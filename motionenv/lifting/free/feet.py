"""Heels and toes in 3D: from their rays, the lifted legs, and what feet do.

Per frame and foot, Gauss-Newton finds the most probable heel and toe: on their rays, as far from the ankle and from
each other as they are throughout, turned out as people's feet are, and at an angle to the shank that ankles have.
From the front, where rays don't tell how far a toe is ahead, the lengths do.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.mocap.clinical.gait_model import unit
from motionenv.types import MARKERS

_M = {name: i for i, name in enumerate(MARKERS)}
_LEG = 0.491  # hip to ankle, relative to stature (Winter 2009, fig. 4.1)
#: From the ankle's centre to heel and toe, ahead and up, relative to stature: between a laboratory's toe marker, on the
#: second metatarsal head, and a detector's, on the tip of the big toe.
_HEEL, _TOE = (-0.028, -0.033), (0.085, -0.040)
_FIRST, _OWN = 0.25, 0.05  # relative deviations of lengths: of people and definitions, and once they are the person's
_OUT, _TURNED = np.radians(7.0), 0.17  # by how much feet are turned out, and the sine of its deviation
_BESIDE = 0.009  # deviation of the heel from the ankle's plane, relative to stature
_BENT = 0.4  # deviation of the sine of the angle between foot and sole's plane, as ankles bend
_ROUNDS = 6
_SIGNS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 1.0))  # of heel and toe in the ways ankle to heel, ankle to toe, heel to toe
_TAIL = 12.0  # squared error at which a ray has a quarter of its weight
_LEAST = 0.004  # [m] least deviation of a ray at the foot


@dataclass(frozen=True)
class FootRays:
    """Rays (frames, 4, 3) towards left heel and toe and right heel and toe, unit vectors, NaN where they aren't seen.

    `origins` (frames, 3) [m] are the camera's; `noise` [m] is a ray's standard deviation at the foot.
    """

    directions: np.ndarray
    origins: np.ndarray
    noise: float


def lift_feet(places: np.ndarray, rays: FootRays, rng: np.random.Generator | None = None) -> np.ndarray:
    """Heels and toes (..., frames, 4, 3) [m], in the order of `FootRays`, of motions `places` (..., frames, 15, 3) [m].

    Without `rng` the most probable ones; with it a draw for each motion, whose error lasts as long as the motion.
    NaN where the leg is, and where neither heel nor toe is seen.
    """
    parts = []
    for first, side in ((0, "left"), (2, "right")):
        towards = rays.directions[:, first : first + 2]
        foot = _Foot(places, side, towards, rays)
        for length in (_FIRST, _OWN):
            for _ in range(_ROUNDS):
                normal, slope = foot.equations(length)
                foot.ends = foot.ends - np.linalg.solve(normal, slope[..., None]).reshape(foot.ends.shape)
            foot.measure()
        if rng is not None:  # a motion's error is the same number of deviations in all frames
            root = np.linalg.cholesky(np.linalg.inv(normal))
            number = rng.standard_normal((*places.shape[:-3], 1, 6, 1))
            foot.ends = foot.ends + (root @ number).reshape(foot.ends.shape)
        known = np.isfinite(towards).any(axis=(1, 2))[:, None, None] & foot.known[..., None, None]
        parts.append(np.where(known, foot.ankle[..., None, :] + foot.ends, np.nan))
    return np.concatenate(parts, axis=-2)


class _Foot:
    """Heel and toe, `ends` (..., frames, 2, 3) from the ankle [m], and what pulls at them; unknown legs are still."""

    def __init__(self, places: np.ndarray, side: str, towards: np.ndarray, rays: FootRays):
        hip, knee, ankle = (places[..., _M[f"{side}_{joint}"], :] for joint in ("hip", "knee", "ankle"))
        across = places[..., _M["left_hip"], :] - places[..., _M["right_hip"], :]
        self.known = np.isfinite(hip + knee + ankle + across).all(axis=-1)
        filled = lambda v, other: np.where(self.known[..., None], v, np.array(other))
        leg = np.linalg.norm(hip - knee, axis=-1) + np.linalg.norm(knee - ankle, axis=-1)
        self.tall = np.nanmedian(leg, axis=-1)[..., None] / _LEG
        self.shank = unit(filled(ankle - knee, [0.0, 0.0, -1.0]))
        self.left = unit(filled(across, [0.0, 1.0, 0.0]) * [1.0, 1.0, 0.0])
        self.ankle = filled(ankle, 0.0)
        self.out = np.sin(_OUT if side == "left" else -_OUT)
        self.seen = np.isfinite(towards[..., 0])
        towards = np.nan_to_num(towards)
        self.across = (np.eye(3) - towards[..., :, None] * towards[..., None, :]) * self.seen[..., None, None]
        self.origins, self.width = rays.origins, max(rays.noise, _LEAST)
        ahead = np.cross(self.left, [0.0, 0.0, 1.0])
        shape = self.tall[..., None, None] * np.array([_HEEL, _TOE])
        self.ends = shape[..., :1] * ahead[..., None, :] + shape[..., 1:] * np.array([0.0, 0.0, 1.0])
        self.measure()

    def measure(self) -> None:
        """Take the present lengths (3, ..., 1) for the person's: the median over frames."""
        self.lengths = [np.median(np.linalg.norm(way, axis=-1), axis=-1)[..., None] for way in self._ways()]

    def _ways(self) -> list[np.ndarray]:
        return [np.einsum("k,...ka->...a", signs, self.ends) for signs in _SIGNS]

    def equations(self, spread: float) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix (..., frames, 6, 6) and slope (..., frames, 6), with a relative deviation of lengths."""
        off = np.einsum("tkab,...tkb->...tka", self.across, self.ends + (self.ankle - self.origins)[..., None, :])
        weight = 1 / (1 + (off**2).sum(axis=-1) / self.width**2 / _TAIL) ** 2 / self.width**2
        slope = (weight[..., None] * off).reshape(*off.shape[:-2], 6)
        normal = np.zeros((*off.shape[:-2], 6, 6))
        for k in (0, 1):
            normal[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = weight[..., k, None, None] * self.across[:, k]
        heel, _, foot = ways = self._ways()
        long = self.lengths[2]
        terms = [
            (_SIGNS[2], self.left, (foot * self.left).sum(-1) - self.out * long, _TURNED * long),
            (_SIGNS[0], self.left, (heel * self.left).sum(-1), _BESIDE * self.tall),
            (_SIGNS[2], self.shank, (foot * self.shank).sum(-1), _BENT * long),
        ]
        for signs, way, length in zip(_SIGNS, ways, self.lengths, strict=True):
            size = np.linalg.norm(way, axis=-1)
            terms.append((signs, way / size[..., None], size - length, np.hypot(spread * length, self.width)))
        for signs, along, residual, deviation in terms:
            slant = np.concatenate([signs[0] * along, signs[1] * along], axis=-1) / deviation[..., None]
            normal += slant[..., :, None] * slant[..., None, :]
            slope += (residual / deviation)[..., None] * slant
        return normal, slope
