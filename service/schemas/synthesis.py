"""`POST /v1/synthesis`."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.schemas.common import ModelName, Request, Seed

_PIXELS = 4096
Deviation = Annotated[float, Field(ge=-5, le=5)]
Colour = Annotated[list[Annotated[float, Field(ge=0, le=1)]], Field(min_length=3, max_length=3)]


class Picture(Request):
    """How a video or a picture shows the motion; other formats leave it unread."""

    width: int = Field(640, ge=16, le=_PIXELS, description="[pixels].", examples=[320])
    height: int = Field(480, ge=16, le=_PIXELS, description="[pixels].", examples=[240])
    view: float = Field(
        45.0, ge=-360, le=360, description="View angle α of paper B [degrees]: 0 from the side, 90 from the front.",
        examples=[0.0],
    )  # fmt: skip
    follow: bool = Field(True, description="Whether the camera travels with the walker.")
    style: Literal["body", "points"] = Field("body", description="A cylinder body, or point lights.")
    engine: Literal["raycast", "pyrender"] = Field("raycast", description="What draws the body.")
    background: Colour | None = Field(
        None, description="Plain colour (red, green, blue; 0 to 1) instead of sky and ground.", examples=[[0, 0, 0]]
    )
    frame: int = Field(0, ge=0, le=1_000_000, description="Which frame, of a single picture.")


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
    speed: float | None = Field(
        None, ge=0.1, le=3.0, description="Walking speed [m/s]; the walker's own without it.", examples=[1.3]
    )
    height: float | None = Field(None, ge=0.5, le=2.5, description="Body height [m]; the model's without it.")
    phase: float = Field(0.0, ge=-1000, le=1000, description="Where in the cycle to start [cycles]; 0: left leg ahead.")
    variation: float = Field(1.0, ge=0, le=10, description="Factor on how much the cycles of a walk differ.")
    picture: Picture = Field(default_factory=Picture)

    @model_validator(mode="after")
    def _a_frame(self) -> Self:
        """Refuse a motion without a frame."""
        if round(self.seconds * self.fps) < 1:
            raise ValueError("seconds · fps must make one frame at least")
        return self

    @property
    def frames(self) -> int:
        """How many frames the motion has."""
        return round(self.seconds * self.fps)
