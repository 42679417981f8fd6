"""Models described: what they are, how large, and what may be asked of them."""

from typing import Any

from motionenv import MotionError
from motionenv.arguments import ARGUMENTS, Number
from motionenv.body import EDGES
from motionenv.models import GaitModel, card, names
from motionenv.types import MARKERS, POSE
from service.schemas.models import BodyDescription, ModelDescription, ModelSummary, PoseEntry, Range

_RANGES = {
    name: Range(minimum=max(number.low, number.above), maximum=number.high, unit=number.unit)
    for name, number in ((name, argument.meaning) for name, argument in ARGUMENTS.items())
    if isinstance(number, Number)
}
_RANGES |= {
    "deviations": Range(minimum=-5.0, maximum=5.0, unit="standard deviations"),
    "fps": Range(minimum=1.0, maximum=240.0, unit="frames per second"),
}


def summary(name: str, model: GaitModel | None, problem: str | None) -> ModelSummary:
    """A model in the list; None where it isn't in memory, with the problem if it never will be."""
    return ModelSummary(**_common(name, model, problem, _card(name, model)))


def description(name: str, model: GaitModel | None, problem: str | None) -> ModelDescription:
    """All about a model; `name`, `model` and `problem` as in `summary`."""
    told, known = _card(name, model), {} if model is None else model.describe()
    taken = known.pop("takes", [name for name, argument in ARGUMENTS.items() if not argument.meaning.cyclic])
    return ModelDescription(
        **known | _common(name, model, problem, told) | {"card": told},
        synthesis=model is not None,
        ranges={key: value for key, value in _RANGES.items() if key in taken},
    )


def body_description() -> BodyDescription:
    """The orders of poses and markers."""
    entries = [PoseEntry(name=name, unit="m" if name in POSE[:3] else "rad") for name in POSE]
    return BodyDescription(pose=entries, markers=list(MARKERS), edges=list(EDGES))


def _card(name: str, model: GaitModel | None) -> dict:
    if model is not None:
        return dict(model.card_)
    try:
        return card(name) if name in names() else {}
    except MotionError:
        return {}


def _common(name: str, model: GaitModel | None, problem: str | None, told: dict) -> dict[str, Any]:
    about = " — ".join(str(told[key]) for key in ("data", "intended use") if key in told)
    return {
        "name": name, "kind": None if model is None else model.kind, "ready": model is not None, "problem": problem,
        "summary": about, "licence": told.get("model licence"),
    }  # fmt: skip
