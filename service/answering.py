"""A motion as the answer to a request: what format, whether the client has it already, and who makes it.

Shared by all routes that make motion: what a request asks for decides on the answer, byte for byte, once it has a seed.
"""

import secrets
import threading
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from fastapi import Request
from starlette.responses import Response

import motionenv
from motionenv.types import Motion
from service import caching
from service.formats import BVH, CSV, FILES, FILMS, GIF, JSON, MOTION, MP4, NPY, NPZ, PNG, films, motion, negotiated
from service.problems import Problem, at_most, documented
from service.schemas.synthesis import MotionResponse, Picture
from service.sending import Made
from service.settings import Settings

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
#: OpenAPI of the answers.
ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The motion, in the format that `Accept` asks for.",
        "headers": _HEADERS,
        "model": MotionResponse,
        "content": dict.fromkeys((NPY, *FILES, *FILMS), _BINARY) | {CSV: {"schema": {"type": "string"}}},
    },
    304: {"description": "The motion is the one of `If-None-Match`.", "headers": _HEADERS},
    **documented(400, 401, 404, 406, 413, 415, 422, 429, 500, 501, 503, 504),
}


class Asked(Protocol):
    """A request for motion."""

    @property
    def model(self) -> str:
        """Name of the model."""

    @property
    def seed(self) -> int | None:
        """That decides on the motion."""

    @property
    def frames(self) -> int:
        """How many frames it has."""

    @property
    def fps(self) -> float:
        """Frames per second."""

    @property
    def picture(self) -> Picture:
        """How films show it."""


async def answer(request: Request, asked: Asked, make: Callable[[int], Motion], *, quick: bool) -> Response:
    """The motion that `make(seed)` makes, in the format that the client accepts.

    Args:
        request: of HTTP.
        asked: its body.
        make: of a seed a motion of `asked.frames` frames.
        quick: whether a short motion is made in less time than a thread's turn costs.

    Raises:
        Problem: 406, 422: a format or a size that can't be.
    """
    service = request.app.state.service
    media_type = negotiated(request.headers.get("accept"), MOTION)
    _check_limits(asked, media_type, service.settings)
    etag = None
    if asked.seed is not None:
        version = service.catalogue.version(asked.model)
        etag = caching.tag(request.scope["path"], version, media_type, await request.body())
    seed = secrets.randbits(_DRAW_SEED) if asked.seed is None else asked.seed
    headers = {"Motion-Seed": str(seed), **caching.kept(etag)}
    if caching.unchanged(request, etag):
        return caching.not_modified(headers)
    if quick and media_type in _INSTANT and asked.frames <= _INLINE:
        body = b"".join(motion.parts(make(seed), media_type, asked.model, seed))
        return Response(body, headers=headers, media_type=media_type)
    painted = media_type in FILMS and asked.picture.engine == "pyrender"
    whole = media_type != MP4 and not (media_type in _IN_PARTS and asked.frames > _INLINE)
    making = lambda gone: _making(make, asked, media_type, seed, gone)
    return Made(service.painter if painted else service.workshop, making, media_type, headers, whole=whole)


def _making(
    make: Callable[[int], Motion], asked: Asked, media_type: str, seed: int, gone: threading.Event
) -> Iterator[bytes]:
    """The parts of an answer that takes long.

    Raises:
        Problem: 501, the engine can't run here.
    """
    made = make(seed)
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


def _check_limits(asked: Asked, media_type: str, settings: Settings) -> None:
    """Refuse, before any work, what is larger than this service or the format allows.

    Raises:
        Problem: 422 with the field and its bound.
    """
    seconds = "/seconds", "seconds · fps"
    at_most(asked.frames, settings.max_frames, *seconds, "frames", each=asked.fps)
    if media_type == "application/x-c3d":
        at_most(asked.frames, _C3D_FRAMES, *seconds, "frames of a C3D file", each=asked.fps)
    if media_type not in FILMS:
        return
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, settings.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    if media_type == PNG:
        at_most(shown.frame, asked.frames - 1, "/picture/frame", "the number of the frame", "(the last frame)")
        return
    at_most(asked.frames, settings.max_video_frames, *seconds, "frames of a video", each=asked.fps)
    if media_type == GIF:
        at_most(asked.fps, _GIF_FPS, "/fps", "fps", "for GIF")
