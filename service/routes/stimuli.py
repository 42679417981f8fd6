"""Stimulus sets for experiments on perception: `POST /v1/stimuli`."""

import threading
from collections.abc import Iterator
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv.data.stimuli import zipped
from service.errors import at_most, documented
from service.formats import ZIP, negotiated
from service.responses import caching
from service.responses.threaded_response import ThreadedResponse
from service.schemas.stimuli import StimuliRequest
from service.settings import Settings
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])
_BYTES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A ZIP archive: a film or a folder of frames of each stimulus, a table (.csv) of where its dots "
        "are, and `stimuli.json` with every parameter and the SHA-256 of the pixels.",
        "headers": {"ETag": {"description": "The same set gives the same bytes.", "schema": {"type": "string"}}},
        "content": {ZIP: {"schema": {"type": "string", "format": "binary"}}},
    },
}


@router.post(
    "/stimuli", summary="A set of point-light stimuli", response_class=Response,
    responses={**_BYTES, **documented(400, 401, 404, 406, 412, 413, 415, 422, 429, 500, 503, 504)},
)  # fmt: skip
async def make_stimuli(request: Request, asked: StimuliRequest) -> Response:
    """Point-light walkers as experiments on perception show them, as a ZIP archive that comes while it is made.

    `motionenv stimuli stimuli.json --out DIR` makes the same pixels again from the archive's `stimuli.json`.
    """
    service = request.app.state.service
    negotiated(request.headers.get("accept"), [ZIP])
    _check_limits(asked, service.settings)
    registry, access = service.model_registry, access_of(request.scope)
    models = {person.model: registry.get(person.model, access) for person in asked.people}
    versions = [registry.version(name) for name in models]
    headers = caching.cache_headers(caching.make_etag(request.scope["path"], *versions, await request.body()))
    if caching.etag_matches(request, headers["ETag"]):
        return caching.not_modified(request, headers)

    def produce(_: threading.Event) -> Iterator[bytes]:
        yield from zipped(asked, models.__getitem__)

    return ThreadedResponse(service.worker_pool, produce, ZIP, headers, whole=False)


def _check_limits(asked: StimuliRequest, settings: Settings) -> None:
    frames, pixels = asked.stimuli * asked.frames, asked.width * asked.height
    limit, each = settings.max_video_frames, asked.stimuli * asked.fps
    at_most(frames, limit, "/seconds", "people · displays · seconds · fps", "frames", each=each)
    at_most(pixels, settings.max_pixels, "/width", "width · height", "pixels", each=asked.height)
