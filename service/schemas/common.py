"""Types shared by the schemas."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from motionenv.types import HEIGHT_RANGE, SPEED_RANGE, VARIATION_RANGE

#: A model's name.
ModelName = Annotated[
    str,
    Field(
        pattern=r"^[a-z0-9]+/[a-z0-9][a-z0-9-]{0,62}$",
        description="Name of a model; `GET /v1/models` lists them.",
        examples=["walk/fpca"],
    ),
]

Seed = Annotated[
    int | None,
    Field(
        ge=0, le=2**63 - 1,
        description="Seed of the random generator: the same seed gives the same bytes. If missing, the service draws "
        "one and returns it in the header `Motion-Seed`.",
        examples=[1],
    ),
]  # fmt: skip

WalkingSpeed = Annotated[float, Field(ge=SPEED_RANGE[0], le=SPEED_RANGE[1])]
BodyHeight = Annotated[float, Field(ge=HEIGHT_RANGE[0], le=HEIGHT_RANGE[1])]
Variation = Annotated[float, Field(ge=VARIATION_RANGE[0], le=VARIATION_RANGE[1])]


class Request(BaseModel):
    """Base of request bodies: strict types, no unknown fields, no NaN or infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)
