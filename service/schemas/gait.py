"""`POST /v1/gait`, and the numbers of gait reports."""

from pydantic import BaseModel, Field

from service.schemas.synthesis import SynthesisRequest


class GaitRequest(SynthesisRequest):
    """A walk whose gait is analysed."""

    seconds: float = Field(8.0, ge=2, le=600, description="Duration [s].")
    fps: float = Field(100.0, ge=30, le=240, description="Frames per second.")


class StepParameter(BaseModel):
    """A number of a walk; if n is 1, that of one stride and no mean."""

    name: str = Field(examples=["step_length"])
    unit: str = Field(examples=["m"])
    side: str = Field(description="left, right, or empty where it is of both.")
    mean: float | None = Field(description="Mean over strides.")
    sd: float | None = Field(description="Standard deviation over strides.")
    low: float | None = Field(description="Lower end of the 95 % interval of the mean.")
    high: float | None = Field(description="Upper end of it.")
    n: int = Field(description="Number of strides.")


class Curve(BaseModel):
    """A joint angle from initial contact, 0 %, to the next one of the same foot, 100 %, at each percent."""

    mean: list[float | None] = Field(description="(101,) [degrees].")
    sd: list[float | None] = Field(description="(101,) [degrees].")


class StrideCurve(Curve):
    """A joint angle over strides; if n is 1, that of one stride and no mean."""

    n: int = Field(description="Number of strides that are known at least in part.")


class ProfileScore(BaseModel):
    """How far an angle, or several, are from the band over the gait cycle (Baker et al. 2009)."""

    name: str = Field(description="An angle, gait_profile_score, or deviation where angles for that are missing.")
    side: str = Field(description="left, right, or empty where it is of both.")
    value: float = Field(description="Root mean square difference [degrees].")
    n: int = Field(description="Number of strides.")
    angles: int = Field(description="Number of angles of both sides.")
    median: float | None = Field(description="Of the band's people, each against the mean of the others [degrees].")
    low: float | None = Field(description="Least of these people [degrees].")
    high: float | None = Field(description="Greatest of these people [degrees].")


class StepNorm(BaseModel):
    """A step parameter of healthy people of an age."""

    name: str = Field(examples=["speed"])
    unit: str = Field(examples=["m/s"])
    sex: str = Field(description="female, male, or empty for both.")
    youngest: int = Field(description="[years].")
    oldest: int = Field(description="[years].")
    mean: float
    sd: float | None = Field(description="Standard deviation over people, if it was published.")
    source: str


class GaitBand(BaseModel):
    """Reference band of people's angles."""

    people: int
    who: str = Field(description="Who they are.")
    angles: dict[str, Curve] = Field(description="By angle, such as knee_flexion: over people.")


class GaitEvent(BaseModel):
    """A foot's initial contact or toe-off."""

    time: float = Field(description="[s].")
    kind: str = Field(examples=["initial_contact"])
    side: str = Field(examples=["left"])


class GaitStretch(BaseModel):
    """A part of a capture in which somebody walks steadily, turns, stands or does something else."""

    start: float = Field(description="[s].")
    end: float = Field(description="[s].")
    kind: str = Field(examples=["steady"])


class GaitCapture(BaseModel):
    """Analysis of one walk."""

    name: str
    seconds: float = Field(description="Duration [s].")
    fps: float = Field(description="Frames per second.")
    method: str = Field(description="Where angles come from.")
    events: list[GaitEvent]
    events_from: dict[str, int] = Field(description="Number of events by their source.")
    stretches: list[GaitStretch]
    strides: int = Field(description="Number of strides, steady or not.")
    sides: dict[str, int] = Field(description="Number of strides by side that the angles are of.")
    angles: dict[str, list[float | None]] = Field(
        description="As of the report, but means over the strides of this walk alone: (101,) [degrees]."
    )
    notes: list[str] = Field(description="What a reader should know.")
    doubts: list[str] = Field(description="What in the walk isn't plausible.")


class GaitReport(BaseModel):
    """Step parameters and joint angles over the gait cycle."""

    person: str = Field(description="Label of the person, or the name of the first capture.")
    notes: list[str] = Field(description="What a reader should know of the figures of all walks together.")
    parameters: list[StepParameter]
    angles: dict[str, StrideCurve] = Field(description="By side and angle, such as left_knee_flexion: over strides.")
    axes: dict[str, tuple[float, float]] = Field(description="By angle, the ends of its axis in figures [degrees].")
    profile: list[ProfileScore] = Field(description="Differences from the band: each angle's, the sides', both's.")
    norms: list[StepNorm] = Field(description="Published norms for the age.")
    band: GaitBand | None = Field(description="What angles are compared with.")
    captures: list[GaitCapture]
    left_out: dict[str, str] = Field(description="Files that couldn't be used, and why.")
