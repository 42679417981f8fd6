"""Which models there are: `GET /v1/models`."""

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel
from starlette.responses import Response

from service.errors import documented
from service.formats.models import body_description, description, summary
from service.responses import caching
from service.schemas.models import BodyDescription, ModelDescription, ModelList

router = APIRouter(tags=["models"])
REVALIDATED = "private, no-cache"
_UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "It is the one of `If-None-Match`."}}
_REFUSALS = documented(401, 404, 422, 429, 500, 503, 504)

Group = Annotated[str, Path(pattern="^[a-z0-9]+$", max_length=63, examples=["walk"])]
Name = Annotated[str, Path(pattern="^[a-z0-9][a-z0-9-]*$", max_length=63, examples=["fpca"])]


@router.get("/v1/models", summary="All models", responses={200: {"model": ModelList}, **_UNCHANGED, **_REFUSALS})
async def list_models(request: Request) -> Response:
    """The ready-made models, and those that were fitted here."""
    service = request.app.state.service
    known = service.model_registry
    listed = lambda: ModelList(models=[summary(name, *known.find(name)) for name in known.names()])
    return _answer(request, await service.worker_pool.run(listed))


@router.get(
    "/v1/models/{group}/{name}",
    summary="All about a model",
    responses={200: {"model": ModelDescription}, **_UNCHANGED, **_REFUSALS},
)
async def get_model(request: Request, group: Group, name: Name) -> Response:
    """Its card, its size, the components that `deviations` and `scores` are along, and what may be asked of it."""
    service, whole = request.app.state.service, f"{group}/{name}"
    told = await service.worker_pool.run(lambda: description(whole, *service.model_registry.find(whole)))
    return _answer(request, told)


@router.get(
    "/v1/body",
    summary="Order and units of poses and markers",
    responses={200: {"model": BodyDescription}, **_UNCHANGED, **documented(401, 429)},
)
async def describe_body(request: Request) -> Response:
    """What the numbers of a pose and of markers are, in their order: the same for all models, formats and streams."""
    return _answer(request, body_description())


def _answer(request: Request, told: BaseModel) -> Response:
    body = told.model_dump_json()
    headers = caching.cache_headers(caching.make_etag(body), control=REVALIDATED)
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(headers)
    return Response(body, headers=headers, media_type="application/json")
