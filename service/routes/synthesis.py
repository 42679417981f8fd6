"""Motion from models: `POST /v1/synthesis`."""

import secrets
import threading
from collections.abc import Iterator
from functools import partial
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

import motionenv
from motionenv.types import Motion
from service import caching
from service.formats import BVH, CSV, FILES, FILMS, GIF, JSON, MOTION, MP4, NPY, NPZ, PNG, films, motion, negotiated
from service.problems import Problem, documented
from service.schemas.synthesis import MotionResponse, SynthesisRequest
from service.sending import Made
from service.settings import Settings

router = APIRouter(prefix="/v1", tags=["motion"])
_INLINE = 600  # frames whose motion is made in less time than a thread's turn costs
_INSTANT = (JSON, NPY, NPZ)
_IN_PARTS = (JSON, CSV, BVH)  # where they are long; MP4 always
_GIF_FPS = 50  # players show faster ones much slower
_C3D_FRAMES = 65_535
_DRAW_SEED = 32  # bits of a seed that the service draws
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_HEADERS = {
    "ETag": {"description": "Where a seed is given: same request, same bytes.", "schema": {"type": "string"}},
    "Motion-Seed": {"description": "The seed that the motion was made with.", "schema": {"type": "integer"}},
}  # fmt: skip
_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The motion, in the format that `Accept` asks for.",
        "headers": _HEADERS,
        "model": MotionResponse,
        "content": dict.fromkeys((NPY, *FILES, *FILMS), _BINARY) | {CSV: {"schema": {"type": "string"}}},
    },
    304: {"description": "The motion is the one of `If-None-Match`.", "headers": _HEADERS},
    **documented(400, 401, 404, 406, 413, 422, 429, 500, 501, 503, 504),
}


@router.post("/synthesis", summary="A walk", response_class=Response, responses=_ANSWERS)
async def synthesis(request: Request, asked: SynthesisRequest) -> Response:
    """A walk that a model makes, as JSON, numbers, a motion file, a film or a picture: `Accept` says which.

    Long JSON, CSV and BVH, and MP4 always, come while they are made. Asked for with a seed, the same bytes come each
    time, and `If-None-Match` with their ETag gives 304 without any work. 501: this machine has no OpenGL.
    """
    service = request.app.state.service
    media_type = negotiated(request.headers.get("accept"), MOTION)
    _check_limits(asked, media_type, service.settings)
    model = service.catalogue.get(asked.model)
    etag = None
    if asked.seed is not None:
        etag = caching.tag(asked.model, service.catalogue.version(asked.model), media_type, asked.model_dump_json())
    seed = secrets.randbits(_DRAW_SEED) if asked.seed is None else asked.seed
    headers = {"Motion-Seed": str(seed), **caching.kept(etag)}
    if caching.unchanged(request, etag):
        return caching.not_modified(headers)
    if media_type in _INSTANT and asked.frames <= _INLINE and model.kind == "walking":
        body = b"".join(motion.parts(_motion(model, asked, seed), media_type, asked.model, seed))
        return Response(body, headers=headers, media_type=media_type)
    painted = media_type in FILMS and asked.picture.engine == "pyrender"
    whole = media_type != MP4 and not (media_type in _IN_PARTS and asked.frames > _INLINE)
    making = partial(_making, model, asked, media_type, seed)
    return Made(service.painter if painted else service.workshop, making, media_type, headers, whole=whole)


def _motion(model: Any, asked: SynthesisRequest, seed: int) -> Motion:
    """The motion that is asked for."""
    return motionenv.synthesize(
        model, asked.seconds, asked.fps, seed=seed, speed=asked.speed, height=asked.height, phase=asked.phase,
        variation=asked.variation, deviations=asked.deviations, scores=asked.scores,
    )  # fmt: skip


def _making(model: Any, asked: SynthesisRequest, media_type: str, seed: int, gone: threading.Event) -> Iterator[bytes]:
    """The parts of an answer that takes long.

    Raises:
        Problem: 501, the engine can't run here.
    """
    made = _motion(model, asked, seed)
    yield b""  # a place to stop at
    if media_type not in FILMS:
        yield from motion.parts(made, media_type, asked.model, seed)
        return
    try:
        yield from films.parts(made, asked.picture, media_type, gone)
    except motionenv.EngineError as error:
        raise Problem(501, str(error), field="/picture/engine") from None
    except films.Unwanted:
        return


def _check_limits(asked: SynthesisRequest, media_type: str, settings: Settings) -> None:
    """Refuse, before any work, what is larger than this service or the format allows.

    Raises:
        Problem: 422 with the field and its bound.
    """
    seconds = "/seconds", "seconds · fps"
    _at_most(asked.frames, settings.max_frames, *seconds, "frames")
    if media_type == "application/x-c3d":
        _at_most(asked.frames, _C3D_FRAMES, *seconds, "frames of a C3D file")
    if media_type not in FILMS:
        return
    shown = asked.picture
    _at_most(shown.width * shown.height, settings.max_pixels, "/picture/width", "width · height", "pixels")
    if media_type == PNG:
        _at_most(shown.frame, asked.frames - 1, "/picture/frame", "the number of the frame", "(the last frame)")
        return
    _at_most(asked.frames, settings.max_video_frames, *seconds, "frames of a video")
    if media_type == GIF:
        _at_most(asked.fps, _GIF_FPS, "/fps", "fps", "for GIF")


def _at_most(value: float, most: float, field: str, name: str, unit: str) -> None:
    if value > most:
        raise Problem(422, f"{name} must be {most} {unit} at most, got {value:g}", field=field, bound={"le": most})
