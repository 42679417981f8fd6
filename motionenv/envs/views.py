"""Where cameras stand, and where people are put before them."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.types import MARKERS, Skeleton

#: Vertical field of view of every camera [degrees].
FOV = 40.0
#: Height of a camera that watches walkers [m].
EYE = 1.1

_NAMED = {"side": 0.0, "front": 90.0}
_EDGE = math.tan(math.radians(FOV / 2))  # what a picture shows to each side of its middle, at a depth of 1
_NEAREST = 3.5  # metres from the camera to the world's origin, at least
_BESIDE, _BELOW, _BEFORE = 0.55, 1.15, 0.3  # metres that a body may take beside, under the eye, and before its root
_SMOOTH = 0.5  # seconds over which a camera that follows averages
_BEHIND = 2.0  # the background is this many times as far away as the walker
_SHOULDER = MARKERS.index("right_shoulder")
_ARM_DISTANCE = 2.4  # metres, so that an arm of 0.8 m with its hand stays in the picture wherever it reaches


@dataclass(frozen=True)
class Placed:
    """A level camera's place in one episode.

    Attributes:
        R: (3, 3) rotation world → camera.
        t: (3,) translation world → camera [m].
        way: (frames,) how far the camera has travelled to its right [m] since the start.
        behind: distance to the background [m].
    """

    R: np.ndarray
    t: np.ndarray
    way: np.ndarray
    behind: float


class View(Protocol):
    """How people and cameras are placed."""

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        """Move poses (frames, 25), in place, to where they belong in the world, and put a camera before them.

        Args:
            poses: the motion of an episode.
            body: of whom.
            rng: the episode's.
        """


class WalkingView:
    """Walkers in the middle of the picture: all of their way, or, followed, they themselves.

    Args:
        camera: "side", "front", a view angle in degrees, "random" (any angle), or "follow" (from the side).
        fps: frames per second.
    """

    def __init__(self, camera: str | float, fps: float):
        if camera != "follow":
            checked_angle(camera, "follow")
        self.camera, self.fps = camera, fps

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        """As `View.place`, of `poses` of `body` with `rng`."""
        ground = poses[:, :2].copy()
        if self.camera == "follow":
            path, R = _smoothed(ground, _SMOOTH * self.fps), level(0.0)
            ground -= path
            way = (path - path[0]) @ R[0, :2]
        else:
            way, R = np.zeros(len(poses)), level(drawn_angle(self.camera, rng))
            ground -= (ground.min(0) + ground.max(0)) / 2
        poses[:, :2] = ground
        across, depth = ground @ R[0, :2], ground @ R[2, :2]
        below = _BELOW + max(0.0, body.height - 1.95)
        beside = np.abs(across, out=across) + _BESIDE
        distance = max(_NEAREST, float((beside / _EDGE - depth).max()), below / _EDGE + _BEFORE - float(depth.min()))
        return Placed(R, np.array([0.0, EYE, distance]), way, _BEHIND * distance)


class ArmView:
    """The right shoulder in the middle of the picture, at a fixed distance.

    Args:
        camera: "side", "front", a view angle in degrees, or "random" (any angle).
    """

    def __init__(self, camera: str | float):
        self.camera = checked_angle(camera)

    def place(self, poses: np.ndarray, body: Skeleton, rng: np.random.Generator) -> Placed:
        """As `View.place`, of `poses` of `body` with `rng`."""
        R = level(drawn_angle(self.camera, rng))
        shoulder = markers(poses[0], body)[_SHOULDER]
        return Placed(R, [0.0, 0.0, _ARM_DISTANCE] - R @ shoulder, np.zeros(len(poses)), _BEHIND * _ARM_DISTANCE)


def level(angle: float) -> np.ndarray:
    """Rotation (3, 3) world → a level camera at view angle `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [0.0, 0.0, -1.0], [-s, c, 0.0]])


def drawn_angle(camera: str | float, rng: np.random.Generator) -> float:
    """The view angle [rad] of an episode.

    Args:
        camera: what `checked_angle` lets pass.
        rng: the episode's.
    """
    if camera == "random":
        return float(rng.uniform(-math.pi, math.pi))
    return math.radians(_NAMED[camera] if isinstance(camera, str) else camera)


def checked_angle(camera: str | float, *others: str) -> str | float:
    """`camera`: "side", "front", "random", or a finite number of degrees.

    Args:
        camera: what was asked for.
        others: what else could have been; for the message.

    Raises:
        MotionError: something else.
    """
    named = isinstance(camera, str) and camera in {*_NAMED, "random"}
    number = isinstance(camera, int | float) and not isinstance(camera, bool) and math.isfinite(camera)
    if not (named or number):
        known = ", ".join([*_NAMED, "random", *others])
        raise MotionError(f"camera must be {known}, or a view angle in degrees, got {camera!r}")
    return camera


def _smoothed(path: np.ndarray, frames: float) -> np.ndarray:
    """A path (T, 2) [m] without the swaying of steps: its straight line, and a low-pass of what departs from it."""
    from scipy.ndimage import gaussian_filter1d

    time = np.arange(len(path)) - (len(path) - 1) / 2
    line = path.mean(0) + np.outer(time, time @ path / max(time @ time, 1.0))
    return line + gaussian_filter1d(path - line, frames, axis=0, mode="nearest")
