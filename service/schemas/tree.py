"""`POST /v1/tree/samples` and `POST /v1/tree/synthesis`."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, model_validator

from motionenv import MotionError
from motionenv.types import SECONDS_MOST
from service.schemas.common import ModelName, Request, Seed
from service.schemas.synthesis import Picture

Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Pose = Annotated[list[Number], Field(min_length=25, max_length=25)]
Activity = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$")]
Method = Annotated[Literal["exact", "tree"], Field(
    description="exact: draws from p(i | t); tree: the paper's probabilistic search.")]  # fmt: skip


class FromTree(Request):
    """Fields of both requests: the tree, and what precedes the motion."""

    model: Annotated[ModelName, Field(examples=["mixed/tree"])] = "mixed/tree"
    seed: Seed = None
    history: list[Pose] | None = Field(
        None, min_length=10, max_length=120,
        description="Poses [m, rad] at 30 frames/s, oldest first; the last 10 to 12 matter.",
    )  # fmt: skip
    start: Activity | None = Field(
        None, description="Instead of a history: an activity, from which the seed picks a window.", examples=["walk"]
    )
    temperature: float = Field(0.05, gt=0, le=100, description="β of paper C: near 0 the likeliest follow, at 1 all.")
    method: Method = "tree"

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if self.history is not None and self.start is not None:
            raise MotionError("give history or start, not both", "history", "start")
        return self


class SamplesRequest(FromTree):
    """A request for next poses."""

    n: int = Field(1, ge=1, le=10_000, description="Number of draws.", examples=[300])
    carry: bool = Field(False, description="Carry over the difference between the history and the window found.")
    noise: float = Field(0.0, ge=0, le=100, description="SD of added noise, as a share of the mean prediction error.")


class SamplesResponse(BaseModel):
    """Next poses, each with the database window that it follows."""

    model: str = Field(description="Name of the tree.")
    seed: int = Field(description="Seed of the draws.")
    pose: list[str] = Field(description="Names of the entries of a pose.")
    poses: list[list[float]] = Field(description="(n, 25) [m, rad].")
    windows: list[int] = Field(description="(n,) indices of the windows.")
    leaves: list[int] = Field(description="(n,) leaf of each window.")
    probabilities: list[float] = Field(description="(n,) probability of each window.")
    clip: list[int] = Field(description="(n,) index into `clips`.")
    clips: dict[str, str] = Field(description="Names of the clips drawn from, by index.")


class TreeSynthesisRequest(FromTree):
    """Motion of any length from a tree, at 30 frames/s."""

    method: Method = "exact"
    seconds: float = Field(4.0, ge=1 / 30, le=SECONDS_MOST, description="Duration [s].")
    activity: Activity | None = Field(None, description="Target activity.", examples=["walk"])
    heading: float | None = Field(None, ge=-3600, le=3600, description="Target heading [degrees]; 90 is left.")
    speed: float | None = Field(None, ge=0, le=10, description="Target speed [m/s].")
    blend: bool = Field(True, description="Blend over jumps between clips.")
    contact: bool = Field(True, description="Keep feet in contact in place.")
    picture: Picture = Field(default_factory=Picture)

    @property
    def fps(self) -> float:
        """Frames per second: that of the database."""
        return 30.0

    @property
    def frames(self) -> int:
        """Number of frames of the motion."""
        return max(1, round(self.seconds * self.fps))
