"""What the schemas share."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

#: A walking model's name, and the longest that any name may be.
ModelName = Annotated[
    str,
    Field(
        pattern=r"^[a-z0-9]+/[a-z0-9][a-z0-9-]{0,62}$",
        description="Name of a model: see GET /v1/models.",
        examples=["walk/fpca"],
    ),
]

Seed = Annotated[
    int | None,
    Field(
        ge=0, le=2**63 - 1,
        description="The same seed gives the same bytes. Without one the service draws one, and says it in the header "
        "`Motion-Seed`.",
        examples=[1],
    ),
]  # fmt: skip


class Request(BaseModel):
    """A request's body: only the fields named here, of the types named here, and no NaN or infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)
