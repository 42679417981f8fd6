"""One stride of one walker in place, as on a treadmill, from any model whose walks are cyclic."""

from collections.abc import Sequence

from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import MotionError
from motionenv.models.base import GaitModel
from motionenv.models.contact_rule import SAMPLES
from motionenv.models.registry import gait_model
from motionenv.models.types import Cycle, Walker
from motionenv.types import HEIGHT_RANGE, SPEED_RANGE

_SAMPLES = (8, 1000)


def cycle(
    model: str | GaitModel, *, walker: Walker | None = None, deviations: Sequence[float] | None = None,
    scores: Sequence[float] | None = None, speed: float | None = None, height: float | None = None,
    weight: float | None = None, samples: int = SAMPLES,
) -> Cycle:  # fmt: skip
    """One stride of a walker in place: what `synthesize` walks over the ground without variation.

    Give the walker by `walker`, `deviations` or `scores`, or by none of them for the average walker.

    Args:
        model: a name or path for `motionenv.load`, or a fitted model.
        walker: from `GaitModel.walker`.
        deviations: up to q standard deviations from the average person's scores; the other components are average.
        scores: up to q scores; the other components are average.
        speed: [m/s], from 0.1 to 3; None takes the walker's own.
        height: body height [m], from 0.5 to 2.5; None takes the walker's own.
        weight: [kg]; None takes the walker's own.
        samples: number of phases, from 8 to 1000.

    Raises:
        MotionError: a number out of range, more than one way to give the walker, a walker of another model, or a model
            whose motion has no cycles.
        ModelError: no such model.
    """
    fitted = gait_model(model)
    if speed is not None:
        checked_number(speed, "speed", *SPEED_RANGE)
    if height is not None:
        checked_number(height, "height", *HEIGHT_RANGE)
    checked_whole(samples, "samples", *_SAMPLES)
    if deviations is not None or scores is not None:
        if walker is not None:
            raise MotionError("walker and deviations or scores both define the walker: give one of them")
        walker = fitted.walker(scores=scores, deviations=deviations)
    if walker is None:
        walker = fitted.walker(deviations=())
    fitted.check_walker(walker)
    if weight is not None:
        walker = walker.weighing(weight, height)
    return fitted.in_place([walker], speed=speed, height=height, samples=samples)[0]
