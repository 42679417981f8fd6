"""Walks along a path from any gait model: steady, faster and slower, with starts and stops."""

from collections.abc import Callable
from typing import Unpack

import numpy as np

from motionenv._core.validation import is_number, random_generator
from motionenv.arguments import Request, WalkArguments, keyword_arguments
from motionenv.errors import MotionError
from motionenv.models.base import GaitModel
from motionenv.models.paths._pace import RATE, pace_of, paced
from motionenv.models.paths.bending import bend, bent
from motionenv.models.paths.path import WalkPath
from motionenv.models.transforms import resample, scaled
from motionenv.models.types import Target, Walker
from motionenv.types import POSE, SPEED_RANGE, Motion

_LOOK = 0.1  # [s] after which who is steered is told the speed again
_HEADING = POSE.index("root_heading")

#: A speed [m/s]: a number, a function of the time [s], or rows (time [s], speed [m/s]) with straight lines between.
Speed = float | Callable[[float], float] | list | tuple | np.ndarray | None


@keyword_arguments(WalkArguments)
def walk_along(
    model: GaitModel, path: WalkPath, seconds: float, fps: float = 30.0, *, walker: Walker | None = None,
    seed: int | np.random.Generator | None = None, speed: Speed = None, **walk: Unpack[WalkArguments],
) -> Motion:  # fmt: skip
    """A person of `model` walks along `path`: motion (frames, 25) that starts at the path's start.

    Steady models bend their straight walks (`bend`). Where speed changes, walks of the same person at several speeds
    are blended in phase; at 0 m/s the person stands on both feet, and takes whole steps to start and to stop. Speed
    changes are smoothed over 0.3 s, as nobody starts at once. Who comes to the end of the path stops there. A model
    that is steered is steered straight ahead, at the speed as far as it can, and its motion is bent; it doesn't stop at
    the end.

    Args:
        model: any gait model.
        path: where to walk.
        seconds: duration [s], up to an hour.
        fps: frames per second, from 1 to 1000.
        walker: the walker, from `GaitModel.walker`; None draws one with the seed.
        seed: int or Generator.
        speed: [m/s]: a number from 0.1 to 3, a function of the time [s], or rows (time, speed) with straight lines
            between; functions and rows may be 0. None takes the walker's own.
        walk: the further arguments of `motionenv.arguments.Request`.

    Raises:
        MotionError: a number out of range, a path with turns too sharp for the speed, or arguments that the model
            doesn't take.
        ModelError: a model that doesn't walk.
    """
    if not isinstance(path, WalkPath):
        raise MotionError(f"path must be a motionenv.models.paths.WalkPath, got {type(path).__name__}")
    rng = random_generator(seed)
    even: float | None = float(speed) if is_number(speed) else None
    request = Request(seconds, fps, even, **walk)
    if not model.steady:
        return _steered(model, path, request, speed, walker, rng)
    pace = None if speed is None else pace_of(speed, seconds, path.length)
    drawn = int(rng.integers(2**63))
    typical = pace.typical if pace and even is None else even
    person = walker or model.draw_walker(rng, typical, request.height, request.person)

    def make(span: float, fast: float | None, rate: float = RATE) -> Motion:
        return model.synthesize(span, rate, walker=person, seed=drawn, speed=fast, **walk)

    if pace is None or even is not None:
        straight = make(seconds, even, fps)
        if straight.poses[-1, 0] <= path.length:
            return bend(straight, path)
        own = (straight.poses[-1, 0] - straight.poses[0, 0]) * fps / (len(straight.poses) - 1)
        pace = pace or pace_of(float(np.clip(own, *SPEED_RANGE[:2])), seconds, path.length)
    steps, skeleton = paced(make, pace, model.learned_speeds()[0], request)
    return Motion(bent(steps, path, 0.0, skeleton), skeleton, fps, f"{model.kind} along a path")


def _steered(model, path: WalkPath, request: Request, speed: Speed, walker, rng: np.random.Generator) -> Motion:
    """Motion of a steerable model, steered straight ahead at the speed, then bent."""
    if not model.steerable:
        raise MotionError(f"a {model.kind} model neither walks steadily nor is steered: it can't keep to a path")
    request.check_cycles(model.kind)
    start = walker.start if walker is not None else "walk" if "walk" in model.activities else None
    growth = model.generator(start, seed=rng)
    size = 1.0 if request.height is None else request.height / growth.skeleton.height
    pace = None if speed is None else pace_of(speed, request.seconds)
    poses = growth.step(1)
    heading, chunk = float(poses[0, _HEADING]), max(round(_LOOK * growth.fps), 1)
    while len(poses) < request.seconds * growth.fps + 2:
        now = len(poses) / growth.fps
        fast = None if pace is None else float(np.interp(now, pace.times, pace.speeds)) / size
        growth.target = Target(heading=heading, speed=fast)
        poses = np.concatenate([poses, growth.step(chunk)])
    poses[:, :2] -= poses[0, :2]
    forth, left = np.cos(heading), np.sin(heading)
    poses[:, :2] = poses[:, :2] @ np.array([[forth, -left], [left, forth]])
    poses[:, _HEADING] -= heading
    motion = Motion(poses, growth.skeleton, growth.fps, f"{model.kind} along a path")
    if request.fps != growth.fps:
        motion = Motion(resample(motion, request.fps)[0], motion.skeleton, request.fps, motion.name)
    motion = Motion(motion.poses[: request.frames], motion.skeleton, request.fps, motion.name)
    return bend(motion if request.height is None else scaled(motion, request.height), path)
