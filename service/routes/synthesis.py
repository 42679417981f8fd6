"""Motion from models: `POST /v1/synthesis`, used most and so found first, and `GET`, whose address is the motion's."""

from functools import partial
from typing import Any

import orjson
from fastapi import APIRouter, Request
from pydantic import ValidationError
from starlette.responses import Response

from service.errors import documented, invalid
from service.responses.motion_response import BINARY, RESPONSES, answer, negotiated, takes_long
from service.routes.jobs import ACCEPTED, render_walk
from service.schemas.jobs import RenderRequest
from service.schemas.synthesis import SynthesisRequest
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])
_QUERY = SynthesisRequest.model_json_schema(ref_template="#/components/schemas/{model}")["properties"]
_QUERY["format"] = {"type": "string", "description": "Media type of the response, instead of `Accept`."}
_JSON = {"type": "string", "contentMediaType": "application/json"}
_plain = lambda schema: "array" not in str(schema) and "$ref" not in schema
_PARAMETERS = [
    {"name": name, "in": "query", "description": schema.get("description", ""),
     "schema": schema if _plain(schema) else {**_JSON, "contentSchema": schema}}
    for name, schema in _QUERY.items()
]  # fmt: skip


@router.post("/synthesis", summary="A walk", response_class=Response, responses={**RESPONSES, **ACCEPTED})
async def synthesize_walk(request: Request, asked: SynthesisRequest) -> Response:
    """A walk that a model makes, as JSON, numbers, a motion file, a film or a picture: `Accept` says which.

    Long JSON, CSV and BVH, and MP4 always, come while they are made; a long GIF or WebP becomes a job (202). Asked for
    with a seed, the same bytes come each time, and `If-None-Match` with their ETag gives 412 without any work.
    """
    if request.method == "POST" and takes_long(asked, media_type := negotiated(request)):
        return await render_walk(request, RenderRequest.model_validate(asked.model_dump() | {"format": media_type}))
    model = request.app.state.service.model_registry.get(asked.model, access_of(request.scope))
    quick = model.batch_size > 1 and asked.path is None and asked.speeds is None
    warning = model.extrapolation([max(v for _, v in asked.speeds) if asked.speeds else asked.speed])
    return await answer(request, asked, partial(asked.make, model), quick=quick, warning=warning)


@router.get(
    "/synthesis", summary="A walk with an address", response_class=Response, openapi_extra={"parameters": _PARAMETERS},
    responses={
        **RESPONSES, 200: {**RESPONSES[200], "content": dict(BINARY)},
        206: {"description": "The part that `Range` asks for."},
        304: {"description": "The motion has not changed (`If-None-Match`)."}, **documented(416),
    },
)  # fmt: skip
async def get_walk(request: Request) -> Response:
    """`POST /v1/synthesis` whose fields are the query, lists and objects as JSON: with a seed, browsers keep it.

    `Range` gets a part, as players of films ask for. `<video src="/v1/synthesis?seed=7&format=video/mp4">` is a film.
    """
    given = {name: _value(text) for name, text in request.query_params.items() if name != "format"}
    try:
        asked = SynthesisRequest.model_validate(given)
    except ValidationError as error:
        raise invalid(error, SynthesisRequest, "query") from None
    return await synthesize_walk(request, asked)


def _value(text: str) -> Any:
    """A value of the query: JSON, or text as it is."""
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        return text
