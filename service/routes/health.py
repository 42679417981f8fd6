"""Whether the service lives and is ready, and what it has counted."""

from fastapi import APIRouter, Request
from starlette.responses import PlainTextResponse, Response

from service.metrics import MEDIA_TYPE
from service.problems import documented

router = APIRouter(tags=["health"])
_REFUSALS = documented(401, 429)


@router.get("/health/live", summary="Whether the process answers")
async def live() -> dict[str, str]:
    """Always `alive`: restart what doesn't answer."""
    return {"status": "alive"}


@router.get("/health/ready", summary="Whether requests can be sent here", responses=documented(503))
async def ready(request: Request) -> Response:
    """`ready` once the models are loaded, until shutdown begins."""
    from service.problems import problem_response

    if not request.app.state.service.ready:
        return problem_response(503, "models are being loaded", headers={"Retry-After": "1"})
    return Response(b'{"status":"ready"}', media_type="application/json")


@router.get("/metrics", summary="Counts for Prometheus", response_class=PlainTextResponse, responses=_REFUSALS)
async def metrics(request: Request) -> Response:
    """Requests, their times, threads and jobs, in Prometheus' text format."""
    return Response(request.app.state.service.metrics.text(), media_type=MEDIA_TYPE)
