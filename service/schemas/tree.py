"""`POST /v1/tree/samples` and `POST /v1/tree/synthesis`."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, model_validator

from service.schemas.common import ModelName, Request, Seed
from service.schemas.synthesis import Picture

Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Pose = Annotated[list[Number], Field(min_length=25, max_length=25)]
Activity = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$")]


class FromTree(Request):
    """What both requests share: which tree, and what the motion follows."""

    model: Annotated[ModelName, Field(examples=["mixed/tree"])] = "mixed/tree"
    seed: Seed = None
    history: list[Pose] | None = Field(
        None, min_length=10, max_length=120,
        description="Poses [m, rad] at 30 frames/s, oldest first, in the order of GET /v1/models; the last 10 to 12 "
        "count.",
    )  # fmt: skip
    start: Activity | None = Field(
        None, description="Instead of a history: an activity, of which the seed picks a window.", examples=["walk"]
    )
    temperature: float = Field(
        0.05, gt=0, le=100, description="β of paper C: near 0 the nearest motion follows, at 1 almost any."
    )
    method: Literal["exact", "tree"] = Field("tree", description="From p(i | t) itself, or by the paper's search.")

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        """Refuse two beginnings."""
        if self.history is not None and self.start is not None:
            raise ValueError("give history or start, not both")
        return self


class SamplesRequest(FromTree):
    """What may come next."""

    n: int = Field(1, ge=1, le=10_000, description="Draws.", examples=[300])
    carry: bool = Field(False, description="Carry over the difference between the history and the window found.")
    noise: float = Field(
        0.0, ge=0, le=100, description="Gaussian noise, as a share of how far predictions are off on average."
    )


class SamplesResponse(BaseModel):
    """Next poses, each with the window of the database that it follows."""

    model: str = Field(description="The tree.")
    seed: int = Field(description="That they were drawn with.")
    pose: list[str] = Field(description="Names of the entries of a pose.")
    poses: list[list[float]] = Field(description="(n, 25) [m, rad].")
    windows: list[int] = Field(description="(n,) positions of the windows in the tree.")
    leaves: list[int] = Field(description="(n,) the leaf that each window is in.")
    probabilities: list[float] = Field(description="(n,) of drawing each window.")
    clip: list[int] = Field(description="(n,) index into `clips`.")
    clips: dict[str, str] = Field(description="Name of each clip that was drawn from, by index.")


class TreeSynthesisRequest(FromTree):
    """Motion of any length that grows from a tree, 30 frames a second."""

    method: Literal["exact", "tree"] = Field("exact", description="From p(i | t) itself, or by the paper's search.")
    seconds: float = Field(4.0, ge=1 / 30, le=3600, description="Duration [s].")
    activity: Activity | None = Field(None, description="Steer to this activity.", examples=["walk"])
    heading: float | None = Field(None, ge=-3600, le=3600, description="Steer to this heading [degrees]; 90 is left.")
    speed: float | None = Field(None, ge=0, le=10, description="Steer to this speed [m/s].")
    blend: bool = Field(True, description="Smooth over jumps between clips.")
    contact: bool = Field(True, description="Keep standing feet in place.")
    picture: Picture = Field(default_factory=Picture)

    @property
    def fps(self) -> float:
        """Frames per second: those of the database."""
        return 30.0

    @property
    def frames(self) -> int:
        """How many frames the motion has."""
        return max(1, round(self.seconds * self.fps))
