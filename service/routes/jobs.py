"""Jobs: `/v1/jobs`."""

import asyncio
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Header, Path, Query, Request
from starlette.responses import FileResponse, Response

from service.errors import Problem, at_most, documented, told
from service.formats import FILES, FILMS, HTML, JSON
from service.jobs.manager import JobManager
from service.jobs.store import WAITING, Job
from service.jobs.uploads import Received
from service.responses.caching import etag_matches, keep_one_range
from service.schemas import jobs as schemas
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["jobs"])
_POLL = 0.1  # [s] between checks of a job for which a client waits
_FRESH = {"Cache-Control": "no-store"}
#: Headers of pages that browsers show: they hold names from uploaded files, and get no access to the API.
_SANDBOX = {
    "Content-Security-Policy": "sandbox allow-downloads; default-src 'none'; style-src 'unsafe-inline'; img-src data:"
}
Id = Annotated[str, Path(min_length=1, max_length=64, description="Id of the job.")]
Key = Annotated[str | None, Header(
    alias="Idempotency-Key", min_length=1, max_length=255,
    description="A request repeated with the same key returns the same job.",
)]  # fmt: skip
#: OpenAPI of the response to a request for a job.
ACCEPTED: dict[int | str, dict[str, Any]] = {202: {
    "model": schemas.JobStatus, "description": "The job is queued.",
    "headers": {"Location": {"description": "Path of the job.", "schema": {"type": "string"}}},
}}  # fmt: skip


@router.post(
    "/jobs/render", status_code=202, summary="Render a long walk",
    responses={**ACCEPTED, **documented(400, 401, 404, 413, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def render_walk(request: Request, asked: schemas.RenderRequest, key: Key = None) -> Response:
    """Render a video that takes longer than a request may. Without a seed each job draws one."""
    manager, limits, access = _manager(request), request.app.state.service.settings, access_of(request.scope)
    await manager.check_open("render")
    await asyncio.to_thread(manager.model_registry.check, asked.model, access)
    at_most(asked.frames, limits.max_frames, "/seconds", "seconds · fps", "frames", each=asked.fps)
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, limits.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    suffix = FILMS[asked.format]
    settings = {"request": asked.model_dump(exclude={"format"}), "suffix": suffix}
    return await queued(request, "render", settings, [], media_type=asked.format, filename=f"walk{suffix}", key=key)


@router.get(
    "/jobs", summary="List jobs", response_model=schemas.JobPage, responses=documented(400, 401, 422, 429, 503, 504),
)  # fmt: skip
async def list_jobs(
    request: Request,
    limit: Annotated[int, Query(ge=1, le=500, description="Maximum number of jobs.")] = 50,
    status: Annotated[schemas.Status | None, Query(description="Only jobs with this status.")] = None,
    before: Annotated[str | None, Query(max_length=64, description="`next` of the page before.")] = None,
) -> Response:
    """The jobs of the request's key, newest first; without keys, and for an admin key, all jobs."""
    manager = _manager(request)
    found, following = await manager.page(access_of(request.scope), limit, status, before)
    body = {"jobs": [await _to_response(manager, job) for job in found], "next": following}
    return Response(orjson.dumps(body), media_type=JSON, headers=_FRESH)


@router.get(
    "/jobs/{job}", summary="State of a job", response_model=schemas.JobStatus,
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def get_job(
    request: Request,
    job: Id,
    wait: Annotated[float, Query(ge=0, le=30, description="Seconds to wait for a change before the response.")] = 0.0,
) -> Response:
    """Status and progress; with `wait`, as soon as either changes."""
    manager, access, until = _manager(request), access_of(request.scope), time.monotonic() + wait
    found = first = await manager.get(job, access)
    going = lambda: found == first and found.status in WAITING
    while going() and time.monotonic() < until:
        await asyncio.sleep(_POLL)
        found = await manager.get(job, access)
    return await _state(manager, found)


@router.get(
    "/jobs/{job}/result", summary="Result of a job", response_class=Response,
    responses={
        200: {
            "model": schemas.Fitted | schemas.Inspection | schemas.CapturePoints,
            "description": "`Fitted` for fit, `Inspection` for inspect, `CapturePoints` for points, else a file.",
            "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in [*FILES, *FILMS, HTML]},
        },
        206: {"description": "The part of the file that `Range` asks for."},
        304: {"description": "The result has not changed (`If-None-Match`)."},
        **documented(401, 404, 409, 416, 422, 429, 503, 504),
    },
)  # fmt: skip
async def get_result(request: Request, job: Id) -> Response:
    """The result of a job that is done; `Range` gets a part of a file, to go on with a download that broke off."""
    manager = _manager(request)
    found = await manager.get(job, access_of(request.scope))
    path, tag = await manager.result(found), f'"{found.result}"'
    shown, policy = ("inline", _SANDBOX) if found.media_type == HTML else ("attachment", {})
    headers = {
        "ETag": tag, "Cache-Control": "private, max-age=86400, immutable", "X-Content-Type-Options": "nosniff",
        **policy,
    }  # fmt: skip
    if etag_matches(request, tag):
        return Response(status_code=304, headers={"ETag": tag})
    try:
        size = path.stat()
    except FileNotFoundError:
        raise Problem(404, "the job was removed") from None
    keep_one_range(request, size.st_size)
    return FileResponse(
        path, media_type=found.media_type, headers=headers, stat_result=size, filename=found.filename,
        content_disposition_type=shown,
    )  # fmt: skip


@router.post(
    "/jobs/{job}/cancel", summary="Cancel a job", response_model=schemas.JobStatus,
    responses=documented(401, 404, 409, 422, 429, 503, 504, 507),
)  # fmt: skip
async def cancel_job(request: Request, job: Id) -> Response:
    """Cancel a queued or running job and keep its state. Cancelling it again is not an error."""
    manager, access = _manager(request), access_of(request.scope)
    await manager.cancel(await manager.get(job, access))
    found = await manager.get(job, access)
    if found.status != "cancelled":
        raise Problem(409, f"the job is {found.status} and can't be cancelled; DELETE removes it")
    return await _state(manager, found)


@router.delete(
    "/jobs/{job}", summary="Cancel or remove a job", response_model=schemas.JobStatus,
    responses={204: {"description": "The job had ended and was removed with its files."},
               **documented(401, 404, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def remove_job(request: Request, job: Id) -> Response:
    """Cancel a queued or running job; remove an ended one with its result. A fitted model stays."""
    manager, access = _manager(request), access_of(request.scope)
    found = await manager.get(job, access)
    if found.status in WAITING:
        await manager.cancel(found)
        return await _state(manager, await manager.get(job, access))
    await manager.remove(found)
    return Response(status_code=204)


def _manager(request: Request) -> JobManager:
    return request.app.state.service.jobs


async def queued(
    request: Request, kind: str, settings: dict[str, Any], files: Sequence[Received], **about: Any
) -> Response:
    """Queue a job for a request, arguments as of `JobManager.add`, and tell its state."""
    manager = _manager(request)
    job = await manager.add(kind, settings, files, access_of(request.scope), **about)
    return await _state(manager, job, 202, Location=f"/v1/jobs/{job.id}")


async def _state(manager: JobManager, job: Job, status: int = 200, **headers: str) -> Response:
    body = orjson.dumps(await _to_response(manager, job))
    return Response(body, status, headers={**headers, **_FRESH}, media_type=JSON)


async def _to_response(manager: JobManager, job: Job) -> dict[str, Any]:
    error = job.error and told(job.error["status"], job.error["detail"])
    when = lambda time: time and datetime.fromtimestamp(time, UTC)
    return {
        "id": job.id, "kind": job.kind, "status": job.status, "progress": job.progress, "message": job.message,
        "model": job.model, "files": [name for name, _ in await manager.store.inputs(job.id)],
        "created": when(job.created), "started": when(job.started), "ended": when(job.ended),
        "media_type": job.media_type, "size": job.size, "error": error,
        "result": f"/v1/jobs/{job.id}/result" if job.result else None,
    }  # fmt: skip
