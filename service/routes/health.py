"""Liveness, readiness and metrics."""

from fastapi import APIRouter, Request
from starlette.responses import PlainTextResponse, Response

from service.errors import documented, problem_response
from service.observability.metrics import MEDIA_TYPE

router = APIRouter(tags=["health"])
_REFUSALS = documented(401, 429)


@router.get("/health/live", summary="Liveness")
async def check_alive() -> dict[str, str]:
    """Always `alive`; restart a process that doesn't respond."""
    return {"status": "alive"}


@router.get("/health/ready", summary="Readiness", responses=documented(503))
async def check_ready(request: Request) -> Response:
    """`ready` once the models are loaded, until shutdown begins."""
    if not request.app.state.service.ready:
        return problem_response(503, "models are being loaded", headers={"Retry-After": "1"})
    return Response(b'{"status":"ready"}', media_type="application/json")


@router.get("/metrics", summary="Metrics for Prometheus", response_class=PlainTextResponse, responses=_REFUSALS)
async def get_metrics(request: Request) -> Response:
    """Requests, latencies, threads and jobs, in the text format of Prometheus."""
    service = request.app.state.service
    service.metrics.count_jobs(await service.jobs.store.counts())
    return Response(service.metrics.text(), media_type=MEDIA_TYPE)
