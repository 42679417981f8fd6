"""`POST /v1/cycles`."""

from typing import Annotated, Self

from pydantic import BaseModel, Field, model_validator

from motionenv import MotionError
from service.schemas.common import ModelName, walk_request
from service.schemas.synthesis import Deviation, Point, Radii, Row25, Score

Markers = Annotated[list[Annotated[list[float | None], Field(min_length=3, max_length=3)]], Field(min_length=15)]


class CycleRequest(walk_request("speed", "height", "weight", "person")):  # type: ignore[misc]
    """A walker; without seed, deviations and scores, the average one."""

    model: ModelName = "walk/fpca"
    seed: int | None = Field(None, ge=0, le=2**63 - 1, description="Draws the walker.", examples=[1])
    deviations: list[Deviation] | None = Field(
        None, max_length=64,
        description="The walker, in standard deviations from the average along each component; missing ones are 0.",
        examples=[[1.5, -0.5]],
    )  # fmt: skip
    scores: list[Score] | None = Field(
        None, max_length=64, description="The walker, as scores of the model; missing ones are those of the average."
    )
    samples: int = Field(96, ge=8, le=1000, description="Number of phases.")

    @model_validator(mode="after")
    def _one_walker(self) -> Self:
        given = [name for name in ("seed", "deviations", "scores") if getattr(self, name) is not None]
        if len(given) > 1:
            raise MotionError(f"give one of seed, deviations and scores, got {' and '.join(given)}", *given)
        return self


class CycleResponse(BaseModel):
    """One stride in place, from the phase at which the left leg is furthest ahead; x forward, y left, z up."""

    model: str = Field(description="Name of the model.", examples=["walk/fpca"])
    stride: float = Field(gt=0, description="How far the ground moves back in a cycle [m].")
    seconds: float = Field(gt=0, description="Duration of the cycle [s].")
    height: float = Field(gt=0, description="Body height [m].")
    weight: float | None = Field(description="Body weight [kg]; null for walkers without a person's body.")
    contacts: list[float] = Field(
        min_length=2, max_length=2, description="Phases [cycles] at which the left and the right foot take the weight."
    )
    deviations: list[float] = Field(
        description="Who walks, in standard deviations from the average along each component; at another speed and "
        "height than the walker's own it is still this walker."
    )
    markers: list[Markers] = Field(description="Positions of the 15 markers at each phase [m]; null where unknown.")
    poses: list[Row25] = Field(description="Pose at each phase [m, rad], as of `POST /v1/synthesis`.")
    standing: list[list[float]] = Field(description="How much the left and the right foot carry, from 0 to 1.")
    offsets: list[Point] = Field(description="The body [m], as of `POST /v1/synthesis`.")
    radii: list[Radii] = Field(description="Radius of each limb at its start and its end [m].")
