"""Gait analysis of synthesized walks: `POST /v1/gait`."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv import MotionError
from motionenv.gait import Session, analyse, shipped_band
from motionenv.gait.report import to_json
from motionenv.models import GaitModel
from service.errors import at_most, documented
from service.responses import caching
from service.schemas.gait import GaitReport, GaitRequest
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])


@router.post(
    "/gait", summary="The gait of a walk",
    responses={
        200: {"model": GaitReport}, **documented(400, 401, 404, 412, 413, 415, 422, 429, 500, 503, 504),
    },
)  # fmt: skip
async def analyse_gait(request: Request, asked: GaitRequest) -> Response:
    """Step parameters, events and joint angles over the gait cycle of a walk that a model makes, beside people's.

    A job of kind report does the same for captures.
    """
    service = request.app.state.service
    model = service.model_registry.get(asked.model, access_of(request.scope))
    at_most(asked.frames, service.settings.max_frames, "/seconds", "seconds · fps", "frames", each=asked.fps)
    seed, etag, headers = await caching.seeded(request, asked)
    if caching.etag_matches(request, etag):
        return caching.not_modified(request, headers)
    body = await service.worker_pool.run(lambda: _report(asked, model, seed))
    return Response(body, headers=headers, media_type="application/json")


def _report(asked: GaitRequest, model: GaitModel, seed: int) -> str:
    trial = analyse(asked.make(model, seed))
    if not trial.strides:
        raise MotionError("this walk has no stride of even speed along a straight line: ask for more seconds")
    return to_json(Session((trial,), {}, shipped_band()))
