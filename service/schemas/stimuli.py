"""`POST /v1/stimuli`."""

from pydantic import Field

from motionenv.data.stimuli import PointLightWalker, StimulusSet
from service.schemas.common import ModelName


class Walker(PointLightWalker):
    """A walker."""

    model: ModelName = "walk/fpca"


class StimuliRequest(StimulusSet):
    """Stimuli: each person in each display."""

    people: tuple[Walker, ...] = Field((Walker(),), min_length=1)
