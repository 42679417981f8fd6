"""Motion without end, whose parameters change while it runs.

A steerable model grows frame by frame. Others make half a minute at a time; where one piece ends, or parameters change,
the next one begins at the frame of its first seconds whose pose and movement are nearest, moved to where the body is,
and what is left of the difference decays.
"""

import math
from collections.abc import Iterator
from itertools import chain, count
from typing import Any

import numpy as np

import motionenv
from motionenv import Motion
from motionenv.arguments import WALK_ARGUMENTS
from motionenv.models import GaitModel, Target
from service.schemas.stream import StreamSettings

_PIECE = 30.0  # [s]
_SEARCHED = 2.0  # [s] of a new piece in which its beginning is looked for
_QUICK = 10.0  # [1/s] by which differences decay


class Stream:
    """One motion without end, at `fps`, of a body of `height` [m]; `models` gives the model of a name."""

    def __init__(self, models: Any, settings: StreamSettings) -> None:
        self._models, self._pieces, self._last, self.settings = models, 0, np.zeros((0, 25)), settings
        self._growth: Any = None
        self._begin(settings)

    def change(self, settings: StreamSettings) -> None:
        """Go on with all these settings; what grows is steered as it goes, and standing still changes nothing.

        Raises:
            MotionError: settings that don't go together.
            Problem: there is no such model.
        """
        steering = ("paused",) if self._growth is None else ("paused", "speed", "heading", "activity")
        steered = self.settings.model_copy(update={name: getattr(settings, name) for name in steering})
        if settings != steered:
            self._begin(settings)
            return
        if self._growth is not None:
            self._growth.target = _target(settings)
        self.settings = settings

    def _begin(self, settings: StreamSettings) -> None:
        model, growth = self._models(settings.model), None
        if model.steerable:
            growth = _grown(model, settings, self._last, self._pieces)
            frames: Iterator = (growth.step(1)[0] for _ in count())
            height, fps = growth.skeleton.height, growth.fps
        else:
            frames, height, fps = _walked(model, settings, self._last, self._pieces)
        first = next(frames)  # here, where it may take long: the first one ever compiles the kernels
        self._frames, self._growth = chain([first], frames), growth
        self.settings, self.height, self.fps = settings, height, fps
        self._pieces += 1

    def next(self) -> np.ndarray:
        """The next pose (25,) [m, rad]."""
        pose = next(self._frames, None)
        if pose is None:
            self._begin(self.settings)
            pose = next(self._frames)
        self._last = np.concatenate([self._last[-11:], pose[None]])
        return pose


def _grown(model: GaitModel, settings: StreamSettings, before: np.ndarray, piece: int) -> Any:
    """What grows from a steerable model after the poses `before` (frames, 25)."""
    start = before if len(before) >= 10 else settings.activity
    seed = [settings.seed, piece]
    return model.generator(start, seed=seed, temperature=settings.temperature, target=_target(settings))


def _target(settings: StreamSettings) -> Target:
    heading = None if settings.heading is None else math.radians(settings.heading)
    return Target(settings.activity, heading, settings.speed)


def _walked(
    model: GaitModel, settings: StreamSettings, before: np.ndarray, piece: int
) -> tuple[Iterator, float, float]:
    """Poses of a walk, joined to those `before`; the body's height, and frames per second."""
    asked = settings.model_dump(include={"deviations", "speed", *WALK_ARGUMENTS})
    seed = [settings.seed, piece] if settings.variation else settings.seed
    motion = motionenv.synthesize(model, _PIECE, settings.fps, seed=seed, **asked)
    poses = motion.poses if len(before) < 2 else _joined(before, motion)
    return iter(poses), motion.skeleton.height, settings.fps


def _joined(before: np.ndarray, motion: Motion) -> np.ndarray:
    """A motion's poses after its frame that is most like the last of `before` (frames, 25), moved there.

    How the body differs from there, in pose and velocity, decays like a critically damped spring (Bollo 2018, Game
    Developers Conference), so that neither jumps.
    """
    poses, last, step = motion.poses, before[-1], before[-1] - before[-2]
    among = poses[: max(2, round(_SEARCHED * motion.fps))]
    angles = [3, 4, *range(6, 25)]
    off = (among[1:] - last)[:, angles], (np.diff(among, axis=0) - step)[:, angles] * motion.fps / 10
    first = 1 + int(sum((o**2).sum(axis=1) for o in off).argmin())
    rest = _moved(poses[first:], last)
    time = np.arange(1, len(rest))[:, None] / motion.fps
    off, drift = last - rest[0], (step - rest[1] + rest[0]) * motion.fps
    return rest[1:] + (off + (drift + _QUICK * off) * time) * np.exp(-_QUICK * time)


def _moved(poses: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Poses turned and shifted over the ground so that the first one goes on from `last`."""
    turn = last[5] - poses[0, 5]
    c, s = math.cos(turn), math.sin(turn)
    moved = poses.copy()
    way = poses[:, :2] - poses[0, :2]
    moved[:, 0], moved[:, 1] = last[0] + c * way[:, 0] - s * way[:, 1], last[1] + s * way[:, 0] + c * way[:, 1]
    moved[:, 5] += turn
    return moved
