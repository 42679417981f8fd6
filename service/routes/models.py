"""Which models there are: `GET /v1/models`, and as the Open Inference Protocol has it `GET /v2/models/{name}`."""

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel
from starlette.responses import Response

from motionenv import __version__
from service.errors import documented, problem_response
from service.formats.models import description, summary
from service.responses import caching
from service.schemas.models import InferenceModel, ModelDescription, ModelList, Tensor

router = APIRouter(tags=["models"])
_REVALIDATED = "private, no-cache"
_UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "It is the one of `If-None-Match`."}}
_REFUSALS = documented(401, 404, 422, 429, 500, 503, 504)
_NUMBERS = ("deviations", "speed", "height")

Group = Annotated[str, Path(pattern="^[a-z0-9]+$", max_length=63, examples=["walk"])]
Name = Annotated[str, Path(pattern="^[a-z0-9][a-z0-9-]*$", max_length=63, examples=["fpca"])]
Full = Annotated[str, Path(pattern="^[a-z0-9]+/[a-z0-9][a-z0-9-]*$", max_length=127, examples=["walk/fpca"])]


@router.get("/v1/models", summary="All models", responses={200: {"model": ModelList}, **_UNCHANGED, **_REFUSALS})
async def models(request: Request) -> Response:
    """The ready-made models, and those that were fitted here."""
    model_registry = request.app.state.service.model_registry
    listed = await request.app.state.service.worker_pool.run(
        lambda: ModelList(models=[summary(name, *model_registry.find(name)) for name in model_registry.names()])
    )
    return _answer(request, listed)


@router.get(
    "/v1/models/{group}/{name}",
    summary="All about a model",
    responses={200: {"model": ModelDescription}, **_UNCHANGED, **_REFUSALS},
)
async def model(request: Request, group: Group, name: Name) -> Response:
    """Its card, its size, the components that `deviations` and `scores` are along, and what may be asked of it."""
    return _answer(request, await _described(request, f"{group}/{name}"))


@router.get("/v2", summary="The server, for clients of the Open Inference Protocol", tags=["inference protocol"])
async def server() -> dict[str, str | list[str]]:
    """Name and version; this service answers the protocol's questions about health and models only."""
    return {"name": "motionenv", "version": __version__, "extensions": []}


@router.get("/v2/health/live", summary="Whether the process answers", tags=["inference protocol"])
async def live() -> dict[str, bool]:
    """As /health/live."""
    return {"live": True}


@router.get(
    "/v2/health/ready", summary="Whether requests can be sent here", tags=["inference protocol"],
    responses=documented(503),
)  # fmt: skip
async def ready(request: Request) -> Response:
    """As /health/ready."""
    if not request.app.state.service.ready:
        return problem_response(503, "models are being loaded", headers={"Retry-After": "1"})
    return Response(b'{"ready":true}', media_type="application/json")


@router.get(
    "/v2/models/{name:path}/ready", summary="Whether a model is in memory", tags=["inference protocol"],
    responses=_REFUSALS,
)  # fmt: skip
async def model_ready(request: Request, name: Full) -> Response:
    """503 until it is. The name's slash may be written as it is or as %2F."""
    request.app.state.service.model_registry.get(name)
    return Response(b'{"name":"%b","ready":true}' % name.encode(), media_type="application/json")


@router.get(
    "/v2/models/{name:path}", summary="A model's inputs and outputs", tags=["inference protocol"],
    responses={200: {"model": InferenceModel}, **_UNCHANGED, **_REFUSALS},
)  # fmt: skip
async def inference_model(request: Request, name: Full) -> Response:
    """What `POST /v1/synthesis` takes and gives, as tensors. The name's slash may be written as it is or as %2F."""
    told = await _described(request, name)
    if told.kind is None:
        request.app.state.service.model_registry.get(name)  # which says when to ask again
    sizes = {"deviations": len(told.components)}
    inputs = [Tensor(name=n, datatype="FP64", shape=[sizes.get(n, 1)]) for n in _NUMBERS if n in told.ranges]
    shared = [Tensor(name="seed", datatype="INT64", shape=[1]), Tensor(name="seconds", datatype="FP64", shape=[1])]
    outputs = [Tensor(name="poses", datatype="FP64", shape=[-1, 25])] if told.synthesis else []
    return _answer(request, InferenceModel(
        name=name, versions=[__version__], platform=f"motionenv_{told.kind}", outputs=outputs,
        inputs=[*inputs, *shared] if told.synthesis else [],
    ))  # fmt: skip


async def _described(request: Request, name: str) -> ModelDescription:
    model_registry = request.app.state.service.model_registry
    return await request.app.state.service.worker_pool.run(lambda: description(name, *model_registry.find(name)))


def _answer(request: Request, told: BaseModel) -> Response:
    body = told.model_dump_json()
    headers = caching.cache_headers(caching.make_etag(body), control=_REVALIDATED)
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(headers)
    return Response(body, headers=headers, media_type="application/json")
