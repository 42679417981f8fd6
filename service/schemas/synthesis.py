"""`POST /v1/synthesis`."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, model_validator

from service.schemas.common import ModelName, Request, Seed

_PIXELS = 4096
Deviation = Annotated[float, Field(ge=-5, le=5)]
Score = Annotated[float, Field(ge=-1000, le=1000)]
Colour = Annotated[list[Annotated[float, Field(ge=0, le=1)]], Field(min_length=3, max_length=3)]


class Picture(Request):
    """How a video or a picture shows the motion; other formats leave it unread."""

    width: int = Field(640, ge=16, le=_PIXELS, description="[pixels].", examples=[320])
    height: int = Field(480, ge=16, le=_PIXELS, description="[pixels].", examples=[240])
    view: float = Field(
        45.0, ge=-360, le=360, description="View angle α of paper B [degrees]: 0 from the side, 90 from the front.",
        examples=[0.0],
    )  # fmt: skip
    elevation: float = Field(
        3.5, ge=-89, le=89, description="Angle by which the camera looks down [degrees].", examples=[0.0]
    )
    follow: bool = Field(True, description="Whether the camera travels with the walker.")
    colour: Colour = Field([1.0, 1.0, 1.0], description="Colour of the point lights (red, green, blue; 0 to 1).")
    style: Literal["body", "points"] = Field("body", description="A cylinder body, or point lights.")
    engine: Literal["raycast", "pyrender"] = Field("raycast", description="What draws the body.")
    background: Colour | None = Field(
        None,
        description="Plain colour (red, green, blue; 0 to 1) instead of sky and ground, or of the points' black.",
        examples=[[0.5, 0.5, 0.5]],
    )
    frame: int = Field(0, ge=0, le=1_000_000, description="Which frame, of a single picture.")


_USUAL = Picture()  # the same for all who don't ask: none can change it


class SynthesisRequest(Request):
    """A walk: who walks, how long, and how it varies."""

    model: ModelName = "walk/fpca"
    seed: Seed = None
    seconds: float = Field(4.0, gt=0, le=3600, description="Duration [s].", examples=[4.0])
    fps: float = Field(30.0, ge=1, le=240, description="Frames per second.", examples=[30.0])
    deviations: list[Deviation] | None = Field(
        None, max_length=64,
        description="The walker, as standard deviations from the average along each component; those left out are 0. "
        "Without it the walker is drawn with the seed.",
        examples=[[1.5, -0.5]],
    )  # fmt: skip
    scores: list[Score] | None = Field(
        None, max_length=64,
        description="The walker, as the model's own scores; those left out are the average's. Not together with "
        "`deviations`.",
    )  # fmt: skip
    speed: float | None = Field(
        None, ge=0.1, le=3.0, description="Walking speed [m/s]; the walker's own without it.", examples=[1.3]
    )
    height: float | None = Field(None, ge=0.5, le=2.5, description="Body height [m]; the model's without it.")
    phase: float = Field(0.0, ge=-1000, le=1000, description="Where in the cycle to start [cycles]; 0: left leg ahead.")
    variation: float = Field(1.0, ge=0, le=10, description="Factor on how much the cycles of a walk differ.")
    picture: Picture = Field(default_factory=lambda: _USUAL)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        """Refuse a motion without a frame, and two walkers at once."""
        if round(self.seconds * self.fps) < 1:
            raise ValueError("seconds · fps must make one frame at least")
        if self.deviations is not None and self.scores is not None:
            raise ValueError("deviations and scores both say who walks: give one of them")
        return self

    @property
    def frames(self) -> int:
        """How many frames the motion has."""
        return round(self.seconds * self.fps)


Row25 = Annotated[list[float | None], Field(min_length=25, max_length=25)]
Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Radii = Annotated[list[float], Field(min_length=2, max_length=2)]


class MotionResponse(BaseModel):
    """A motion as JSON. World: x forward, y left, z up."""

    model: str = Field(description="Name of the model.", examples=["walk/fpca"])
    seed: int = Field(ge=0, description="Asked for again with it, the same motion comes.", examples=[1])
    fps: float = Field(gt=0, description="Frames per second.", examples=[30.0])
    height: float = Field(gt=0, description="Body height [m].", examples=[1.73])
    pose: list[str] = Field(min_length=25, max_length=25, description="Names of a pose's entries.")
    poses: list[Row25] = Field(
        description="One row per frame: position of the pelvis [m], its three rotations, and 19 joint angles [rad]; "
        "null where unknown."
    )
    offsets: list[Point] = Field(
        min_length=16, max_length=16,
        description="The body [m]: where each of the 15 markers, and the neck, sits in the frame of the limb that "
        "carries it.",
    )  # fmt: skip
    radii: list[Radii] = Field(description="Radius of each drawn limb at its start and its end [m].")
