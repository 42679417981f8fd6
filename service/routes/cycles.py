"""One stride in place: `POST /v1/cycles`."""

from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv.models import Cycle, GaitModel, cycle
from service.errors import Problem, documented
from service.formats import JSON, NPY, NPZ, negotiated
from service.formats.cycles import encoded
from service.formats.parameters import MEDIA_TYPE
from service.responses import caching
from service.schemas.cycles import CycleRequest, CycleResponse
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The stride. NPZ holds the arrays and numbers of the JSON by their names, NPY the poses, and "
        f"{MEDIA_TYPE} is read as a model's parameters are.",
        "model": CycleResponse, "content": {JSON: {}, NPY: _BINARY, NPZ: _BINARY, MEDIA_TYPE: _BINARY},
    },
    **documented(400, 401, 404, 406, 412, 413, 415, 422, 429, 500, 503, 504),
}  # fmt: skip


@router.post("/cycles", summary="One stride in place", response_class=Response, responses=_RESPONSES)
async def walk_in_place(request: Request, asked: CycleRequest) -> Response:
    """One stride of a walker in place, as on a treadmill, without variation: 15 markers and poses.

    At time t, the walk over the ground is the stride at phase t / seconds, moved along x by stride · t / seconds.
    """
    service = request.app.state.service
    media_type = negotiated(request.headers.get("accept"), (JSON, NPY, NPZ, MEDIA_TYPE))
    model = service.model_registry.get(asked.model, access_of(request.scope))
    version = service.model_registry.version(asked.model)
    headers = caching.cache_headers(caching.make_etag(request.scope["path"], version, media_type, await request.body()))
    if warning := model.extrapolation([asked.speed]):
        headers["Motion-Warning"] = warning
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(request, headers)
    body = await service.worker_pool.run(lambda: encoded(*_made(model, asked), asked.model, media_type))
    return Response(body, headers=headers, media_type=media_type)


def _made(model: GaitModel, asked: CycleRequest) -> tuple[Cycle, float, np.ndarray]:
    """The stride, the walker's weight [kg] and deviations (q,); a seed draws who `POST /v1/synthesis` draws with it."""
    if model.treadmill() is None:
        raise Problem(422, f"{asked.model} makes no cycles in place", field="/model")
    components = model.components()
    if asked.seed is not None:
        walker = model.draw_walker(np.random.default_rng(asked.seed), asked.speed, asked.height, asked.person)
    else:
        given = asked.deviations or () if asked.scores is None else None
        walker = model.walker(deviations=given, scores=asked.scores)
    made = cycle(model, walker=walker, **asked.model_dump(include={"speed", "height", "weight", "samples"}))
    weight = asked.weight or (walker.person.bmi * made.body.height**2 if walker.person else np.nan)
    return made, weight, (np.array(walker.scores) - components.means) / components.deviations
