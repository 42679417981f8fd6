"""`GET /v1/models`, and `GET /v1/body`."""

from typing import Any

from pydantic import BaseModel, Field


class Component(BaseModel):
    """One way in which people differ: what a slider moves along."""

    name: str = Field(examples=["component 1"])
    deviation: float = Field(ge=0, description="Standard deviation of the scores along it, in the scores' unit.")
    mean: float = Field(description="The average person's score.")
    share: float | None = Field(None, ge=0, le=1, description="Share of the variance explained.", examples=[0.43])


class Range(BaseModel):
    """Bounds of a number in a request."""

    minimum: float = Field(examples=[0.1])
    maximum: float = Field(examples=[3.0])
    unit: str = Field(examples=["m/s"])


class ModelSummary(BaseModel):
    """A model in the list."""

    name: str = Field(description="What `model` in requests is set to.", examples=["walk/fpca"])
    kind: str | None = Field(description="Such as walking, eigenwalkers or tree; null until it is loaded.")
    ready: bool = Field(description="Whether it is in memory; requests for one that isn't get 503.")
    problem: str | None = Field(None, description="Why it can't be loaded, if so.")
    summary: str = Field(description="What it is.")
    licence: str | None = Field(None, description="Of the model; its data's is in the card.", examples=["MIT"])


class ModelDescription(ModelSummary):
    """All about a model."""

    about: str = Field("", description="How it makes motion.")
    card: dict[str, Any] = Field(description="Its card: data, people, licence, how it was made.")
    synthesis: bool = Field(description="Whether `POST /v1/synthesis` can walk with it.")
    dimensions: dict[str, int] = Field(
        default_factory=dict, description="How large it is.", examples=[{"components": 8, "pose": 25}]
    )
    height: float | None = Field(None, description="Height of its average body [m].")
    components: list[Component] = Field([], description="In the order of `deviations` and `scores`; none of a tree.")
    activities: list[str] = Field([], description="What a tree's `start` and `activity` may be.", examples=[["walk"]])
    steady: bool = Field(True, description="Whether its motions are walks along x at one speed, cycle after cycle.")
    steerable: bool = Field(False, description="Whether its motion grows frame by frame and can be steered.")
    treadmill: str | None = Field(
        None, description="Of what its parameters are Fourier series: poses or markers; null where they hold none."
    )
    ranges: dict[str, Range] = Field(description="What a request's numbers may be.")


class ModelList(BaseModel):
    """All models."""

    models: list[ModelSummary] = Field(description="Those that ship first, then the fitted ones.")


class PoseEntry(BaseModel):
    """A number of a pose."""

    name: str = Field(examples=["left_knee_flexion"])
    unit: str = Field(description="m or rad.", examples=["rad"])


class BodyDescription(BaseModel):
    """The orders of poses and markers. x is forward, y to the left, z up, and the ground is z = 0."""

    pose: list[PoseEntry] = Field(description="The 25 entries of a pose.")
    markers: list[str] = Field(description="The 15 markers [m].", examples=[["head", "sternum", "pelvis"]])
    edges: list[tuple[int, int]] = Field(description="Pairs of markers that are joined in a stick figure.")
