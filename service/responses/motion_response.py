"""A motion as an HTTP response: content negotiation, caching, and where it is computed.

Used by all routes that synthesize motion. With a seed, the request determines the response byte for byte.
"""

import threading
from collections.abc import Callable, Iterator
from typing import Any

from fastapi import Request
from starlette.responses import Response

from motionenv.types import Motion
from service import formats
from service.errors import at_most, documented
from service.formats import films, motion
from service.responses import caching
from service.responses.threaded_response import ThreadedResponse
from service.schemas.synthesis import MotionResponse, SynthesisRequest
from service.schemas.tree import TreeSynthesisRequest
from service.settings import Settings

_INLINE = 600  # frames that are synthesized in less time than passing them to a thread takes
_INSTANT = (formats.JSON, formats.NPY, formats.NPZ)
_CHUNKED = (formats.JSON, formats.CSV, formats.BVH, formats.TRC, formats.MOT)  # if they are long; MP4 always
_FROM_START = "bytes=0-"  # players begin so, and get all of it as it is made
_AT_ONCE = 240 * 640 * 480  # pixels of a film in one piece, which take 15 s on two cores
_GIF_FPS = 50  # players slow faster ones down
_C3D_FRAMES = 65_535
_TEXTS = (formats.CSV, formats.TRC, formats.MOT)
_HEADERS = {
    "ETag": {"description": "Only with a seed: the same request gives the same bytes.", "schema": {"type": "string"}},
    "Motion-Seed": {"description": "The seed of the motion.", "schema": {"type": "integer"}},
    "Motion-Warning": {"description": "Where the motion is beyond what was learned.", "schema": {"type": "string"}},
}  # fmt: skip
_content = lambda kinds, **schema: {kind: {"schema": {"type": "string", **schema}} for kind in kinds}
#: OpenAPI of a motion as bytes or text.
BINARY = _content((formats.NPY, *formats.FILES, *formats.FILMS), format="binary") | _content(_TEXTS)
#: OpenAPI of the responses.
RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The motion, in the format that `Accept` selects.", "headers": _HEADERS, "model": MotionResponse,
        "content": {formats.JSON: {}, **BINARY},  # first what clients that are generated from it return
    },
    **documented(400, 401, 404, 406, 412, 413, 415, 422, 429, 500, 503, 504),
}  # fmt: skip
MotionRequest = SynthesisRequest | TreeSynthesisRequest


def negotiated(request: Request) -> str:
    """Media type of the response: the parameter `format` of a GET, or what `Accept` prefers; 406, unknown format."""
    wanted = request.query_params.get("format") if request.method == "GET" else None
    return formats.negotiated(wanted or request.headers.get("accept"), formats.MOTION)


def takes_long(asked: MotionRequest, media_type: str) -> bool:
    """Whether a film that is sent as a whole, GIF or WebP, may take longer than a request may."""
    whole = media_type in (formats.GIF, formats.WEBP)
    return whole and asked.frames * asked.picture.width * asked.picture.height > _AT_ONCE


async def answer(
    request: Request, asked: MotionRequest, make: Callable[[int], Motion], *, quick: bool, warning: str | None = None
) -> Response:
    """The motion `make(seed)`, of `asked.frames` frames, as a response in the format that the client accepts.

    With `quick`, a short motion is made at once: it takes less time than passing it to a thread. A `warning` goes into
    the header `Motion-Warning`.

    Raises:
        Problem: 406, unknown format; 422, too large.
    """
    service = request.app.state.service
    getting, media_type = request.method == "GET", negotiated(request)
    _check_limits(asked, media_type, service.settings)
    seed, etag, headers = await caching.seeded(request, asked, media_type)
    if warning:
        headers["Motion-Warning"] = warning
    if caching.etag_matches(request, etag):
        return caching.not_modified(request, headers)
    if quick and media_type in _INSTANT and asked.frames <= _INLINE:
        body = b"".join(motion.parts(make(seed), media_type, asked.model, seed))
        return Response(body, headers=headers, media_type=media_type)
    whole = media_type != formats.MP4 and not (media_type in _CHUNKED and asked.frames > _INLINE)
    produce = lambda gone: _chunks(make, asked, media_type, seed, gone)
    if not getting or etag is None or request.headers.get("range", _FROM_START) == _FROM_START:
        return ThreadedResponse(service.worker_pool, produce, media_type, headers, whole=whole)

    def parted(body: bytes) -> Response:
        service.parted = etag, body  # a player asks for many parts of one film
        return caching.part_of(request, body, headers, media_type)

    if service.parted[0] == etag:
        return parted(service.parted[1])
    return ThreadedResponse(service.worker_pool, produce, media_type, headers, whole=True, respond=parted)


def _chunks(
    make: Callable[[int], Motion], asked: MotionRequest, media_type: str, seed: int, gone: threading.Event
) -> Iterator[bytes]:
    made = make(seed)
    yield b""  # lets the response stop here if the client has disconnected
    if media_type not in formats.FILMS:
        yield from motion.parts(made, media_type, asked.model, seed)
        return
    try:
        yield from films.parts(made, asked.picture, media_type, gone)
    except films.Disconnected:
        return


def _check_limits(asked: MotionRequest, media_type: str, settings: Settings) -> None:
    seconds = "/seconds", "seconds · fps"
    at_most(asked.frames, settings.max_frames, *seconds, "frames", each=asked.fps)
    if media_type == "application/x-c3d":
        at_most(asked.frames, _C3D_FRAMES, *seconds, "frames of a C3D file", each=asked.fps)
    if media_type not in formats.FILMS:
        return
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, settings.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    if media_type == formats.PNG:
        at_most(shown.frame, asked.frames - 1, "/picture/frame", "frame", "(the last one)")
        return
    at_most(asked.frames, settings.max_video_frames, *seconds, "frames of a video", each=asked.fps)
    if takes_long(asked, media_type):
        long = _AT_ONCE // pixels
        at_most(asked.frames, long, *seconds, "frames of a GIF or WebP in one response", each=asked.fps)
    if media_type == formats.GIF:
        at_most(asked.fps, _GIF_FPS, "/fps", "fps", "for GIF")
