"""Motion from models: `POST /v1/synthesis`."""

from functools import partial

from fastapi import APIRouter, Request
from starlette.responses import Response

from service.responses.motion_response import RESPONSES, answer
from service.schemas.synthesis import SynthesisRequest
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])


@router.post("/synthesis", summary="A walk", response_class=Response, responses=RESPONSES)
async def synthesize_walk(request: Request, asked: SynthesisRequest) -> Response:
    """A walk that a model makes, as JSON, numbers, a motion file, a film or a picture: `Accept` says which.

    Long JSON, CSV and BVH, and MP4 always, come while they are made. Asked for with a seed, the same bytes
    come each time, and `If-None-Match` with their ETag gives 304 without any work.
    """
    model = request.app.state.service.model_registry.get(asked.model, access_of(request.scope))

    quick = model.batch_size > 1 and asked.path is None and asked.speeds is None
    warning = model.extrapolation([max(v for _, v in asked.speeds) if asked.speeds else asked.speed])
    return await answer(request, asked, partial(asked.make, model), quick=quick, warning=warning)
