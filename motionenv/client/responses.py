"""Conversion of the service's responses into the library's types."""

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv.types import Markers, Skeleton

if TYPE_CHECKING:  # imported on use: together they take longer than most requests
    from motionenv.lifting import OtherMotion, OtherView
    from motionenv.models import Cycle
    from motionenv.models.motion_tree import Samples


@dataclass(frozen=True, eq=False)
class LiftedPoints:
    """Motion in three dimensions: what the service tells of a `motionenv.lifting.Lifted`.

    Attributes:
        markers: (frames, 15, 3) [m], z up; a steady walk goes along x.
        band: (frames, 15, 3) [m]: positions ± this hold 90 % of the truths; NaN in frames `unlike`.
        heading: (frames,) [rad] where the body faces, from x towards y.
        contact: (frames, 2) probability that the left and right foot stand.
        poses: (frames, 25) [m, rad] of the body that moves so.
        height: of that body [m].
        misfit: how unlike the people learned from this is.
        plausible: whether it is like them.
        unlike: (frames,) whether a frame shows something else than walking, turning or running.
        swapped: (frames, 2) where left and right of arms and of legs were exchanged.
        steady: view and pace of a straight, steady walk; None for other motion.
        other: another motion that the points may show, unless it is steady.
    """

    markers: Markers
    band: np.ndarray
    heading: np.ndarray
    contact: np.ndarray
    poses: np.ndarray
    height: float
    misfit: float
    plausible: bool
    unlike: np.ndarray
    swapped: np.ndarray
    steady: "SteadyWalk | None"
    other: "OtherMotion | None"


@dataclass(frozen=True)
class SteadyWalk:
    """View and pace of a straight, steady walk.

    Attributes:
        alpha, alpha_deviation: view angle [rad] and its standard deviation.
        elevation: by how much the camera looks down [rad].
        others: other views that the points leave possible, most probable first.
        contradiction: the view that the points suggest, where the given one is impossible.
        frequency: strides per second [Hz].
        speed: [m/s].
    """

    alpha: float
    alpha_deviation: float
    elevation: float
    others: "tuple[OtherView, ...]"
    contradiction: "OtherView | None"
    frequency: float
    speed: float


def cycle(content: bytes) -> "Cycle":
    """The stride in an NPZ file of `POST /v1/cycles`."""
    from motionenv.models import Cycle

    with np.load(io.BytesIO(content)) as read:
        body = Skeleton(read["offsets"], read["radii"], float(read["height"]))
        markers, poses, standing = read["markers"], read["poses"], read["standing"]
        return Cycle(markers, poses, standing, body, float(read["stride"]), float(read["seconds"]))


def samples(response: Mapping[str, Any]) -> "Samples":
    """The samples in a `SamplesResponse` of the service."""
    from motionenv.models.motion_tree import Samples

    poses = np.array(response["poses"]).reshape(-1, 25)
    return Samples(poses, np.array(response["windows"]), np.log(response["probabilities"]))


def lifted(response: Mapping[str, Any]) -> LiftedPoints:
    """The motion in a `LiftResponse` of the service."""
    return LiftedPoints(
        markers=Markers(tuple(response["markers"]), np.array(response["positions"], dtype=float), response["fps"]),
        band=np.array(response["band"], dtype=float), heading=np.radians(np.array(response["heading"], dtype=float)),
        contact=np.array(response["contact"], dtype=float), poses=np.array(response["poses"], dtype=float),
        height=response["height"],
        misfit=response["misfit"], plausible=response["plausible"], unlike=np.array(response["unlike"]),
        swapped=np.array(response["swapped"]), steady=_steady(response["steady"]),
        other=_other(response["other"]),
    )  # fmt: skip


def _steady(response: Mapping[str, Any] | None) -> SteadyWalk | None:
    if response is None:
        return None
    contradiction = response["contradiction"]
    return SteadyWalk(
        alpha=math.radians(response["view"]), alpha_deviation=math.radians(response["view_deviation"]),
        elevation=math.radians(response["elevation"]), others=tuple(map(_view, response["others"])),
        contradiction=None if contradiction is None else _view(contradiction), frequency=response["frequency"],
        speed=response["speed"],
    )  # fmt: skip


def _other(response: Mapping[str, Any] | None) -> "OtherMotion | None":
    from motionenv.lifting import OtherMotion

    if response is None:
        return None
    return OtherMotion(np.array(response["positions"], dtype=float), response["probability"])


def _view(response: Mapping[str, Any]) -> "OtherView":
    from motionenv.lifting import OtherView

    return OtherView(math.radians(response["view"]), math.radians(response["elevation"]), response["probability"])
