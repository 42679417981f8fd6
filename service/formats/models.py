"""Models described: what they are, how large, and what may be asked of them."""

from typing import Any

import numpy as np

from motionenv.models import card, names
from motionenv.models.synthesis import components
from service.schemas.models import Component, ModelDescription, ModelSummary, Range

_WALKING = ("walking", "eigenwalkers", "walker-prior")
_RANGES = {
    "speed": Range(minimum=0.1, maximum=3.0, unit="m/s"),
    "height": Range(minimum=0.5, maximum=2.5, unit="m"),
    "deviations": Range(minimum=-5.0, maximum=5.0, unit="standard deviations"),
    "variation": Range(minimum=0.0, maximum=10.0, unit="factor"),
    "seconds": Range(minimum=0.0, maximum=3600.0, unit="s"),
    "fps": Range(minimum=1.0, maximum=240.0, unit="frames/s"),
}
_OF_TREES = ("speed", "height", "seconds", "fps")


def summary(name: str, model: Any) -> ModelSummary:
    """A model in the list.

    Args:
        name: of the model.
        model: None where it isn't in memory yet.
    """
    return ModelSummary(**_common(name, model, _card(name, model)))


def description(name: str, model: Any) -> ModelDescription:
    """All about a model.

    Args:
        name: of the model.
        model: None where it isn't in memory yet.
    """
    told, kind = _card(name, model), getattr(model, "kind", None)
    walks, grows = kind in _WALKING, kind == "tree"
    return ModelDescription(
        **_common(name, model, told),
        card=told,
        synthesis=walks or grows,
        dimensions=_dimensions(model),
        height=_height(model),
        components=_components(model) if walks else [],
        activities=sorted(set(model.database_.activities)) if grows else [],
        ranges={key: value for key, value in _RANGES.items() if walks or key in _OF_TREES},
    )


def _card(name: str, model: Any) -> dict:
    return card(name) if name in names() else dict(model.card_)


def _common(name: str, model: Any, told: dict) -> dict[str, Any]:
    about = " — ".join(str(told[key]) for key in ("data", "intended use") if key in told)
    return {
        "name": name, "kind": getattr(model, "kind", None), "ready": model is not None, "summary": about,
        "licence": told.get("model licence"),
    }  # fmt: skip


def _components(model: Any) -> list[Component]:
    mean, deviation = components(model)
    share = getattr(model, "fpca_", model).explained_variance_ratio_
    rows = zip(mean.tolist(), deviation.tolist(), np.clip(share, 0, 1).tolist(), strict=True)
    return [Component(mean=m, deviation=d, share=s) for m, d, s in rows]


def _dimensions(model: Any) -> dict[str, int]:
    kind = getattr(model, "kind", None)
    if kind is None:
        return {}
    if kind == "tree":
        return {"pose": 25, "frames": len(model.database_.poses), "windows": len(model.frames_)}
    size = {"components": len(getattr(model, "fpca_", model).explained_variance_)}
    if kind in ("walking", "fpca"):
        functions = getattr(model, "fpca_", model)
        return size | {"channels": len(functions.channels_), "harmonics": functions.n_harmonics}
    return size | {"markers": 15, "coefficients": int(model.mean_.size)}


def _height(model: Any) -> float | None:
    """Height of the average body [m]."""
    if getattr(model, "kind", None) == "tree":
        return float(model.database_.skeleton.height)
    return getattr(model, "height_", None)
