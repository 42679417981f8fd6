"""Motion from any gait model."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import is_number
from motionenv.arguments import WalkArguments, keyword_arguments
from motionenv.errors import MotionError
from motionenv.models.base import GaitModel
from motionenv.models.registry import gait_model
from motionenv.models.types import Walker
from motionenv.types import SECONDS_MOST, SPEED_RANGE, Motion

if TYPE_CHECKING:
    from motionenv.models.paths import WalkPath
    from motionenv.models.paths.walking import Speed


@keyword_arguments(WalkArguments)
def synthesize(
    model: str | GaitModel, seconds: float, fps: float = 30.0, *, walker: Walker | None = None,
    deviations: Sequence[float] | None = None, scores: Sequence[float] | None = None,
    path: "WalkPath | ArrayLike | None" = None, seed: int | np.random.Generator | None = None, speed: "Speed" = None,
    **walk: Unpack[WalkArguments],
) -> Motion:  # fmt: skip
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
        path: a `motionenv.models.paths.WalkPath`, or points (n, 2) [m] that it goes through; None goes along x.
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
    from motionenv.models.paths import WalkPath, walk_along  # SciPy's interpolation takes a while

    if not isinstance(path, WalkPath):
        path = WalkPath.line(SECONDS_MOST * SPEED_RANGE[1]) if path is None else WalkPath.through(path)
    return walk_along(fitted, path, seconds, fps, walker=walker, seed=seed, speed=speed, **walk)
