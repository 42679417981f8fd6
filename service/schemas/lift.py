"""`POST /v1/lift`."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, model_validator

from motionenv import MotionError
from service.schemas.common import Request

_MARKERS = 15
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = Annotated[list[Coordinate | None], Field(min_length=2, max_length=3)]
Frame = Annotated[list[Point | None], Field(min_length=_MARKERS, max_length=_MARKERS)]
Vector = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Matrix = Annotated[list[Vector], Field(min_length=3, max_length=3)]


class CameraPose(BaseModel):
    """Pose of a camera in one frame."""

    R: Matrix = Field(description="(3, 3): rotation from the world, whose z points up, to the camera.")
    t: Vector = Field(description="(3): translation from the world, whose ground is z = 0, [m].")


class LiftCamera(BaseModel):
    """A pinhole camera in OpenCV's convention; a point x of the world is at K (R x + t) in the picture."""

    K: Matrix = Field(description="(3, 3): intrinsics [pixels].")
    R: Matrix | None = Field(None, description="Of a camera that stands, as in `poses`.")
    t: Vector | None = Field(None, description="Of a camera that stands, as in `poses`.")
    poses: list[CameraPose] | None = Field(None, description="Of a camera that moves: one for each frame.")
    distortion: list[Coordinate] | None = Field(
        None, min_length=4, max_length=8, description="Of the lens: k1, k2, p1, p2[, k3[, k4, k5, k6]]."
    )

    @model_validator(mode="after")
    def _whole_pose(self) -> Self:
        if (self.R is None) != (self.t is None):
            told = "R and t belong together: give both, or leave both out if the pose isn't known"
            raise MotionError(told, "R", "t")
        if self.R is not None and self.poses is not None:
            told = "R and t are of a camera that stands, poses of one that moves: leave one of them out"
            raise MotionError(told, "R", "t", "poses")
        return self


class LiftRequest(Request):
    """2D points of one person, seen by one camera."""

    points: list[Frame] = Field(
        min_length=8, max_length=10_000,
        description="(frames, 15, 2 or 3): head, sternum, pelvis, then left and right shoulder, elbow, wrist, hip, "
        "knee and ankle, in the order of `markers` in the answer; null for missing points. A third number is the "
        "detector's confidence from 0 to 1.",
    )  # fmt: skip
    fps: float = Field(ge=1, le=1000, description="Frames per second.", examples=[30.0])
    unit: Literal["m", "px"] = Field("px", description="px: pixels, y down. m: metres, y up, seen from afar.")
    elevation: Annotated[float, Field(ge=-85, le=85)] | Literal["unknown"] = Field(
        0.0, description="Angle by which the camera looks down [degrees]; 'unknown': estimate it."
    )
    height: float | None = Field(
        None, ge=0.5, le=2.5, description="Height [m], of points in pixels; an adult's if missing."
    )
    feet: list[Annotated[list[Point | None], Field(min_length=4, max_length=4)]] | None = Field(
        None, description="(frames, 4, 2): left heel and toe, right heel and toe, as `points`."
    )
    gait: bool = Field(False, description="Whether to answer with joint angles, events and step parameters, too.")
    camera: LiftCamera | None = Field(None, description="For points in pixels; guessed if missing.")

    @model_validator(mode="after")
    def _pose_of_every_frame(self) -> Self:
        poses = None if self.camera is None else self.camera.poses
        if self.feet is not None and len(self.feet) != len(self.points):
            raise ValueError(f"feet must have {len(self.points)} frames as points, got {len(self.feet)}")
        if poses is not None and len(poses) != len(self.points):
            told = f"camera.poses must have one pose for each of the {len(self.points)} frames, got {len(poses)}"
            raise MotionError(told, "camera.poses", "points")
        return self


class OtherMotion(BaseModel):
    """The motion if left and right are exchanged in all points: the body faces another way."""

    positions: list[list[list[float | None]]] = Field(description="(frames, 15, 3) [m].")
    probability: float = Field(ge=0, le=1, description="Probability that this is the true motion.")


class AngleBand(BaseModel):
    """A joint angle over time, with its 90 % band; null where it is cut out."""

    degrees: list[float | None] = Field(description="(frames,).")
    low: list[float | None] = Field(description="(frames,).")
    high: list[float | None] = Field(description="(frames,).")


class LiftedEvent(BaseModel):
    """An initial contact or a toe-off."""

    kind: Literal["initial_contact", "toe_off"] = Field(description="What happens.")
    side: Literal["left", "right"] = Field(description="Of which foot.")
    time: float = Field(description="Since the first frame [s].")
    deviation: float = Field(description="Standard deviation of the time [s].")
    share: float = Field(ge=0, le=1, description="Probability that the foot steps there.")


class LiftedCut(BaseModel):
    """What is cut out of the angles."""

    start: float = Field(description="Since the first frame [s].")
    end: float = Field(description="Since the first frame [s].")
    why: str = Field(description="For what reason.")


class LiftedGait(BaseModel):
    """Gait of the lifted person, with uncertainties."""

    angles: dict[str, AngleBand] = Field(description="By name, such as left_knee_flexion; none that is undetermined.")
    events: list[LiftedEvent] = Field(description="In the order of time.")
    parameters: list[dict[str, str | float | None]] = Field(
        description="Step parameters, as of gait; low and high are 90 % intervals of strides and lifting together."
    )
    cut: list[LiftedCut] = Field(description="What is cut out, in the order of time.")
    undetermined: dict[str, str] = Field(description="By angle without its side, why it isn't told.")
    scale: str = Field(description="Where sizes come from.")
    warnings: list[str] = Field(description="What else is wrong with the figures.")
    page: str = Field(description="The same as a page of HTML.")


class LiftResponse(BaseModel):
    """Motion in three dimensions, with uncertainties."""

    other: OtherMotion | None = Field(description="Another motion that the points may show.")
    misfit: float = Field(description="How unlike the people learned from this is.")
    plausible: bool = Field(description="Whether it is like them, so that bands hold.")
    unlike: list[bool] = Field(description="(frames,): whether a frame shows something else, such as sitting or noise.")
    fps: float = Field(description="Frames per second.")
    markers: list[str] = Field(description="Names of the 15 markers.")
    positions: list[list[list[float | None]]] = Field(
        description="(frames, 15, 3) [m], z up; without a camera's pose, x goes across the picture and y away. Null "
        "where nobody is seen, like all that follows from positions."
    )
    band: list[list[list[float | None]]] = Field(
        description="(frames, 15, 3) [m]: half width of 90 % bands around positions; null in frames `unlike`."
    )
    heading: list[float | None] = Field(description="(frames,) [degrees]: where the body faces, from x towards y.")
    contact: list[list[float | None]] = Field(description="(frames, 2): probability that each foot stands.")
    pose: list[str] = Field(description="Names of the entries of a pose.")
    poses: list[list[float | None]] = Field(description="(frames, 25) [m, rad]: poses of the body.")
    height: float = Field(description="Body height [m].")
    swapped: list[list[bool]] = Field(description="(frames, 2): whether the sides of arms and of legs were exchanged.")
    gait: LiftedGait | None = Field(None, description="If it was asked for.")
