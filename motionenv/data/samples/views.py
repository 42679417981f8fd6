"""Cameras of a group's samples, and which joints their pictures show."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionenv.body import LIMBS
from motionenv.data.samples.walkers import PELVIS
from motionenv.data.specification import Specification
from motionenv.types import MARKERS

_BESIDE = 0.09  # body heights by which head, hands and toes reach beyond the markers
_NEAREST = 0.5  # [m] least depth of a marker
_SMOOTH = 0.5  # [s] standard deviation of the smoothing of a following camera's way


@dataclass(frozen=True, eq=False)
class Views:
    """Cameras of n clips in OpenCV's convention.

    Attributes:
        K, R: (n, 3, 3) intrinsics [pixels] and rotations world → camera.
        t: (n, frames, 3) translations [m] of each frame.
        pan: (n, frames) [m] that the camera has moved to its right since the first frame.
    """

    K: np.ndarray
    R: np.ndarray
    t: np.ndarray
    pan: np.ndarray

    def project(self, points: np.ndarray, which: slice | np.ndarray = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (n, frames, k, 2) and depths (n, frames, k) [m] of `points` (n, frames, k, 3) [m] in clips `which`."""
        seen = points @ self.R[which].transpose(0, 2, 1)[:, None] + self.t[which][:, :, None]
        depth = seen[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = seen[..., :2] / depth[..., None]
        focal, centre = self.K[which][:, 0, 0], self.K[which][:, :2, 2]
        return flat * focal[:, None, None, None] + centre[:, None, None], depth


def place(spec: Specification, joints: np.ndarray, heights: np.ndarray, rng: np.random.Generator) -> Views:
    """Draw a camera for each of n clips, whose walkers have `joints` (n, frames, 15, 3) [m] and `heights` (n,) [m].

    The walkers head for +x on average.
    """
    n = len(joints)
    wanted, size = spec.cameras, (spec.pictures.width, spec.pictures.height)
    alpha, elevation, opening = (
        np.radians(rng.uniform(*limits, n)) for limits in (wanted.angle, wanted.elevation, wanted.field_of_view)
    )
    margins, inside = rng.uniform(*wanted.margin, (n, 2, 2)), rng.random((n, 2))
    distance, follows = rng.uniform(*(wanted.distance or (1.0, 1.0)), n), rng.random(n) < wanted.follow
    K, R = _intrinsics(opening, size), _rotations(alpha, elevation)
    way = _ways(joints[:, :, PELVIS, :2], spec.fps) * follows[:, None, None]
    seen = (joints - way[:, :, None]) @ R.transpose(0, 2, 1)[:, None]
    seen = seen.reshape(n, -1, 3)
    beside = _BESIDE * heights[:, None]
    # A point is within the margins of an axis if (x - camera's x) / (z - camera's z) is from `low` to `high`. So the
    # camera's x is from `least + high z` to `most + low z`, and the largest z that leaves room is the nearest one.
    half = np.array(size) / 2
    low = (2 * margins[..., 0] - 1) * half / K[:, 0, :1]
    high = (1 - 2 * margins[..., 1]) * half / K[:, 0, :1]
    most = (seen[..., :2] - low[:, None] * seen[..., 2:]).min(axis=1) - beside
    least = (seen[..., :2] - high[:, None] * seen[..., 2:]).max(axis=1) + beside
    z = ((most - least) / (high - low)).min(axis=1)
    if wanted.distance is not None:
        z = seen[:, PELVIS::15, 2].mean(axis=1) - distance
    z = np.minimum(z, seen[..., 2].min(axis=1) - _NEAREST)[:, None]
    between = least + high * z + inside * (most + low * z - least - high * z)
    centre = np.concatenate([between, z], axis=1)
    t = -centre[:, None] - np.einsum("nij,ntj->nti", R, way)
    return Views(K, R, t, np.einsum("ntj,nj->nt", way - way[:, :1], R[:, 0]))


def _intrinsics(opening: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """K (n, 3, 3) of cameras with a vertical field of view (n,) [rad], square pixels, and the centre in the middle."""
    K = np.zeros((len(opening), 3, 3))
    K[:, 0, 0] = K[:, 1, 1] = size[1] / 2 / np.tan(opening / 2)
    K[:, 0, 2], K[:, 1, 2], K[:, 2, 2] = (size[0] - 1) / 2, (size[1] - 1) / 2, 1.0
    return K


def _rotations(alpha: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    zero, level = np.zeros_like(alpha), np.cos(elevation)
    right = np.stack([np.cos(alpha), np.sin(alpha), zero], axis=-1)
    forward = np.stack([-np.sin(alpha) * level, np.cos(alpha) * level, -np.sin(elevation)], axis=-1)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def _ways(ground: np.ndarray, fps: float) -> np.ndarray:
    """The ways (n, frames, 3) [m] of walkers' pelves (n, frames, 2) without the sway of steps, on the ground."""
    frames = ground.shape[1]
    time = np.arange(frames) - (frames - 1) / 2
    slope = np.einsum("t,ntj->nj", time, ground) / max(time @ time, 1.0)
    line = ground.mean(axis=1)[:, None] + time[:, None] * slope[:, None]
    way = line + gaussian_filter1d(ground - line, _SMOOTH * fps, axis=1, mode="nearest")
    return np.concatenate([way, np.zeros((*way.shape[:2], 1))], axis=-1)


_SKIN = 0.02  # [m] by which a pixel's surface may be nearer than a point of the face in it
#: Values of visibility, as in COCO.
OUTSIDE, HIDDEN, SEEN = 0, 1, 2

_TRUNK = ("left_trunk", "right_trunk")
_CHEST = (*_TRUNK, "left_shoulder", "right_shoulder")
# Limbs that meet at a joint, and so don't hide it; {} is the joint's side.
_MEET = {
    "head": ("head", "neck", "hair"), "sternum": (*_CHEST, "neck"),
    "pelvis": (*_TRUNK, "pelvis", "left_thigh", "right_thigh"), "hip": (*_TRUNK, "pelvis", "{}_thigh"),
    "knee": ("{}_thigh", "{}_shin"), "ankle": ("{}_shin", "{}_foot"), "shoulder": (*_CHEST, "{}_upper_arm"),
    "elbow": ("{}_upper_arm", "{}_forearm"), "wrist": ("{}_forearm", "{}_hand"),
}  # fmt: skip
_MEETS = np.zeros((len(MARKERS), 1 + len(LIMBS)), bool)  # at joints (rows), the limbs with these ids
for _row, _name in zip(_MEETS, MARKERS, strict=True):
    _side, _, _part = _name.rpartition("_")
    _row[[1 + LIMBS.index(_limb.format(_side)) for _limb in _MEET[_part]]] = True


def visibility(pixels: np.ndarray, depth: np.ndarray, drawn: dict[str, np.ndarray], number: int) -> np.ndarray:
    """Whether joints are outside the picture (0), hidden (1) or seen (2), (n, frames, 15) uint8.

    A joint is seen if its pixel shows one of the limbs that meet there, or nothing nearer than the joint.

    Args:
        pixels, depth: (n, frames, 15, 2) and (n, frames, 15) [m] of the joints; not above 0 is behind the camera.
        drawn: `depth`, `limbs` and `people` (n, frames, height, width) of the pictures.
        number: of the person in `people`.
    """
    inside, at = _pictured(pixels, depth, drawn)
    own = (drawn["people"][at] == number) & _MEETS[np.arange(len(MARKERS)), drawn["limbs"][at]]
    return np.where(inside, np.where(own | (drawn["depth"][at] >= depth), SEEN, HIDDEN), OUTSIDE).astype(np.uint8)


def face_visibility(pixels: np.ndarray, depth: np.ndarray, drawn: dict[str, np.ndarray]) -> np.ndarray:
    """`visibility` of points of the face, (n, frames, 5): they lie on the surface, so nothing may be nearer."""
    inside, at = _pictured(pixels, depth, drawn)
    return np.where(inside, np.where(drawn["depth"][at] >= depth - _SKIN, SEEN, HIDDEN), OUTSIDE).astype(np.uint8)


def _pictured(pixels: np.ndarray, depth: np.ndarray, drawn: dict[str, np.ndarray]) -> tuple[np.ndarray, tuple]:
    """Whether points (n, frames, k) are inside their picture, and the indices of their pixels in `drawn`."""
    rows, columns = drawn["depth"].shape[-2:]
    with np.errstate(invalid="ignore"):
        inside = ((pixels > -0.5) & (pixels < np.array([columns, rows]) - 0.5)).all(-1) & (depth > 0)
    at = np.where(inside[..., None], pixels, 0)
    column, row = np.rint(at[..., 0]).astype(np.intp), np.rint(at[..., 1]).astype(np.intp)
    n, frame = np.ogrid[: len(pixels), : pixels.shape[1]]
    return inside, (n[..., None], frame[..., None], row, column)
