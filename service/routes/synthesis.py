"""Motion from models: `POST /v1/synthesis`."""

import secrets

from fastapi import APIRouter, Request
from starlette.responses import Response

import motionenv
from service.formats import MOTION, negotiated
from service.formats.motion import encoded
from service.schemas.synthesis import SynthesisRequest

router = APIRouter(prefix="/v1", tags=["motion"])
_INLINE = 600  # frames whose motion is made in less time than a thread's turn costs


@router.post("/synthesis", summary="A walk")
async def synthesis(request: Request, asked: SynthesisRequest) -> Response:
    """Synthesise."""
    service = request.app.state.service
    media_type = negotiated(request.headers.get("accept"), MOTION)
    seed = secrets.randbits(32) if asked.seed is None else asked.seed
    model = service.catalogue.get(asked.model)
    motion = motionenv.synthesize(
        model, asked.seconds, asked.fps, seed=seed, speed=asked.speed, height=asked.height, phase=asked.phase,
        variation=asked.variation,
    )  # fmt: skip
    return Response(encoded(motion, media_type, asked.model, seed), media_type=media_type)
