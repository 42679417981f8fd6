"""A model's arrays, from which the page makes its sliders and bodies: `GET /v1/models/{group}/{name}/parameters`."""

import threading
from functools import lru_cache
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

import motionenv
from motionenv import MotionError
from service.errors import Problem, documented
from service.formats.parameters import MEDIA_TYPE, packed
from service.responses import caching
from service.routes.models import REVALIDATED, Group, Name
from service.transport.access import EVERYTHING, access_of

router = APIRouter(prefix="/v1", tags=["models"])
_KEPT = 16  # models whose parameters stay in memory
_BYTES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A little-endian uint32 with the length of a JSON header, the header (padded so that what "
        "follows begins at a multiple of 8), and all arrays as little-endian float64, rows first. The header says for "
        "each array its `shape` and its `offset` in numbers, and names body, traits and units.",
        "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}},
    },
    304: {"description": "The parameters are those of `If-None-Match`."},
}


@router.get(
    "/models/{group}/{name}/parameters", summary="A model's mean, components and body", response_class=Response,
    responses={**_BYTES, **documented(401, 404, 422, 429, 503, 504)},
)  # fmt: skip
async def get_parameters(request: Request, group: Group, name: Name) -> Response:
    """The model's Fourier series, traits and body; `POST /v1/cycles` makes whole strides of them.

    With sliders at `d` standard deviations, scores are `mean_scores + d · deviations`, and the cycle is
    `mean + scores · components`; `POST /v1/cycles` puts it on the ground.
    """
    service = request.app.state.service
    model = service.model_registry.get(f"{group}/{name}", access_of(request.scope))
    try:
        body, tag = await service.worker_pool.run(lambda: _packed(model))
    except MotionError as error:
        raise Problem(422, str(error), field="/name") from None
    headers = caching.cache_headers(tag, control=REVALIDATED)
    if caching.etag_matches(request, tag):
        return caching.not_modified(request, headers)
    return Response(body, headers=headers, media_type=MEDIA_TYPE)


def prepare(model_registry: Any) -> None:
    """Work out, in a thread of its own, what the page asks for first: parameters and a stride.

    It takes some tenths of a second, or several where the kernel that walks in place isn't compiled yet.
    """
    models = [model_registry.get(name, EVERYTHING) for name in ("walk/fpca", "walk/eigenwalkers")]

    def work() -> None:
        for model in models:
            _packed(model)
            motionenv.models.cycle(model)

    threading.Thread(target=work, name="prepare", daemon=True).start()


@lru_cache(maxsize=_KEPT)
def _packed(model: Any) -> tuple[bytes, str]:
    body = packed(*motionenv.models.parameters(model))
    return body, caching.make_etag(body)
