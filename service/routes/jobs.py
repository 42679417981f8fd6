"""Jobs: `/v1/jobs`, and `POST` and `DELETE` of fitted models."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Annotated, Any, TypeVar
from urllib.parse import quote

import orjson
from fastapi import APIRouter, Header, Path, Query, Request
from pydantic import BaseModel, ValidationError
from starlette.responses import FileResponse, Response

from service.errors import Problem, at_most, documented, invalid, told
from service.formats import FILES, FILMS, HTML, JSON, REPORTS
from service.jobs.manager import JobManager
from service.jobs.store import WAITING, Job
from service.jobs.uploads import CAPTURE, Received, Upload, as_fields, received, safe_name
from service.responses.caching import etag_matches
from service.responses.ranges import keep_one_range
from service.schemas import jobs as schemas

router = APIRouter(prefix="/v1", tags=["jobs"])
_POLL = 0.1  # [s] between checks of a job for which a client waits
_FRESH = {"Cache-Control": "no-store"}
_UPLOAD_ERRORS = (400, 401, 413, 415, 422, 429, 503, 504, 507)
#: Headers of pages that browsers show: they hold names from uploaded files, and get no access to the API.
_SANDBOX = {
    "Content-Security-Policy": "sandbox allow-downloads; default-src 'none'; style-src 'unsafe-inline'; img-src data:"
}
Fields = TypeVar("Fields", bound=BaseModel)
Id = Annotated[str, Path(min_length=1, max_length=64, description="Id of the job.")]
Name = Annotated[str, Path(pattern=r"^[a-z0-9][a-z0-9-]{0,62}$", examples=["my-walk"])]
Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key", min_length=1, max_length=255,
        description="A request repeated with the same key returns the same job.",
    ),
]  # fmt: skip
_ACCEPTED: dict[int | str, dict[str, Any]] = {202: {
    "model": schemas.JobStatus, "description": "The job is queued.",
    "headers": {"Location": {"description": "Path of the job.", "schema": {"type": "string"}}},
}}  # fmt: skip


def _takes_files(path: str, summary: str, fields: type[BaseModel], *, few=False, also=(), **options: Any) -> Callable:
    """Decorator of a route that queues a job for uploaded files: with `few` for one capture; `also`: more refusals."""
    return router.post(
        path, status_code=202, summary=summary, responses={**_ACCEPTED, **documented(*also, *_UPLOAD_ERRORS)},
        openapi_extra=as_fields(fields.model_json_schema(), few=few), **options,
    )  # fmt: skip


@_takes_files("/models", "Fit a model to uploaded capture", schemas.FitFields, also=(409,), tags=["models"])
async def fit_model(request: Request, key: Key = None) -> Response:
    """Fit a model to motion capture. The result of the job lists the files that were used and left out."""
    async with _uploaded(request, schemas.FitFields) as (manager, asked, files, _):
        about = {"media_type": JSON, "filename": f"{asked.name}.json", "model": f"fitted/{asked.name}"}
        return _accepted(manager, manager.add("fit", asked.model_dump(), files, key=key, **about))


@router.delete(
    "/models/fitted/{name}", status_code=204, summary="Remove a fitted model", tags=["models"],
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def remove_model(request: Request, name: Name) -> Response:
    """Remove a fitted model; shipped models can't be removed."""
    _manager(request).remove_model(f"fitted/{name}")
    return Response(status_code=204)


@_takes_files("/jobs/inspect", "Inspect capture files", schemas.ReadFields)
async def inspect_captures(request: Request, key: Key = None) -> Response:
    """Find markers or joints, the moving body and the gait cycles of a walk; the result is an `Inspection`."""
    async with _uploaded(request, schemas.ReadFields) as (manager, asked, files, _):
        about = {"media_type": JSON, "filename": "inspection.json"}
        return _accepted(manager, manager.add("inspect", asked.model_dump(), files, key=key, **about))


@_takes_files("/jobs/points", "List the points of a capture file", schemas.ReadFields, few=True)
async def list_points(request: Request, key: Key = None) -> Response:
    """List the points of a file, where they are, and which landmarks they may be; the result is `CapturePoints`."""
    async with _uploaded(request, schemas.ReadFields, most=1) as (manager, asked, files, _):
        about = {"media_type": JSON, "filename": "points.json"}
        return _accepted(manager, manager.add("points", asked.model_dump(), files, key=key, **about))


@_takes_files("/jobs/report", "Report on the gait in capture files", schemas.ReportFields)
async def report_gait(request: Request, key: Key = None) -> Response:
    """Step parameters and joint angles over the gait cycle, as a self-contained page, JSON or CSV."""
    async with _uploaded(request, schemas.ReportFields) as (manager, asked, files, names):
        suffix = REPORTS[asked.format]
        settings = asked.model_dump() | {"static": _static(asked, names), "suffix": suffix}
        about = {"media_type": asked.format, "filename": f"report{suffix}"}
        return _accepted(manager, manager.add("report", settings, files, key=key, **about))


@_takes_files("/jobs/convert", "Convert a capture file", schemas.ConvertFields, few=True)
async def convert_capture(request: Request, key: Key = None) -> Response:
    """Retarget motion capture to the body with 25 degrees of freedom and write it in another format."""
    async with _uploaded(request, schemas.ConvertFields, most=1) as (manager, asked, files, names):
        suffix = FILES.get(asked.format, ".json")
        about = {"media_type": asked.format, "filename": names[0].rpartition(".")[0] + suffix}
        return _accepted(
            manager, manager.add("convert", asked.model_dump() | {"suffix": suffix}, files, key=key, **about)
        )


@router.post(
    "/jobs/render", status_code=202, summary="Render a long walk",
    responses={**_ACCEPTED, **documented(400, 401, 404, 413, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def render_walk(request: Request, asked: schemas.RenderRequest, key: Key = None) -> Response:
    """Render a video that takes longer than a request may. Without a seed each job draws one."""
    manager, limits = _manager(request), request.app.state.service.settings
    manager.check_open()
    if asked.model not in manager.model_registry.names():
        raise manager.model_registry.missing(asked.model)
    at_most(asked.frames, limits.max_frames, "/seconds", "seconds · fps", "frames", each=asked.fps)
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, limits.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    suffix = FILMS[asked.format]
    settings = {"request": asked.model_dump(exclude={"format"}), "suffix": suffix}
    job = manager.add("render", settings, [], media_type=asked.format, filename=f"walk{suffix}", key=key)
    return _accepted(manager, job)


@router.get(
    "/jobs", summary="List jobs", response_model=schemas.JobPage, responses=documented(401, 422, 429, 503, 504),
)  # fmt: skip
async def list_jobs(
    request: Request,
    limit: Annotated[int, Query(ge=1, le=500, description="Maximum number of jobs.")] = 50,
    status: Annotated[schemas.Status | None, Query(description="Only jobs with this status.")] = None,
    before: Annotated[str | None, Query(max_length=64, description="Only jobs older than this one, an id.")] = None,
) -> Response:
    """The jobs of all clients, newest first: every key gives access to all jobs."""
    manager = _manager(request)
    found = manager.store.page(limit + 1, status, before)
    following = found[limit - 1].id if len(found) > limit else None
    body = {"jobs": [_to_response(manager, job) for job in found[:limit]], "next": following}
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
    manager, until = _manager(request), time.monotonic() + wait
    found = first = manager.get(job)
    going = lambda: found == first and found.status in WAITING and "closing" not in request.scope
    while going() and time.monotonic() < until:
        await asyncio.sleep(_POLL)
        found = manager.get(job)
    return _state(manager, found)


@router.get(
    "/jobs/{job}/result", summary="Result of a job",
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
    found = manager.get(job)
    path, tag = manager.result(found), f'"{found.result}"'
    shown, policy = ("inline", _SANDBOX) if found.media_type == HTML else ("attachment", {})
    headers = {
        "ETag": tag, "Cache-Control": "private, max-age=86400, immutable", "X-Content-Type-Options": "nosniff",
        "Content-Disposition": _disposition(shown, found.filename), **policy,
    }  # fmt: skip
    if etag_matches(request, tag):
        return Response(status_code=304, headers={"ETag": tag})
    try:
        size = path.stat()
    except FileNotFoundError:
        raise Problem(404, "the job was removed") from None
    keep_one_range(request, size.st_size)
    return FileResponse(path, media_type=found.media_type, headers=headers, stat_result=size)


@router.post(
    "/jobs/{job}/cancel", summary="Cancel a job", response_model=schemas.JobStatus,
    responses=documented(401, 404, 409, 422, 429, 503, 504, 507),
)  # fmt: skip
async def cancel_job(request: Request, job: Id) -> Response:
    """Cancel a queued or running job and keep its state. Cancelling it again is not an error."""
    manager = _manager(request)
    manager.cancel(manager.get(job))
    found = manager.get(job)
    if found.status != "cancelled":
        raise Problem(409, f"the job is {found.status} and can't be cancelled; DELETE removes it")
    return _state(manager, found)


@router.delete(
    "/jobs/{job}", summary="Cancel or remove a job", response_model=schemas.JobStatus,
    responses={204: {"description": "The job had ended and was removed with its files."},
               **documented(401, 404, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def remove_job(request: Request, job: Id) -> Response:
    """Cancel a queued or running job; remove an ended one with its result. A fitted model stays."""
    manager = _manager(request)
    found = manager.get(job)
    if found.status in WAITING:
        manager.cancel(found)
        return _state(manager, manager.get(job))
    manager.remove(found)
    return Response(status_code=204)


def _manager(request: Request) -> JobManager:
    return request.app.state.service.jobs


@asynccontextmanager
async def _uploaded(
    request: Request, fields: type[Fields], most: int | None = None
) -> AsyncIterator[tuple[JobManager, Fields, list[Received], list[str]]]:
    """The manager, and a request's upload on disk: its fields, its files, and the names of those that hold motion."""
    manager = _manager(request)
    manager.check_open()
    async with received(request, manager.file_store) as upload:
        yield manager, _fields(fields, upload), upload.files, _check_files(upload, most)


def _fields(model: type[Fields], upload: Upload) -> Fields:
    try:
        return model.model_validate(upload.fields)
    except ValidationError as error:
        raise invalid(error, model) from None


def _check_files(upload: Upload, most: int | None = None) -> list[str]:
    """Names of the files that contain motion."""
    names = [file.name for file in upload.files if file.name.endswith(CAPTURE)]
    if not names:
        raise Problem(422, f"upload a file called *{', *'.join(CAPTURE)} in the field 'files'", field="/files",
                      bound={"min_length": 1})  # fmt: skip
    if most is not None and len(names) > most:
        raise Problem(422, f"at most {most} capture file, got {len(names)}", field="/files", bound={"max_length": most})
    return names


def _static(asked: schemas.ReportFields, names: list[str]) -> str | None:
    """Name under which the static trial was stored."""
    if asked.static is None:
        return None
    try:
        static = safe_name(asked.static)
    except Problem:  # a suffix that no uploaded file can have
        static = ""
    if static not in names or len(names) == 1:
        problem = "must be the name of one of several uploaded capture files"
        raise Problem(422, f"static {problem}", field="/static", bound={"expected": ", ".join(names)})
    return static


def _accepted(manager: JobManager, job: Job) -> Response:
    return _state(manager, job, 202, Location=f"/v1/jobs/{job.id}")


def _state(manager: JobManager, job: Job, status: int = 200, **headers: str) -> Response:
    body = orjson.dumps(_to_response(manager, job))
    return Response(body, status, headers={**headers, **_FRESH}, media_type=JSON)


def _to_response(manager: JobManager, job: Job) -> dict[str, Any]:
    """`JobStatus` of a job."""
    error = job.error and told(job.error["status"], job.error["detail"])
    when = lambda time: time and datetime.fromtimestamp(time, UTC)
    return {
        "id": job.id, "kind": job.kind, "status": job.status, "progress": job.progress, "message": job.message,
        "model": job.model, "files": [name for name, _ in manager.store.inputs(job.id)],
        "created": when(job.created), "started": when(job.started), "ended": when(job.ended),
        "media_type": job.media_type, "size": job.size, "error": error,
        "result": f"/v1/jobs/{job.id}/result" if job.result else None,
    }  # fmt: skip


def _disposition(kind: str, name: str) -> str:
    """Content-Disposition of a file to be shown or saved as `name`, in any alphabet (RFC 6266, section 4.3)."""
    plain = "".join(c if c.isascii() else "-" for c in name)
    return f'{kind}; filename="{plain}"' + ("" if name.isascii() else f"; filename*=UTF-8''{quote(name)}")
