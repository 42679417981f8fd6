"""A straight walk bent along a path: the ground is warped, so that feet that stand keep their places.

A foot or a body at (x, y) of the straight walk goes to the point of the path at arc length x, and y to its left. This
alone makes inner steps shorter than outer ones, and feet point into the turn before the body does, as people's do
(Courtine & Schieppati 2003, Eur J Neurosci 18, 177-190).

- The body leans inwards by arctan(v² κ / g), at which gravity and the centrifugal force act along it. So feet keep
  outside the path, on which the pelvis stays.
- The head turns to where the body will head in 0.2 s (there, p. 184).
"""

from dataclasses import replace

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.paths._steps import Steps, posed, steps_of
from motionenv.models.paths.path import WalkPath
from motionenv.types import POSE, Motion, Skeleton

GRAVITY = 9.81  #: [m/s²]
_HALF = 0.3  # [m] before and behind over which a body's heading and curvature are averaged
AHEAD = 0.2  #: [s] by which the head anticipates the turn
HEAD_MOST = np.radians(40.0)  #: by which the head turns against the body at most
#: Standard deviation [rad/s] and correlation time [s] of the rate at which people turn: at 0.8 to 1.5 m/s along a
#: `random_path` with a least radius of 1 to 2.5 m, the former is 0.43.
TURN_RATE, TURN_MEMORY = 0.5, 1.0
LEAN_MOST = np.radians(20.0)  #: at a greater lean people run
_OBLIQUITY, _HEADING, _NECK = (POSE.index(n) for n in ("root_obliquity", "root_heading", "neck_rotation"))


def bend(motion: Motion, path: WalkPath, *, start: float = 0.0) -> Motion:
    """The walk `motion` along `path` instead of along x: legs bend otherwise, limbs stay as long.

    Args:
        motion: a walk along x (frames, 25) on z = 0, of a model or captured; neck and arms may be unknown.
        path: where to walk; beyond its ends it goes straight on.
        start: arc length [m] at which x = 0 lies.

    Raises:
        MotionError: not one motion, or too fast for the path's turns: they would take a lean of more than 20°.
        GapError: unknown legs or root.
    """
    return Motion(bent(steps_of(motion), path, start, motion.skeleton), motion.skeleton, motion.fps, motion.name)


def bent(steps: Steps, path: WalkPath, start: float, skeleton: Skeleton) -> np.ndarray:
    """Poses (frames, 25) of the straight `steps` on `path`; see `bend`."""
    root, speed = steps.poses[:, 0] + start, steps.speed
    lean = _lean(path, root, speed)
    forth = np.maximum.accumulate(root)
    balls = steps.balls[..., 0] + start
    # A foot is as far outside as the body will lean above it: a map of the ground, so that it stands still.
    outwards = np.mean(steps.poses[:, 2]) * np.tan(_lean(path, balls, np.interp(balls, forth, speed)))
    poses = steps.poses.copy()
    poses[:, :2] = _placed(path, root, steps.poses[:, 1])
    poses[:, _HEADING] += _heading(path, root)
    poses[:, _OBLIQUITY] -= lean
    later = _heading(path, root + AHEAD * speed) - _heading(path, root)
    poses[:, _NECK] += HEAD_MOST * np.tanh(later / HEAD_MOST)
    placed = _placed(path, balls, steps.balls[..., 1] - outwards)
    return posed(replace(steps, poses=poses, balls=placed, yaws=steps.yaws + _heading(path, balls)), skeleton)


def _placed(path: WalkPath, along, left) -> np.ndarray:
    """Points (..., 2) [m] beside the path."""
    heading = path.heading(along)
    return path.position(along) + left[..., None] * np.stack([-np.sin(heading), np.cos(heading)], axis=-1)


def _heading(path: WalkPath, along) -> np.ndarray:
    """The path's mean heading (...) [rad] around arc lengths `along` (...) [m]: that of a body there."""
    spread = np.linspace(-_HALF, _HALF, 13)
    return path.heading(np.asarray(along)[..., None] + spread).mean(-1)


def _lean(path: WalkPath, along, speed) -> np.ndarray:
    """Lean to the left (...) [rad] at arc lengths `along` (...) [m] with `speed` (...) [m/s]."""
    curvature = (path.heading(along + _HALF) - path.heading(along - _HALF)) / (2 * _HALF)
    lean = np.arctan(speed**2 * curvature / GRAVITY)
    if (steepest := np.abs(lean).max()) > LEAN_MOST:
        at = np.unravel_index(np.abs(lean).argmax(), lean.shape)
        raise MotionError(
            f"speed {speed[at]:.2f} m/s is too fast for a turn with a radius of {1 / abs(curvature[at]):.2f} m: people "
            f"would lean by {np.degrees(steepest):.0f}°; walk slower or on a rounder path",
            "path",
        )
    return lean
