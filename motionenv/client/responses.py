"""Conversion of the service's JSON into the library's types."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv.types import Markers

if TYPE_CHECKING:  # imported on use: together they take longer than most requests
    from motionenv.lifting import OtherView
    from motionenv.models.motion_tree import Samples


@dataclass(frozen=True, eq=False)
class LiftedPoints:
    """A walk in three dimensions: what the service tells of a `motionenv.lifting.Lifted`.

    Attributes:
        markers: (frames, 15, 3) [m], x forward, y left, z up.
        band: (frames, 15, 3) [m]: positions ± this hold 90 % of the truths, of a plausible walk.
        poses: (frames, 25) [m, rad] of the body that walks so.
        height: of that body [m].
        alpha, alpha_deviation: view angle [rad] and its standard deviation.
        elevation: by how much the camera looks down [rad].
        others: other views that the points leave possible, most probable first.
        contradiction: the view that the points suggest, where the given one is impossible.
        frequency: strides per second [Hz].
        speed: [m/s].
        misfit: how unlike the walks of the prior it is.
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
    others: "tuple[OtherView, ...]"
    contradiction: "OtherView | None"
    frequency: float
    speed: float
    misfit: float
    plausible: bool
    swapped: np.ndarray


def samples(response: Mapping[str, Any]) -> "Samples":
    """The samples in a `SamplesResponse` of the service."""
    from motionenv.models.motion_tree import Samples

    poses = np.array(response["poses"]).reshape(-1, 25)
    return Samples(poses, np.array(response["windows"]), np.log(response["probabilities"]))


def lifted(response: Mapping[str, Any]) -> LiftedPoints:
    """The walk in a `LiftResponse` of the service."""
    contradiction = response["contradiction"]
    return LiftedPoints(
        markers=Markers(tuple(response["markers"]), np.array(response["positions"]), response["fps"]),
        band=np.array(response["band"]), poses=np.array(response["poses"]), alpha=math.radians(response["view"]),
        alpha_deviation=math.radians(response["view_deviation"]), elevation=math.radians(response["elevation"]),
        others=tuple(map(_view, response["others"])),
        contradiction=None if contradiction is None else _view(contradiction), swapped=np.array(response["swapped"]),
        **{name: response[name] for name in ("height", "frequency", "speed", "misfit", "plausible")},
    )  # fmt: skip


def _view(response: Mapping[str, Any]) -> "OtherView":
    from motionenv.lifting import OtherView

    return OtherView(math.radians(response["view"]), math.radians(response["elevation"]), response["probability"])
