"""`POST /v1/synthesis`."""

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field, model_validator

import motionenv
from motionenv import MotionError
from motionenv.arguments import WALK_ARGUMENTS
from motionenv.types import SECONDS_MOST, Motion
from service.schemas.common import ModelName, Request, Seed, WalkRequest

_PIXELS = 4096
Deviation = Annotated[float, Field(ge=-5, le=5)]
Score = Annotated[float, Field(ge=-1000, le=1000)]
Metres = Annotated[float, Field(ge=-10_000, le=10_000)]
Point2 = Annotated[list[Metres], Field(min_length=2, max_length=2)]
#: A time [s] and a speed [m/s].
SpeedRow = Annotated[list[Annotated[float, Field(ge=0, le=SECONDS_MOST)]], Field(min_length=2, max_length=2)]
Colour = Annotated[list[Annotated[float, Field(ge=0, le=1)]], Field(min_length=3, max_length=3)]


class Picture(Request):
    """Camera and style of a video or picture; ignored by other formats."""

    width: int = Field(640, ge=16, le=_PIXELS, description="Width [pixels].", examples=[320])
    height: int = Field(480, ge=16, le=_PIXELS, description="Height [pixels].", examples=[240])
    view: float = Field(
        45.0, ge=-360, le=360, description="View angle α of paper B [degrees]: 0 from the side, 90 from the front.",
        examples=[0.0],
    )  # fmt: skip
    elevation: float = Field(
        3.5, ge=-89, le=89, description="By how much the camera looks down [degrees].", examples=[0.0]
    )
    follow: bool = Field(True, description="Whether the camera follows the walker.")
    colour: Colour = Field([1.0, 1.0, 1.0], description="Colour of the point lights (red, green, blue; 0 to 1).")
    style: Literal["body", "points"] = Field("body", description="A cylinder body, or point lights.")
    background: Colour | None = Field(
        None,
        description="Plain background colour (red, green, blue; 0 to 1) instead of sky and ground, or of black.",
        examples=[[0.5, 0.5, 0.5]],
    )
    frame: int = Field(0, ge=0, le=1_000_000, description="Index of the frame that a single picture (PNG) shows.")


_DEFAULT_PICTURE = Picture()  # frozen, so all requests without one can share it


class SynthesisRequest(WalkRequest):
    """A walk: the walker, its duration, and how it varies."""

    model: ModelName = "walk/fpca"
    seed: Seed = None
    seconds: float = Field(4.0, gt=0, le=SECONDS_MOST, description="Duration [s].", examples=[4.0])
    fps: float = Field(30.0, ge=1, le=240, description="Frames per second.", examples=[30.0])
    deviations: list[Deviation] | None = Field(
        None, max_length=64,
        description="The walker, in standard deviations from the average along each component; missing ones are 0. "
        "Without deviations and scores the walker is drawn with the seed.",
        examples=[[1.5, -0.5]],
    )  # fmt: skip
    scores: list[Score] | None = Field(
        None, max_length=64,
        description="The walker, as scores of the model; missing ones are those of the average. Not together with "
        "`deviations`.",
    )  # fmt: skip
    speeds: list[SpeedRow] | None = Field(
        None, min_length=1, max_length=1000, examples=[[[0, 0], [1, 1.3], [5, 1.3], [6, 0]]],
        description="Instead of `speed`: rows of a time [s] and a speed [m/s], 0 to stand; straight lines between.",
    )  # fmt: skip
    path: list[Point2] | None = Field(
        None, min_length=2, max_length=1000, examples=[[[0, 0], [3, 0], [4, 2]]],
        description="Points (x, y) [m] that the walk goes through along a smooth curve, whose radius is 0.6 m at "
        "least; it stops at the last one. Default: straight ahead along x.",
    )  # fmt: skip
    picture: Picture = Field(default_factory=lambda: _DEFAULT_PICTURE)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        """At least one frame, and one definition of the walker and of the speed."""
        if round(self.seconds * self.fps) < 1:
            raise MotionError("seconds · fps must be at least one frame", "seconds", "fps")
        if self.deviations is not None and self.scores is not None:
            raise MotionError("give either deviations or scores, not both", "deviations", "scores")
        if self.speed is not None and self.speeds is not None:
            raise MotionError("give either speed or speeds, not both", "speed", "speeds")
        return self

    @property
    def frames(self) -> int:
        """Number of frames of the motion."""
        return round(self.seconds * self.fps)

    def make(self, model: Any, seed: int | None) -> Motion:
        """The walk of a fitted model, or of a model's name or file."""
        how = self.model_dump(include={"deviations", "scores", "path", *WALK_ARGUMENTS})
        speed = self.speeds or self.speed
        try:
            return motionenv.synthesize(model, self.seconds, self.fps, seed=seed, speed=speed, **how)
        except MotionError as error:
            if self.speeds:
                error.fields = tuple("speeds" if name == "speed" else name for name in error.fields)
            raise


Row25 = Annotated[list[float | None], Field(min_length=25, max_length=25)]
Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Radii = Annotated[list[float], Field(min_length=2, max_length=2)]


class MotionResponse(BaseModel):
    """A motion as JSON. World: x forward, y left, z up."""

    model: str = Field(description="Name of the model.", examples=["walk/fpca"])
    seed: int = Field(ge=0, description="Seed of the motion; the same seed gives the same motion.", examples=[1])
    fps: float = Field(gt=0, description="Frames per second.", examples=[30.0])
    height: float = Field(gt=0, description="Body height [m].", examples=[1.73])
    pose: list[str] = Field(min_length=25, max_length=25, description="Names of the entries of a pose.")
    poses: list[Row25] = Field(
        description="One row per frame: position of the pelvis [m], its three rotations, and 19 joint angles [rad]; "
        "null where unknown."
    )
    offsets: list[Point] = Field(
        min_length=16, max_length=16,
        description="The body [m]: position of each of the 15 markers, and of the neck, in the frame of its limb.",
    )  # fmt: skip
    radii: list[Radii] = Field(description="Radius of each limb at its start and its end [m].")
