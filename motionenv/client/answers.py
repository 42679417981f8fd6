"""What a service answers with."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np

from motionenv.types import Markers

T = TypeVar("T")


@dataclass(frozen=True)
class Model:
    """A model that a service has.

    Attributes:
        name: what requests call it.
        kind: walking, eigenwalkers, walker-prior, fpca or tree; None until it is loaded.
        ready: whether it is in memory.
        summary: what it is.
        licence: of the model.
    """

    name: str
    kind: str | None
    ready: bool
    summary: str
    licence: str | None = None


@dataclass(frozen=True)
class Component:
    """One way in which people differ.

    Attributes:
        mean: the average person's score.
        deviation: standard deviation of the scores.
        share: of the variance that it explains.
    """

    mean: float
    deviation: float
    share: float | None = None


@dataclass(frozen=True)
class ModelDetails(Model):
    """All about a model.

    Attributes:
        card: data, people, licence, how it was made.
        synthesis: whether it walks.
        dimensions: how large it is.
        height: of its average body [m].
        components: in the order of `deviations` and `scores`.
        activities: what a tree's `start` and `activity` may be.
        ranges: least, greatest value and unit of what may be asked of it.
    """

    card: Mapping[str, Any] | None = None
    synthesis: bool = False
    dimensions: Mapping[str, int] | None = None
    height: float | None = None
    components: tuple[Component, ...] = ()
    activities: tuple[str, ...] = ()
    ranges: Mapping[str, tuple[float, float, str]] | None = None


@dataclass(frozen=True, eq=False)
class Samples:
    """Next poses, drawn from a tree.

    Attributes:
        poses: (n, 25) [m, rad].
        windows: (n,) positions in the tree of the windows that they follow.
        leaves: (n,) the leaf that each window is in.
        probabilities: (n,) of drawing each window.
        clips: (n,) names of the clips that the windows are from.
        seed: that they were drawn with.
    """

    poses: np.ndarray
    windows: np.ndarray
    leaves: np.ndarray
    probabilities: np.ndarray
    clips: tuple[str, ...]
    seed: int


@dataclass(frozen=True)
class View:
    """A view that 2D points leave possible.

    Attributes:
        alpha: view angle α of paper B [rad].
        elevation: by how much the camera looks down [rad].
        probability: beside the best view and all others.
    """

    alpha: float
    elevation: float
    probability: float


@dataclass(frozen=True, eq=False)
class LiftedPoints:
    """A walk in three dimensions, and how sure each part of it is.

    Attributes:
        markers: (frames, 15, 3) [m], x forward, y left, z up.
        band: (frames, 15, 3) [m]: positions ± this hold 90 % of the truths, of a plausible walk.
        poses: (frames, 25) [m, rad] of the body that does it.
        height: of that body [m].
        alpha, alpha_deviation: view angle [rad] and its standard deviation.
        elevation: by how much the camera looks down [rad].
        others: other views that the points leave possible, most probable first.
        contradiction: the view that the points say, where the given one can't be.
        frequency: strides per second [Hz].
        speed: [m/s].
        misfit: how unlike the walks that the prior knows.
        plausible: whether it is like them.
        swapped: (frames, 2) where left and right of arms and of legs were exchanged.
    """

    markers: Markers
    band: np.ndarray
    poses: np.ndarray
    height: float
    alpha: float
    alpha_deviation: float
    elevation: float
    others: tuple[View, ...]
    contradiction: View | None
    frequency: float
    speed: float
    misfit: float
    plausible: bool
    swapped: np.ndarray


def taken(cls: type[T], told: Mapping[str, Any]) -> T:
    """A dataclass of what it knows of an answer; newer services may tell more.

    Args:
        cls: the dataclass.
        told: the answer.
    """
    return cls(**{f.name: told[f.name] for f in fields(cls) if f.name in told})  # type: ignore[arg-type]


def details(told: Mapping[str, Any]) -> ModelDetails:
    """`ModelDetails` of an answer.

    Args:
        told: the answer.
    """
    ranges = {name: (r["minimum"], r["maximum"], r["unit"]) for name, r in told["ranges"].items()}
    components = tuple(taken(Component, component) for component in told["components"])
    activities = tuple(told["activities"])
    return taken(ModelDetails, {**told, "ranges": ranges, "components": components, "activities": activities})


def samples(told: Mapping[str, Any]) -> Samples:
    """`Samples` of an answer.

    Args:
        told: the answer.
    """
    arrays = {name: np.array(told[name]) for name in ("windows", "leaves", "probabilities")}
    clips = tuple(told["clips"][str(clip)] for clip in told["clip"])
    return Samples(np.array(told["poses"]).reshape(-1, 25), **arrays, clips=clips, seed=told["seed"])


def lifted(told: Mapping[str, Any]) -> LiftedPoints:
    """`LiftedPoints` of an answer.

    Args:
        told: the answer.
    """
    other = told["contradiction"]
    angles = {"alpha": told["view"], "alpha_deviation": told["view_deviation"], "elevation": told["elevation"]}
    arrays = {name: np.array(told[name]) for name in ("band", "poses", "swapped")}
    return taken(LiftedPoints, {
        **told, **arrays, **{name: math.radians(angle) for name, angle in angles.items()},
        "markers": Markers(tuple(told["markers"]), np.array(told["positions"]), told["fps"]),
        "others": tuple(map(_view, told["others"])), "contradiction": None if other is None else _view(other),
    })  # fmt: skip


def _view(told: Mapping[str, Any]) -> View:
    return View(math.radians(told["view"]), math.radians(told["elevation"]), told["probability"])
