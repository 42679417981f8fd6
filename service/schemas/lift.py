"""`POST /v1/lift`."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, model_validator

from service.schemas.common import Request

_MARKERS = 15
Place = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = Annotated[list[Place | None], Field(min_length=2, max_length=2)]
Frame = Annotated[list[Point | None], Field(min_length=_MARKERS, max_length=_MARKERS)]
Degrees = Annotated[float, Field(ge=-360, le=360)]


class LiftRequest(Request):
    """2D points of one walker, as one camera shows them."""

    points: list[Frame] = Field(
        min_length=10, max_length=20_000,
        description="(frames, 15, 2): head, sternum, pelvis, then left and right shoulder, elbow, wrist, hip, knee and "
        "ankle, in the order of `markers` in the answer; null where a point or a frame's point is missing.",
    )  # fmt: skip
    fps: float = Field(ge=1, le=1000, description="Frames per second.", examples=[30.0])
    unit: Literal["m", "px"] = Field(
        "px", description="px: pixels, the second number downwards. m: metres, upwards, without perspective."
    )
    view: Degrees | None = Field(
        None, description="View angle α of paper B [degrees], 0 from the side; found without it."
    )
    elevation: Annotated[float, Field(ge=-85, le=85)] | Literal["unknown"] = Field(
        0.0, description="By how much the camera looks down [degrees]; 'unknown' finds it."
    )
    scale: float | None = Field(None, gt=0, le=1e6, description="Pixels per metre at the walker; found without it.")
    robust: bool = Field(True, description="Whether points far off count less.")

    @model_validator(mode="after")
    def _scale_of_pixels(self) -> Self:
        """Refuse a scale of metres."""
        if self.scale is not None and self.unit == "m":
            raise ValueError("points in metres have no scale: leave it out")
        return self


class View(BaseModel):
    """A view that the points leave possible."""

    view: float = Field(description="α [degrees].")
    elevation: float = Field(description="By how much the camera looks down [degrees].")
    probability: float = Field(ge=0, le=1, description="Beside the best view and all others.")


class LiftResponse(BaseModel):
    """A walk in three dimensions, and how sure each part of it is."""

    view: float = Field(description="α [degrees].")
    view_deviation: float = Field(description="Its standard deviation [degrees].")
    elevation: float = Field(description="By how much the camera looks down [degrees].")
    others: list[View] = Field(description="Other views that the points leave possible, most probable first.")
    contradiction: View | None = Field(description="The view that the points say where the given one can't be.")
    frequency: float = Field(description="Strides per second [Hz].")
    speed: float = Field(description="Walking speed [m/s].")
    misfit: float = Field(description="How unlike the walks that the prior knows; theirs are below about 100.")
    plausible: bool = Field(description="Whether the walk is like those that the prior knows, so that bands hold.")
    fps: float = Field(description="Frames per second.")
    markers: list[str] = Field(description="Names of the 15 markers.")
    positions: list[list[list[float]]] = Field(description="(frames, 15, 3) [m], x forward, y left, z up.")
    band: list[list[list[float]]] = Field(description="(frames, 15, 3) [m]: positions ± this hold 90 % of the truths.")
    pose: list[str] = Field(description="Names of the entries of a pose.")
    poses: list[list[float]] = Field(description="(frames, 25) [m, rad] of the body that does it.")
    height: float = Field(description="Of that body [m].")
    swapped: list[list[bool]] = Field(description="(frames, 2) where left and right of arms and legs were exchanged.")
