"""`/v1/jobs` and `POST /v1/models`."""

from datetime import datetime
from textwrap import shorten
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Json, model_validator

from motionenv import MotionError
from motionenv.mocap import MarkerMap
from service.errors import ProblemDetail
from service.schemas.synthesis import SynthesisRequest

Kind = Literal["fit", "import", "inspect", "points", "convert", "report", "render"]
Status = Literal["queued", "running", "done", "failed", "cancelled"]
_PROBLEM = 500  # characters of what is wrong with a marker map, at most


ModelName = Field(
    pattern=r"^[a-z0-9][a-z0-9-]{0,62}$", description="The model's name will be fitted/<name>.", examples=["my-walk"]
)
Listed = Field(
    True, description="Whether lists show the job and the model that it makes. What isn't listed is for those who know "
    "its name, and an unlisted model goes with its job."
)  # fmt: skip
Replace = Field(False, description="Whether it may take the place of a model of that name.")


GroupName = Annotated[str, Field(min_length=1, max_length=40)]
People = Annotated[list[Annotated[str, Field(min_length=1, max_length=80)]], Field(min_length=2, max_length=500)]


def _checked_map(text: str) -> str:
    try:
        MarkerMap.parse(text)
    except MotionError as error:
        raise ValueError(shorten(str(error), _PROBLEM)) from None
    return text


class ReadFields(BaseModel):
    """Options for reading uploaded files (form fields)."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    map: Annotated[str, Field(min_length=1, max_length=32_768), AfterValidator(_checked_map)] | None = Field(
        None,
        description="Marker map (TOML): landmarks of the body, each with the point or the weighted points of the files "
        "that mark it, or with several names, of which the first that a file has counts. Without it, points are "
        "recognised by their names. A job of kind points proposes one.",
        examples=['[points]\nleft_knee_lateral = "KneeL"\nleft_hip = { HipL1 = 0.5, HipL2 = 0.5 }\n'],
    )
    fps: float | None = Field(
        None, ge=1, le=10_000, description="Frames per second of files that don't contain it, such as AMC.",
        examples=[120],
    )  # fmt: skip
    unit: Literal["m", "dm", "cm", "mm", "inch", "cmu"] | None = Field(
        None, description="Unit of length of files that don't contain it.", examples=["cm"]
    )
    up: Literal["x", "y", "z"] | None = Field(
        None, description="Vertical axis of the files, if it isn't the usual one of their format.", examples=["z"]
    )
    person: str | None = Field(
        None, min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$", examples=["Anna"],
        description="Which of several people in a file: what stands in front of the names of the person's points and a "
        "colon. Without it, the one with the most landmarks.",
    )  # fmt: skip
    listed: bool = Listed


class FillFields(ReadFields):
    """Options for reading uploaded files as whole motions."""

    fill: bool = Field(
        False, description="Whether to fill what the files don't show, such as the arms beside a lower body, by the "
        "prior of walk/fpca. Otherwise it stays unknown."
    )  # fmt: skip


class FitFields(FillFields):
    """A model to be fitted to uploaded motion capture."""

    kind: Literal["fpca", "eigenwalkers", "tree"] = Field(
        description="fpca and eigenwalkers learn from strides, a tree from any motion. Eigenwalkers need "
        "several people: the part of a file's name before the first _ identifies the person.",
        examples=["fpca"],
    )  # fmt: skip
    name: str = ModelName
    replace: bool = Replace
    activity: str | None = Field(
        None, min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$", description="Tree: the activity in the files."
    )
    mirrored: bool = Field(False, description="Tree: whether to add left-right mirror images.")
    groups: Json[dict[GroupName, People]] | None = Field(
        None, description="Eigenwalkers: JSON of two groups of people, for the axis between them. People are the parts "
        "of files' names before the first _.", examples=['{"young": ["07", "08"], "old": ["21", "35"]}'],
    )  # fmt: skip

    @model_validator(mode="after")
    def _axis(self) -> Self:
        if self.groups is not None and self.kind != "eigenwalkers":
            raise MotionError("groups are only for eigenwalkers: leave them out", "groups", "kind")
        if self.groups is not None and len(self.groups) != 2:
            raise MotionError(f"groups must be two, got {len(self.groups)}", "groups")
        return self


class ModelFields(BaseModel):
    """A model's file."""

    model_config = ConfigDict(extra="forbid")

    name: str = ModelName
    replace: bool = Replace
    listed: bool = Listed


class ConvertFields(FillFields):
    """A conversion of a capture file."""

    format: Literal[
        "application/json", "application/x-npz", "text/csv", "model/x-bvh", "model/gltf-binary", "application/x-c3d",
        "text/x-trc", "text/x-mot",
    ] = Field(description="Media type of the result.", examples=["model/x-bvh"])  # fmt: skip


class ReportFields(ReadFields):
    """A gait report on capture files."""

    format: Literal["text/html", "application/json", "text/csv"] = Field(
        "text/html", description="Media type of the result: a page with figures, or its numbers."
    )
    static: str | None = Field(
        None, min_length=1, max_length=255, examples=["standing.c3d"],
        description="Name of the uploaded file that holds the static trial, which calibrates the joint centres; it "
        "isn't reported on.",
    )  # fmt: skip
    wands: Literal["auto", "use", "ignore"] = Field(
        "auto", description="The markers on thighs and shanks; auto leaves out those that can't be right."
    )
    age: float | None = Field(None, ge=0, le=120, description="Age [years], for published norms of step parameters.")
    sex: Literal["female", "male"] | None = Field(None, description="For norms that part the sexes; needs age.")


class RenderRequest(SynthesisRequest):
    """A walk to be rendered in a job."""

    format: Literal["video/mp4", "image/gif", "image/webp"] = Field("video/mp4", description="Media type of the video.")


class JobStatus(BaseModel):
    """State of a job."""

    id: str = Field(description="Id of the job.", examples=["V1n0YOBq7L2c5Bq3kJk3HQ"])
    kind: Kind = Field(description="Kind of work.")
    status: Status = Field(description="queued and running change further; the others are final.")
    progress: float = Field(ge=0, le=1, description="Share of the work that is done.")
    message: str = Field(description="Current step.", examples=["reading 07_01.amc, 1 of 12"])
    model: str | None = Field(None, description="Name of the model that the job fits.", examples=["fitted/my-walk"])
    files: list[str] = Field(description="Names of the uploaded files, sanitised.")
    created: datetime = Field(description="When the job was submitted.")
    started: datetime | None = Field(None, description="When the job was last started.")
    ended: datetime | None = Field(None, description="When the job ended.")
    media_type: str = Field(description="Media type of the result.", examples=["application/json"])
    size: int | None = Field(None, description="Size of the result [bytes].")
    result: str | None = Field(None, description="Path of the result.", examples=["/v1/jobs/V1n0YOBq/result"])
    error: ProblemDetail | None = Field(None, description="Why the job failed.")


class JobPage(BaseModel):
    """Jobs, newest first."""

    jobs: list[JobStatus] = Field(description="Jobs on this page.")
    next: str | None = Field(None, description="Value of `before` for the next page; null on the last one.")


class Fitted(BaseModel):
    """Result of a job of kind fit."""

    model: str = Field(description="Name of the model.", examples=["fitted/my-walk"])
    kind: str = Field(description="Kind of the model.")
    card: dict[str, Any] = Field(description="Model card: data, people, licence, how it was made.")
    used: list[str] = Field(description="Files that the model learned from.")
    left_out: dict[str, str] = Field(description="Files that were left out, and why.")
    notes: list[str] = Field(description="How far left-out people fall right on an axis between groups.")


Position = Annotated[list[float], Field(min_length=3, max_length=3)]


class CapturePoints(BaseModel):
    """Result of a job of kind points: what is needed to say which point is which landmark."""

    name: str = Field(description="Name of the file.")
    points: list[str] = Field(description="Names of markers or joints.")
    frame: int = Field(ge=0, description="The first frame in which most points are visible, counted from 0.")
    positions: list[Position | None] = Field(
        description="(points, 3) [m] in that frame, z up; null where it lacks them."
    )
    heading: float | None = Field(
        description="Direction in which the points move during the capture [degrees], from x towards y; null if they "
        "stay within 0.3 m."
    )
    marker_set: str | None = Field(description="The marker set with the most landmarks among the points; null if none.")
    problem: str | None = Field(None, description="Why the points aren't a body's, with this map or without one.")
    map: str | None = Field(
        description="Marker map (TOML): the one that was sent, or else a guess from names and heights; null if nothing "
        "could be guessed."
    )
    assigned: dict[str, dict[str, float]] = Field(
        description="For each landmark that this map finds in the file, the points and their weights, which sum to 1.",
        examples=[{"left_knee_lateral": {"KneeL": 1.0}}],
    )
    unfound: list[str] = Field(description="Landmarks of this map for which the file has no points.")
    landmarks: dict[str, str] = Field(description="All landmarks that a map may name, each described by a sentence.")


Row = Annotated[list[float | None], Field(min_length=25, max_length=25)]


class Preview(BaseModel):
    """A preview of a motion: about 30 frames a second, at most 3,600 frames."""

    fps: float = Field(description="Frames per second.")
    height: float = Field(description="Body height [m].")
    offsets: list[list[float]] = Field(description="(16, 3) [m]: position of each node in the frame of its segment.")
    radii: list[list[float]] = Field(description="(limbs, 2) [m]: radius of each limb at its ends.")
    poses: list[Row] = Field(description="(frames, 25) [m, rad]; null in gaps.")
    points: list[list[list[float | None]]] | None = Field(
        None, description="What was captured, (frames, points, 3) [m]; null in gaps, and for files of angles alone."
    )


class Walk(BaseModel):
    """The gait cycles of a walk, from which models learn."""

    stride: float = Field(description="Mean duration of a stride [s].")
    starts: list[float] = Field(description="Times at which the left leg is about furthest ahead, once per stride [s].")
    speed: float = Field(description="Walking speed [m/s].")


class Inspected(BaseModel):
    """Content of a file."""

    name: str = Field(description="Name of the file.")
    problem: str | None = Field(None, description="Why it can't be read, or shows no stride.")
    format: str | None = Field(None, examples=["bvh"])
    points: list[str] | None = Field(None, description="Names of markers or joints.")
    frames: int | None = Field(None, description="Number of frames.")
    fps: float | None = Field(None, description="Frames per second.")
    seconds: float | None = Field(None, description="Duration [s].")
    gaps: float | None = Field(None, description="Share of missing values.")
    notes: list[str] | None = Field(
        None, description="What the reader of the file had to decide, such as which of several people it took."
    )
    doubts: list[str] | None = Field(None, description="What isn't plausible for a person.")
    motion: Preview | None = Field(None, description="The retargeted motion.")
    straightness: float | None = Field(None, description="Distance from start to end, as a share of the path's length.")
    walk: Walk | None = Field(None, description="Whole cycles, if it is a walk.")
    strides: dict[Literal["left", "right"], int] | None = Field(None, description="Strides of a gait report, by side.")


class Inspection(BaseModel):
    """Result of a job of kind inspect."""

    pose: list[str] = Field(description="Names of the entries of a pose.")
    files: list[Inspected] = Field(description="One entry per file, in order of their names.")
