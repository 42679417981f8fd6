"""Placement of cameras and people."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from motionenv._core.validation import checked_choice, is_number
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.types import MARKERS, Motion, Skeleton

#: Vertical field of view of every camera [degrees].
FOV = 40.0
#: Height of a camera for walkers [m].
EYE = 1.1

#: How people start, by name: the largest angle between their path and the x axis [rad], along which they may walk
#: either way, and the range of their distances from the camera [m]. On the line everybody walks along +x.
STARTS = {"line": (0.0, 0.0), "near": (math.pi / 6, 2.0), "anywhere": (math.pi / 2, 4.0)}
#: How people go on.
PATHS = ("straight", "turning")

_NAMED = {"side": 0.0, "front": 90.0}
_EDGE = math.tan(math.radians(FOV / 2))  # half width of an image at depth 1
_NEAREST = 3.5  # [m] least distance from the camera to the world's origin
_PACE = 1.5  # [m/s] that static cameras, and the reach of actions, expect of walkers
_SHARPEST = 1.5  # [m] least radius of a turn
_ROOM = 2.0  # [m] reach of actions beyond half of a path
_BESIDE, _BELOW, _BEFORE = 0.55, 1.15, 0.3  # [m] extent of a body beside its root, below the camera, before its root
_SMOOTH = 0.5  # [s] averaging time of a following camera
_BEHIND = 2.0  # distance of the background relative to the walker's
_SHOULDER = MARKERS.index("right_shoulder")
_ARM_DISTANCE = 2.4  # [m] keeps an arm of 0.8 m including its hand inside the image


@dataclass(frozen=True)
class Placed:
    """A level camera's pose in one episode.

    Attributes:
        R: (3, 3) rotation world → camera.
        t: (3,) translation world → camera [m].
        way: (frames,) distance that the camera has moved to its right since the start [m].
        behind: distance to the background [m].
        away: distance to the middle of the person's path [m].
    """

    R: np.ndarray
    t: np.ndarray
    way: np.ndarray
    behind: float
    away: float


class View(Protocol):
    """Placement of people and cameras; normalised actions say x and y up to `reach` [m]."""

    reach: float

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        """Move `poses` (frames, 25) of a `body` in place to the world, and place a camera, with the episode's `rng`."""


class WalkingView:
    """Walkers in the centre of the image: their whole path or, if followed, themselves.

    Args:
        camera: "side", "front", a view angle in degrees, "random" (any angle), or "follow" (from the side).
        fps, seconds: frame rate [Hz], and duration of an episode.
        start, path: one of `STARTS`, and one of `PATHS`.

    Raises:
        MotionError: no such camera, start or path.
    """

    def __init__(
        self, camera: str | float, fps: float, seconds: float = 3.0, start: str = "line", path: str = "straight"
    ) -> None:
        if camera != "follow":
            checked_angle(camera, "follow")
        checked_choice(start, "start", STARTS)
        checked_choice(path, "path", PATHS)
        self.camera, self.fps, self.start, self.path = camera, fps, start, path
        self._turn, self._deep = STARTS[start]
        self._distance = _NEAREST + _PACE * seconds
        self.reach = _ROOM if camera == "follow" else _ROOM + _PACE * seconds + self._deep

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        way, R = np.zeros(len(poses)), level(0.0 if self.camera == "follow" else drawn_angle(self.camera, rng))
        if self.path == "turning":
            poses[:] = _bent(poses, body, self.fps, rng)
        if self.start != "line":
            _turn(poses, rng.uniform(-self._turn, self._turn) + math.pi * rng.integers(2))
        ground = poses[:, :2].copy()
        if self.camera == "follow":
            path = _smoothed(ground, _SMOOTH * self.fps)
            ground -= path
            way = (path - path[0]) @ R[0, :2]
        else:
            ground -= (ground.min(0) + ground.max(0)) / 2
        across, depth = ground @ R[0, :2], ground @ R[2, :2]
        below = _BELOW + max(0.0, body.height - 1.95)
        beside = np.abs(across) + _BESIDE
        away = max(_NEAREST, float((beside / _EDGE - depth).max()), below / _EDGE + _BEFORE - float(depth.min()))
        distance = away
        if self.start != "line" and self.camera != "follow":
            away, distance = away + self._deep * rng.random(), self._distance
            room = _EDGE * (depth + away) - _BESIDE  # half of the width that is in view
            aside = rng.uniform((-room - across).max(), (room - across).min())
            ground += aside * R[0, :2] + (away - distance) * R[2, :2]
        poses[:, :2] = ground
        return Placed(R, np.array([0.0, EYE, distance]), way, _BEHIND * max(away, distance), away)


class ArmView:
    """The right shoulder in the image's centre, at a fixed distance, from a `camera` angle as of `checked_angle`."""

    def __init__(self, camera: str | float) -> None:
        self.camera, self.reach = checked_angle(camera), _ROOM

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        R = level(drawn_angle(self.camera, rng))
        shoulder = markers(poses[0], body)[_SHOULDER]
        t, behind = [0.0, 0.0, _ARM_DISTANCE] - R @ shoulder, _BEHIND * _ARM_DISTANCE
        return Placed(R, t, np.zeros(len(poses)), behind, _ARM_DISTANCE)


def level(angle: float) -> np.ndarray:
    """Rotation (3, 3) from the world to a level camera at view angle `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [0.0, 0.0, -1.0], [-s, c, 0.0]])


def drawn_angle(camera: str | float, rng: np.random.Generator) -> float:
    """The view angle [rad] of an episode, from a `camera` that `checked_angle` allows, drawn with `rng` if "random"."""
    if camera == "random":
        return float(rng.uniform(-math.pi, math.pi))
    return math.radians(_NAMED[camera] if isinstance(camera, str) else camera)


def checked_angle(camera: str | float, *others: str) -> str | float:
    """`camera`, which must be "side", "front", "random", or a finite number of degrees; otherwise raises MotionError.

    The message lists `others`, further allowed values, too.
    """
    known = camera in {*_NAMED, "random"} if isinstance(camera, str) else is_number(camera) and math.isfinite(camera)
    if not known:
        names = ", ".join([*_NAMED, "random", *others])
        raise MotionError(f"camera must be {names}, or a view angle in degrees, got {camera!r}")
    return camera


def _bent(poses: np.ndarray, body: Skeleton, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Poses (frames, 25) of a walk along x, on a random path that they can take without leaning by more than 12°."""
    from motionenv.models.paths import bend, random_path

    walk = poses.copy()
    walk[:, :2] -= poses[0, :2]
    length = max(1.0, float(walk[:, 0].max()))
    speed = length * fps / len(walk)
    path = random_path(rng, length + _ROOM, radius=max(_SHARPEST, 0.5 * speed**2))
    return bend(Motion(walk, body, fps), path).poses


def _turn(poses: np.ndarray, angle: float) -> None:
    """Turn poses (frames, 25) about the vertical through the origin, in place, by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    poses[:, :2] = poses[:, :2] @ np.array([[c, s], [-s, c]])
    poses[:, 5] += angle


def _smoothed(path: np.ndarray, frames: float) -> np.ndarray:
    """A path (T, 2) [m] without the sway of steps: its straight line plus the low-pass filtered deviation."""
    from scipy.ndimage import gaussian_filter1d

    time = np.arange(len(path)) - (len(path) - 1) / 2
    line = path.mean(0) + np.outer(time, time @ path / max(time @ time, 1.0))
    return line + gaussian_filter1d(path - line, frames, axis=0, mode="nearest")
