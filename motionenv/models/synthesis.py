"""Motion from any gait model, and the same motion on a body of another height."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, is_number
from motionenv.arguments import WalkArguments, keyword_arguments
from motionenv.body.skeleton import limb_radii
from motionenv.errors import MotionError
from motionenv.models.base import GaitModel
from motionenv.models.registry import gait_model
from motionenv.models.types import Walker
from motionenv.types import HEIGHT_RANGE, SECONDS_MOST, SPEED_RANGE, Motion, Skeleton

if TYPE_CHECKING:
    from motionenv.models.paths import Path
    from motionenv.models.paths.walking import Speed

__all__ = ["scaled", "synthesize"]


@keyword_arguments(WalkArguments)
def synthesize(
    model: str | GaitModel,
    seconds: float,
    fps: float,
    *,
    walker: Walker | None = None,
    deviations: Sequence[float] | None = None,
    scores: Sequence[float] | None = None,
    path: "Path | ArrayLike | None" = None,
    seed: int | np.random.Generator | None = None,
    speed: "Speed" = None,
    **walk: Unpack[WalkArguments],
) -> Motion:
    """New motion (frames, 25) from a model, with its `GaitModel.synthesize`.

    With a path, or a speed that changes, it is made by `motionenv.models.paths.walk_along`.

    Give the walker by `walker`, `deviations` or `scores`, or none of them to draw one with the seed. A walker given by
    numbers has the stride time that the model expects of such a walker.

    Args:
        model: a name or path for `motionenv.load`, or a fitted model.
        seconds: duration [s].
        fps: frames per second.
        walker: from `GaitModel.walker`.
        deviations: up to q standard deviations from the average person's scores; the other components are average.
        scores: up to q scores; the other components are average.
        path: a `motionenv.models.paths.Path`, or points (n, 2) [m] that it goes through; None goes along x.
        seed: int or Generator, also for the variation between cycles.
        speed: [m/s], or a function of the time [s], or rows (time, speed); see `walk_along`.
        walk: the further arguments of `motionenv.arguments.Request`.

    Raises:
        MotionError: a number out of range, or an argument that the model doesn't take.
        ModelError: no such model.
    """
    fitted = gait_model(model)
    if deviations is not None or scores is not None:
        if walker is not None:
            raise MotionError("walker and deviations or scores both define the walker: give one of them")
        walker = fitted.walker(scores=scores, deviations=deviations)
    if path is None and (speed is None or is_number(speed)):
        return fitted.synthesize(seconds, fps, walker=walker, seed=seed, speed=speed, **walk)
    from motionenv.models.paths import Path, walk_along

    if not isinstance(path, Path):
        path = Path.line(SECONDS_MOST * SPEED_RANGE[1]) if path is None else Path.through(path)
    return walk_along(fitted, path, seconds, fps, walker=walker, seed=seed, speed=speed, **walk)


def scaled(motion: Motion, height: float) -> Motion:
    """The same motion of a body scaled to `height` [m]. Lengths and speeds scale; angles and times stay.

    Args:
        motion: any motion.
        height: body height [m], from 0.5 to 2.5.

    Raises:
        MotionError: `height` out of range.
    """
    checked_number(height, "height", *HEIGHT_RANGE)
    factor = height / motion.skeleton.height
    poses = motion.poses.copy()
    poses[..., :3] *= factor
    return replace(motion, poses=poses, skeleton=Skeleton(motion.skeleton.offsets * factor, limb_radii(height), height))
