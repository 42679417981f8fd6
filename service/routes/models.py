"""Models: `GET /v1/models`."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel
from starlette.responses import FileResponse, Response

from service.errors import documented
from service.formats import NPZ
from service.formats.models import body_description, description, summary
from service.responses import caching
from service.responses.caching import keep_one_range
from service.schemas.models import BodyDescription, ModelDescription, ModelList
from service.transport.access import access_of

router = APIRouter(tags=["models"])
REVALIDATED = "private, no-cache"
_UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "It is the one of `If-None-Match`."}}
_REFUSALS = documented(401, 404, 422, 429, 500, 503, 504)

Group = Annotated[str, Path(pattern="^[a-z0-9]+$", max_length=63, examples=["walk"])]
Name = Annotated[str, Path(pattern="^[a-z0-9][a-z0-9-]*$", max_length=63, examples=["fpca"])]
Fitted = Annotated[str, Path(pattern=r"^[a-z0-9][a-z0-9-]{0,62}$", examples=["my-walk"])]


@router.get("/v1/models", summary="All models", responses={200: {"model": ModelList}, **_UNCHANGED, **_REFUSALS})
async def list_models(request: Request) -> Response:
    """The ready-made models, and those that were fitted here."""
    service = request.app.state.service
    known, access = service.model_registry, access_of(request.scope)
    listed = lambda: ModelList(models=[summary(name, *known.find(name, access)) for name in known.names(access)])
    return _answer(request, await service.worker_pool.run(listed))


@router.get(
    "/v1/models/fitted/{name}/file", summary="The file of a fitted model", response_class=Response,
    responses={
        200: {"description": "A file for `motionenv.load`, and for other services.", "content": {
            NPZ: {"schema": {"type": "string", "format": "binary"}}}},
        206: {"description": "The part of the file that `Range` asks for."}, **_UNCHANGED,
        **documented(401, 404, 416, 422, 429, 503, 504),
    },
)  # fmt: skip
async def get_model_file(request: Request, name: Fitted) -> Response:
    """The model as a file, which another service takes by `POST /v1/models/files`."""
    registry, access = request.app.state.service.model_registry, access_of(request.scope)
    path = await asyncio.to_thread(registry.find_path, f"fitted/{name}")
    if path is None or not registry.shows(path, access):
        raise registry.missing(f"fitted/{name}", access)
    found = path.stat()
    headers = caching.cache_headers(caching.make_etag(str(found.st_mtime_ns)), control=REVALIDATED)
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(request, headers)
    keep_one_range(request, found.st_size)
    return FileResponse(path, media_type=NPZ, headers=headers, stat_result=found, filename=f"{name}.npz")


@router.delete(
    "/v1/models/fitted/{name}", status_code=204, summary="Remove a fitted model",
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def remove_model(request: Request, name: Fitted) -> Response:
    """Remove a fitted model; shipped models can't be removed."""
    await request.app.state.service.jobs.remove_model(f"fitted/{name}", access_of(request.scope))
    return Response(status_code=204)


@router.get(
    "/v1/models/{group}/{name}",
    summary="All about a model",
    responses={200: {"model": ModelDescription}, **_UNCHANGED, **_REFUSALS},
)
async def get_model(request: Request, group: Group, name: Name) -> Response:
    """Its card, its size, the components that `deviations` and `scores` are along, and what may be asked of it."""
    service, whole, access = request.app.state.service, f"{group}/{name}", access_of(request.scope)
    told = await service.worker_pool.run(lambda: description(whole, *service.model_registry.find(whole, access)))
    return _answer(request, told)


@router.get(
    "/v1/body",
    summary="Order and units of poses and markers",
    responses={200: {"model": BodyDescription}, **_UNCHANGED, **documented(401, 429)},
)
async def describe_body(request: Request) -> Response:
    """Names and units of a pose's numbers and of markers, in order: the same for all models, formats and streams."""
    return _answer(request, body_description())


def _answer(request: Request, told: BaseModel) -> Response:
    body = told.model_dump_json()
    headers = caching.cache_headers(caching.make_etag(body), control=REVALIDATED)
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(request, headers)
    return Response(body, headers=headers, media_type="application/json")
