"""Baselines of lifting: the mean posture, and the nearest neighbour in a database of postures.

Both see one frame at a time, orthographically along the ray to the middle of the body, and know the camera's elevation.
The mean posture may be turned, in steps of 5 degrees, as it fits the points best; the database holds postures of the
clips that the network learned from, each turned in steps of 15 degrees. Sizes are those of an average adult. A
temporal network of VideoPose3D's kind, dilated convolutions over 4 seconds and trained on the same clips, is the
benchmark's column "network alone".
"""

import numpy as np
from scipy.spatial import cKDTree

from motionenv.lifting.free.posture_network import BODY_UNIT
from motionenv.lifting.free.rays import rays_of
from motionenv.types import MARKERS, Camera, Points

_PELVIS = MARKERS.index("pelvis")
_ELEVATIONS = np.radians(np.arange(-5, 30, 5))  # by how much the ray to the body looks down


class Neighbours:
    """Postures by how they look."""

    def __init__(self, postures: np.ndarray, headings: int):
        """Postures (n, 15, 3) about the pelvis [m], each turned to so many headings."""
        angles = np.linspace(0, 2 * np.pi, headings, endpoint=False)
        c, s = np.cos(angles), np.sin(angles)
        zero = np.zeros_like(c)
        turns = np.stack(
            [np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.tile([0, 0, 1.0], (headings, 1))], 1
        )
        self.postures = np.einsum("hij,nmj->hnmi", turns, postures).reshape(-1, len(MARKERS), 3)
        self.trees = [cKDTree(_look(self.postures, down)) for down in _ELEVATIONS]

    def lift(self, points: Points, camera: Camera) -> np.ndarray:
        """Postures (frames, 15, 3) [m] in the camera's world, of points without gaps."""
        rays = rays_of(points.positions, camera).directions
        middle = rays.mean(axis=1)
        ahead, down = np.arctan2(middle[:, 1], middle[:, 0]), -np.arcsin(middle[:, 2] / np.linalg.norm(middle, axis=1))
        flat = np.stack([np.arctan2(rays[..., 1], rays[..., 0]) - ahead[:, None], np.arcsin(rays[..., 2])], axis=-1)
        flat[..., 0] = (flat[..., 0] + np.pi) % (2 * np.pi) - np.pi
        nearest = np.abs(down[:, None] - _ELEVATIONS).argmin(axis=1)
        looks = _normalised(flat)
        out = np.empty((len(rays), len(MARKERS), 3))
        for k, tree in enumerate(self.trees):
            here = nearest == k
            if here.any():
                out[here] = self.postures[tree.query(looks[here])[1]]
        c, s = np.cos(ahead), np.sin(ahead)
        x, y, z = np.moveaxis(out, -1, 0)
        return np.stack([c[:, None] * x - s[:, None] * y, s[:, None] * x + c[:, None] * y, z], axis=-1)


def _look(postures: np.ndarray, down: float) -> np.ndarray:
    """How postures (n, 15, 3) look along x, `down` [rad] from level: (n, 30)."""
    x, y, z = np.moveaxis(postures, -1, 0)
    return _normalised(np.stack([y, z * np.cos(down) + x * np.sin(down)], axis=-1))


def _normalised(flat: np.ndarray) -> np.ndarray:
    """Places in the picture (n, 15, 2) about their middle, in units of their spread, as (n, 30)."""
    off = flat - flat.mean(axis=1, keepdims=True)
    return (off / np.sqrt((off**2).mean(axis=(1, 2), keepdims=True))).reshape(len(flat), -1)


def postures_of(clips: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """At most `count` random postures (…, 15, 3) [m] of clips (n, frames, 15, 3), facing x, of an average adult."""
    frames = clips.reshape(-1, len(MARKERS), 3)
    frames = frames[np.isfinite(frames[:, 0, 0])]
    chosen = frames[np.random.default_rng(seed).permutation(len(frames))[:count]].astype(float)
    chosen -= chosen[:, [_PELVIS]]
    across = sum(
        chosen[:, MARKERS.index(f"left_{name}"), :2] - chosen[:, MARKERS.index(f"right_{name}"), :2]
        for name in ("hip", "shoulder")
    )
    heading = np.arctan2(-across[:, 0], across[:, 1])
    c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, y, z = np.moveaxis(chosen, -1, 0)
    facing = np.stack([c * x + s * y, -s * x + c * y, z], axis=-1)
    return facing * 2.88 * BODY_UNIT / _length(facing)[:, None, None]


def _length(postures: np.ndarray) -> np.ndarray:
    """Length (n,) [m] along the body from sternum to ankle."""
    way = lambda a, b: np.linalg.norm(postures[:, MARKERS.index(a)] - postures[:, MARKERS.index(b)], axis=-1)
    legs = [way(f"{side}_hip", f"{side}_knee") + way(f"{side}_knee", f"{side}_ankle") for side in ("left", "right")]
    return way("sternum", "pelvis") + 0.5 * (legs[0] + legs[1])


def errors(clips: np.ndarray, sequences: list[tuple[Points, Camera]]) -> dict[str, float]:
    """MPJPE [mm] of both baselines, by name, over sequences with their truth."""
    postures = postures_of(clips, 4000)
    tried = {
        "mean posture": Neighbours(postures.mean(axis=0, keepdims=True), 72),
        "nearest neighbour": Neighbours(postures, 24),
    }
    out = {}
    for name, neighbours in tried.items():
        each = []
        for points, camera in sequences:
            truth = points.truth.positions
            off = neighbours.lift(points, camera) - (truth - truth[:, [_PELVIS]])
            each.append(1e3 * float(np.linalg.norm(off, axis=-1).mean()))
        out[name] = float(np.mean(each))
    return out
