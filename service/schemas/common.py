"""Types shared by the schemas."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from motionenv.arguments import ARGUMENTS, WALK_ARGUMENTS, Argument, Choice

#: A model's name.
ModelName = Annotated[str, Field(
    pattern=r"^[a-z0-9]+/[a-z0-9][a-z0-9-]{0,62}$",
    description="Name of a model; `GET /v1/models` lists them.", examples=["walk/fpca"],
)]  # fmt: skip

Seed = Annotated[int | None, Field(
    ge=0, le=2**63 - 1, examples=[1],
    description="Seed of the random generator: the same seed gives the same bytes. If missing, the service draws "
    "one and returns it in the header `Motion-Seed`.",
)]  # fmt: skip


class Request(BaseModel):
    """Base of request bodies: strict types, no unknown fields, no NaN or infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


def walk_request(*names: str) -> Any:
    """Base class of requests that have the arguments of a walk with these `names`: see `motionenv.arguments`."""
    return create_model("WalkRequest", __base__=Request, **{name: _field(ARGUMENTS[name]) for name in names})


def _field(argument: Argument) -> Any:
    meaning = argument.meaning
    if isinstance(meaning, Choice):
        return Literal[meaning.words], Field(argument.default, description=meaning.help)
    bounds: dict[str, Any] = {"ge": meaning.low, "le": meaning.high, "gt": meaning.above}
    finite = {name: bound for name, bound in bounds.items() if np.isfinite(bound)}
    return argument.type, Field(argument.default, description=meaning.help, **finite)


WalkRequest = walk_request("speed", *WALK_ARGUMENTS)
