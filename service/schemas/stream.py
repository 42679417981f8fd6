"""Messages of `WS /v1/stream`."""

from typing import Annotated

from pydantic import Field

from service.schemas.common import ModelName, WalkRequest
from service.schemas.synthesis import Deviation
from service.schemas.tree import Activity


class StreamSettings(WalkRequest):
    """Settings of a stream; a message contains those that change."""

    model: ModelName = "walk/fpca"
    seed: int = Field(0, ge=0, le=2**63 - 1, description="The same seed and messages give the same motion.")
    fps: float = Field(30.0, ge=1, le=120, description="Frames per second; always 30 for trees.")
    deviations: Annotated[list[Deviation], Field(max_length=64)] | None = Field(
        None, description="The walker, in standard deviations along each component; default: drawn with the seed."
    )
    temperature: float = Field(0.05, gt=0, le=100, description="Trees: temperature of the draws.")
    activity: Activity | None = Field(None, description="Trees: target activity.")
    heading: float | None = Field(None, ge=-3600, le=3600, description="Trees: target heading [degrees]; 90 is left.")
    paused: bool = Field(False, description="Whether the stream is paused.")
