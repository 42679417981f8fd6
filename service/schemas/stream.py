"""Messages of `WS /v1/stream`."""

from typing import Annotated

from pydantic import Field

from service.schemas.common import ModelName, Request
from service.schemas.synthesis import Deviation
from service.schemas.tree import Activity


class StreamSettings(Request):
    """What is walked, and how; a message holds those that change."""

    model: ModelName = "walk/fpca"
    seed: int = Field(0, ge=0, le=2**63 - 1, description="The same seed and messages give the same motion.")
    fps: float = Field(30.0, ge=1, le=120, description="Frames per second; trees have 30.")
    deviations: Annotated[list[Deviation], Field(max_length=64)] | None = Field(
        None, description="The walker, as standard deviations along each component; drawn without it."
    )
    speed: float | None = Field(None, ge=0.1, le=3.0, description="[m/s]; a tree is steered to it.")
    height: float | None = Field(None, ge=0.5, le=2.5, description="Body height [m].")
    variation: float = Field(1.0, ge=0, le=10, description="Factor on how much the cycles of a walk differ.")
    temperature: float = Field(0.05, gt=0, le=100, description="Of a tree.")
    activity: Activity | None = Field(None, description="That a tree is steered to.")
    heading: float | None = Field(None, ge=-3600, le=3600, description="That a tree is steered to [degrees].")
    paused: bool = Field(False, description="Whether to stand still for now.")
