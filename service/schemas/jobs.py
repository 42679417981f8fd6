"""`/v1/jobs` and `POST /v1/models`."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.problems import ProblemDetail
from service.schemas.synthesis import SynthesisRequest

Kind = Literal["fit", "inspect", "convert", "render"]
Status = Literal["queued", "running", "done", "failed", "cancelled"]


class ReadFields(BaseModel):
    """How uploaded files are read; a field is text, as forms have it."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    fps: float | None = Field(
        None, ge=1, le=10_000, description="Frames per second, where files don't say: AMC never does.", examples=[120]
    )
    unit: Literal["m", "dm", "cm", "mm", "inch", "cmu"] | None = Field(
        None, description="Unit of length, where files don't say.", examples=["cm"]
    )


class FitFields(ReadFields):
    """Which model is fitted to uploaded capture."""

    kind: Literal["fpca", "eigenwalkers", "tree"] = Field(
        description="fpca and eigenwalkers learn straight walks, a tree any motion. Eigenwalkers need several people: "
        "the name of a file up to the first _ says who it is.",
        examples=["fpca"],
    )  # fmt: skip
    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9-]{0,62}$", description="The model will be fitted/<name>.", examples=["my-walk"]
    )
    activity: str | None = Field(
        None, min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$", description="Tree: what is done in the files."
    )
    mirrored: bool = Field(False, description="Tree: whether to take left-right mirror images too.")


class ConvertFields(ReadFields):
    """What a capture file is to become."""

    format: Literal[
        "application/json", "application/x-npz", "text/csv", "model/x-bvh", "model/gltf-binary", "application/x-c3d"
    ] = Field(description="Media type of the result.", examples=["model/x-bvh"])


class RenderRequest(SynthesisRequest):
    """A walk to be rendered at leisure."""

    format: Literal["video/mp4", "image/gif", "image/webp"] = Field("video/mp4", description="Media type of the video.")


class JobStatus(BaseModel):
    """Where a job is."""

    id: str = Field(description="Of the job.", examples=["V1n0YOBq7L2c5Bq3kJk3HQ"])
    kind: Kind = Field(description="What it does.")
    status: Status = Field(description="queued and running go on; the others are the end.")
    progress: float = Field(ge=0, le=1, description="How much is done.")
    message: str = Field(description="What it is doing, in plain words.", examples=["reading 07_01.amc, 1 of 12"])
    model: str | None = Field(None, description="The model that it fits.", examples=["fitted/my-walk"])
    files: list[str] = Field(description="Names of the uploaded files, as far as they can be told safely.")
    created: datetime = Field(description="When it was asked for.")
    started: datetime | None = Field(None, description="When it was begun last.")
    ended: datetime | None = Field(None, description="When it ended.")
    media_type: str = Field(description="Of the result.", examples=["application/json"])
    size: int | None = Field(None, description="Of the result [bytes].")
    result: str | None = Field(None, description="Where the result is.", examples=["/v1/jobs/V1n0YOBq/result"])
    error: ProblemDetail | None = Field(None, description="Why it failed.")


class JobPage(BaseModel):
    """Jobs, the newest first."""

    jobs: list[JobStatus] = Field(description="Those on this page.")
    next: str | None = Field(None, description="`before` of the next page; null on the last one.")


class Fitted(BaseModel):
    """Result of a job of kind fit."""

    model: str = Field(description="Name of the model.", examples=["fitted/my-walk"])
    kind: str = Field(description="Of the model.")
    card: dict[str, Any] = Field(description="What people need to know of it.")
    used: list[str] = Field(description="Files that it learned from.")
    left_out: dict[str, str] = Field(description="Files that it didn't learn from, and why.")


Row = Annotated[list[float | None], Field(min_length=25, max_length=25)]


class Preview(BaseModel):
    """A motion of the body, to be looked at: about 30 frames a second, 3,600 frames at most."""

    fps: float = Field(description="Frames per second.")
    height: float = Field(description="Of the body [m].")
    offsets: list[list[float]] = Field(description="(16, 3) [m]: of the body's nodes in their segments.")
    radii: list[list[float]] = Field(description="(limbs, 2) [m].")
    poses: list[Row] = Field(description="(frames, 25) [m, rad]; null in gaps.")


class Walk(BaseModel):
    """The cycles of a straight walk."""

    stride: float = Field(description="Time of a stride [s].")
    starts: list[float] = Field(description="When the left leg is furthest ahead, once a stride [s].")
    speed: float = Field(description="[m/s].")


class Inspected(BaseModel):
    """What is in a file."""

    name: str = Field(description="Of the file.")
    problem: str | None = Field(None, description="What is wrong: it can't be read, or is no straight walk.")
    format: str | None = Field(None, examples=["bvh"])
    points: list[str] | None = Field(None, description="Names of markers or joints.")
    frames: int | None = Field(None, description="How many.")
    fps: float | None = Field(None, description="Frames per second.")
    seconds: float | None = Field(None, description="Duration [s].")
    gaps: float | None = Field(None, description="Share of values that are missing.")
    motion: Preview | None = Field(None, description="The body that does it.")
    straightness: float | None = Field(None, description="Share of its path's length by which it gets ahead.")
    walk: Walk | None = Field(None, description="Its cycles, from which a walking model can learn.")


class Inspection(BaseModel):
    """Result of a job of kind inspect."""

    pose: list[str] = Field(description="Names of the entries of a pose.")
    files: list[Inspected] = Field(description="In the order of their names.")
