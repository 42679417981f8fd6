"""Films of somebody who walks in a room of structure, by cameras that stand, turn, shake, walk or zoom, with the truth.

The room is a box, 12 m wide, 10 m deep and 3.5 m high, with a noise texture on each of its planes, so that cameras that
change their place see parallax. Pictures have noise of 4 grey levels, and MP4 compression where they are written.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from motionenv.body import LIMBS
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.render import render
from motionenv.render.cameras import look_at
from motionenv.types import MARKERS, Camera

FPS, WIDTH, HEIGHT = 30.0, 320, 240
KINDS = ("still", "shakes", "pans", "pans and shakes", "sways", "walks", "zooms")
PELVIS = MARKERS.index("pelvis")
_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_ROOM = np.array([[-6.0, -5.0, 0.0], [6.0, 5.0, 3.5]])  # [m]
_FINE = 40  # texels per metre
_NOISE = 4.0  # grey levels
_SHAKE = np.radians([0.5, 0.5, 0.25])  # rms about the camera's x, y and z axes [rad]
_BAND, _TREMOR = (1.0, 3.0), (4.0, 9.0)  # [Hz]; tremor has a tenth of the shake's amplitude


@dataclass(frozen=True)
class MovingFilm:
    """Pictures (T, height, width, 3), the true camera of each frame, and joints (T, 15, 3) [m]."""

    pictures: np.ndarray
    cameras: list[Camera]
    joints: np.ndarray

    @property
    def turns(self) -> np.ndarray:
        """True rotations (T, 3, 3) from the camera's axes in the first frame to those of each frame."""
        turned = np.stack([camera.R for camera in self.cameras])
        return turned @ turned[0].T


def shaken(rng: np.random.Generator, frames: int, fps: float = FPS) -> np.ndarray:
    """Rotation vectors (frames, 3) [rad] of a hand: `_SHAKE` from 1 to 3 Hz, and a tenth of it from 4 to 9 Hz."""
    time = np.arange(frames) / fps
    out = np.zeros((frames, 3))
    for band, share in ((_BAND, 1.0), (_TREMOR, 0.1)):
        rate, phase = rng.uniform(*band, (8, 3)), rng.uniform(0, 2 * np.pi, (8, 3))
        wave = np.sin(2 * np.pi * rate * time[:, None, None] + phase).sum(axis=1) / 2  # rms 1
        out += share * _SHAKE * wave
    return out


def moving_cameras(kind: str, joints: np.ndarray, rng: np.random.Generator) -> list[Camera]:
    """A camera of each frame, 3 to 4.5 m from joints (T, 15, 3) that stay around the origin."""
    frames, time = len(joints), np.arange(len(joints)) / FPS
    eye = np.array([rng.uniform(-0.7, 0.7), -rng.uniform(3.0, 4.5), rng.uniform(1.2, 1.8)])
    way = gaussian_filter(joints[:, PELVIS], (15, 0), mode="nearest")
    middle = way.mean(axis=0) * [1, 1, 0] + [0, 0, 0.95]
    follows = kind.startswith("pans") or kind == "walks"
    span = np.abs(joints - eye - (way - way.mean(axis=0))[:, None] * follows)
    wide = (span[..., 0] / span[..., 1]).max() * HEIGHT / WIDTH
    fov = 2 * np.degrees(np.arctan(max(1.25 * wide, 0.38)))
    out = []
    shake = shaken(rng, frames) * (kind in ("shakes", "pans and shakes", "sways", "walks"))
    sway = 0.007 * gaussian_filter(rng.standard_normal((frames, 3)), (8, 0)) * 5.3 * (kind == "sways")
    extra = rng.choice([-1, 1]) * np.radians(rng.uniform(8, 20)) * (kind.startswith("pans"))
    for t in range(frames):
        place = eye + sway[t] + ([0.7 * (time[t] - time.mean()), 0, 0] if kind == "walks" else 0)
        aim = way[t] * [1, 1, 0] + [0, 0, 0.95] if follows else middle
        zoom = 1 + 0.3 * np.sin(0.8 * time[t]) if kind == "zooms" else 1.0
        camera = look_at(place, aim, width=WIDTH, height=HEIGHT, fov_degrees=fov)
        pan = [0, extra * (t / max(frames - 1, 1) - 0.5), 0]
        R = Rotation.from_rotvec(shake[t]).as_matrix() @ Rotation.from_rotvec(pan).as_matrix() @ camera.R
        K = camera.K * [[zoom], [zoom], [1]]
        K[:2, 2] = camera.K[:2, 2]
        out.append(Camera(K, R, -R @ place, WIDTH, HEIGHT))
    return out


def moving_film(kind: str, joints: np.ndarray, rng: np.random.Generator, texture: float = 1.0) -> MovingFilm:
    """A film of joints (T, 15, 3); `texture` is the contrast of the room."""
    joints = joints - np.nanmean(joints[:, PELVIS], axis=0) * [1, 1, 0]
    cameras = moving_cameras(kind, joints, rng)
    nodes = np.concatenate([joints, joints[:, _SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
    body = fit_skeleton(nodes)
    limbs = np.asarray(render(fit_poses(nodes, body, FPS), body, cameras, rgb=False).limbs).astype(int)
    walls = [_texture(rng, texture) for _ in range(6)]
    colours = clothes(rng)
    pictures = np.empty((*limbs.shape, 3), np.uint8)
    for t, camera in enumerate(cameras):
        seen = np.where(limbs[t][..., None] > 0, colours[limbs[t]], _room(camera, walls))
        pictures[t] = np.clip(seen + _NOISE * rng.standard_normal(seen.shape), 0, 255)
    return MovingFilm(pictures, cameras, joints)


def clothes(rng: np.random.Generator) -> np.ndarray:
    """A colour (1 + limbs, 3) of nothing and of each limb; those of its left and its right are the same."""
    kinds = ["", *(limb.removeprefix("left_").removeprefix("right_") for limb in LIMBS)]
    colours = dict(zip(sorted(set(kinds)), rng.integers(0, 255, (len(set(kinds)), 3)), strict=True))
    return np.array([colours[kind] for kind in kinds], np.float32)


def boxes(points: np.ndarray) -> list[np.ndarray]:
    """Boxes (1, 4) around a person's points (T, 15, 2), a tenth wider on each side, in each frame."""
    low, high = np.nanmin(points, axis=1), np.nanmax(points, axis=1)
    edge = 0.1 * (high - low).max(axis=1, keepdims=True)
    return [box[None] for box in np.concatenate([low - edge, high + edge], axis=1)]


def _texture(rng: np.random.Generator, contrast: float) -> np.ndarray:
    rough = sum(gaussian_filter(rng.standard_normal((512, 512)), s, mode="wrap") * s for s in (1.5, 4, 12, 30))
    return rng.uniform(90, 170) + contrast * 30 * rough / rough.std()


def _room(camera: Camera, walls: list[np.ndarray]) -> np.ndarray:
    """What the camera sees of the room (height, width, 1)."""
    v, u = np.mgrid[: camera.height, : camera.width]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T @ camera.R
    ahead = (rays > 0).astype(int)
    with np.errstate(divide="ignore"):
        far = (_ROOM[ahead, [0, 1, 2]] - camera.centre) / rays
    axis = far.argmin(axis=-1)
    at = (camera.centre + rays * far.min(axis=-1)[..., None]) * _FINE
    out = np.empty(axis.shape)
    for number, wall in enumerate(walls):
        across = [i for i in range(3) if i != number // 2]
        here = (axis == number // 2) & (np.take_along_axis(ahead, axis[..., None], -1)[..., 0] == number % 2)
        out[here] = map_coordinates(wall, at[here][:, across].T, order=1, mode="grid-wrap")
    return out[..., None]
