"""Jobs: `/v1/jobs`, and `POST` and `DELETE` of fitted models."""

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from http import HTTPStatus
from typing import IO, Annotated, Any, TypeVar
from urllib.parse import quote

import orjson
from fastapi import APIRouter, Header, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from starlette.responses import Response, StreamingResponse

from service.errors import Problem, at_most, documented
from service.formats import FILES, FILMS, HTML, JSON, REPORTS
from service.jobs.manager import JobManager, no_room
from service.jobs.store import WAITING, Full, Job
from service.jobs.uploads import CAPTURE, Upload, as_fields, received, safe_name
from service.schemas.jobs import (
    CapturePoints,
    ConvertFields,
    FitFields,
    Fitted,
    Inspection,
    JobPage,
    JobStatus,
    ReadFields,
    RenderRequest,
    ReportFields,
    Status,
)  # fmt: skip

router = APIRouter(prefix="/v1", tags=["jobs"])
_POLL = 0.1  # [s] between checks of a job for which a client waits
_CHUNK = 1 << 18
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
    "model": JobStatus, "description": "The job is queued.",
    "headers": {"Location": {"description": "Path of the job.", "schema": {"type": "string"}}},
}}  # fmt: skip


@router.post(
    "/models", status_code=202, summary="Fit a model to uploaded capture", tags=["models"],
    responses={**_ACCEPTED, **documented(409, *_UPLOAD_ERRORS)},
    openapi_extra=as_fields(FitFields.model_json_schema(), few=False),
)  # fmt: skip
async def fit(request: Request, key: Key = None) -> Response:
    """Fit a model to motion capture. The result of the job lists the files that were used and left out."""
    manager = _manager(request)
    async with _uploaded(request, manager) as upload:
        asked = _fields(FitFields, upload)
        _check_files(upload)
        job = manager.add(
            "fit", asked.model_dump(), upload.files, media_type=JSON, filename=f"{asked.name}.json",
            model=f"fitted/{asked.name}", key=key,
        )  # fmt: skip
    return _accepted(manager, job)


@router.delete(
    "/models/fitted/{name}", status_code=204, summary="Remove a fitted model", tags=["models"],
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def remove_model(request: Request, name: Name) -> Response:
    """Remove a fitted model; shipped models can't be removed."""
    _manager(request).remove_model(f"fitted/{name}")
    return Response(status_code=204)


@router.post(
    "/jobs/inspect", status_code=202, summary="Inspect capture files",
    responses={**_ACCEPTED, **documented(*_UPLOAD_ERRORS)},
    openapi_extra=as_fields(ReadFields.model_json_schema(), few=False),
)  # fmt: skip
async def inspect(request: Request, key: Key = None) -> Response:
    """Find markers or joints, the moving body and the gait cycles of a walk; the result is an `Inspection`."""
    manager = _manager(request)
    async with _uploaded(request, manager) as upload:
        asked = _fields(ReadFields, upload)
        _check_files(upload)
        job = manager.add(
            "inspect", asked.model_dump(), upload.files, media_type=JSON, filename="inspection.json", key=key
        )
    return _accepted(manager, job)


@router.post(
    "/jobs/points", status_code=202, summary="List the points of a capture file",
    responses={**_ACCEPTED, **documented(*_UPLOAD_ERRORS)},
    openapi_extra=as_fields(ReadFields.model_json_schema(), few=True),
)  # fmt: skip
async def points(request: Request, key: Key = None) -> Response:
    """List the points of a file, where they are, and which landmarks they may be; the result is `CapturePoints`."""
    manager = _manager(request)
    async with _uploaded(request, manager) as upload:
        asked = _fields(ReadFields, upload)
        _check_files(upload, most=1)
        job = manager.add("points", asked.model_dump(), upload.files, media_type=JSON, filename="points.json", key=key)
    return _accepted(manager, job)


@router.post(
    "/jobs/report", status_code=202, summary="Report on the gait in capture files",
    responses={**_ACCEPTED, **documented(*_UPLOAD_ERRORS)},
    openapi_extra=as_fields(ReportFields.model_json_schema(), few=False),
)  # fmt: skip
async def report(request: Request, key: Key = None) -> Response:
    """Step parameters and joint angles over the gait cycle, as a self-contained page, JSON or CSV."""
    manager = _manager(request)
    async with _uploaded(request, manager) as upload:
        asked = _fields(ReportFields, upload)
        static = _static(asked, _check_files(upload))
        suffix = REPORTS[asked.format]
        settings = asked.model_dump() | {"static": static, "suffix": suffix}
        job = manager.add(
            "report", settings, upload.files, media_type=asked.format, filename=f"report{suffix}", key=key
        )
    return _accepted(manager, job)


@router.post(
    "/jobs/convert", status_code=202, summary="Convert a capture file",
    responses={**_ACCEPTED, **documented(*_UPLOAD_ERRORS)},
    openapi_extra=as_fields(ConvertFields.model_json_schema(), few=True),
)  # fmt: skip
async def convert(request: Request, key: Key = None) -> Response:
    """Retarget motion capture to the body with 25 degrees of freedom and write it in another format."""
    manager = _manager(request)
    async with _uploaded(request, manager) as upload:
        asked = _fields(ConvertFields, upload)
        name = _check_files(upload, most=1)[0].rpartition(".")[0]
        suffix = FILES.get(asked.format, ".json")
        settings = asked.model_dump() | {"suffix": suffix}
        job = manager.add(
            "convert", settings, upload.files, media_type=asked.format, filename=f"{name}{suffix}", key=key
        )
    return _accepted(manager, job)


@router.post(
    "/jobs/render", status_code=202, summary="Render a long walk",
    responses={**_ACCEPTED, **documented(400, 401, 404, 413, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def render(request: Request, asked: RenderRequest, key: Key = None) -> Response:
    """Render a video that takes longer than a request may. Without a seed each job draws one."""
    manager, limits = _manager(request), request.app.state.service.settings
    manager.check_open()
    if asked.model not in manager.model_registry.names():
        raise Problem(404, f"there is no model {asked.model!r}: GET /v1/models lists them", field="/model")
    at_most(asked.frames, limits.max_frames, "/seconds", "seconds · fps", "frames", each=asked.fps)
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, limits.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    suffix = FILMS[asked.format]
    settings = {"request": asked.model_dump(exclude={"format"}), "suffix": suffix}
    job = manager.add("render", settings, [], media_type=asked.format, filename=f"walk{suffix}", key=key)
    return _accepted(manager, job)


@router.get(
    "/jobs", summary="List jobs", response_model=JobPage, responses=documented(401, 422, 429, 503, 504),
)  # fmt: skip
async def list_jobs(
    request: Request,
    limit: Annotated[int, Query(ge=1, le=500, description="Maximum number of jobs.")] = 50,
    status: Annotated[Status | None, Query(description="Only jobs with this status.")] = None,
    before: Annotated[
        str | None, Query(max_length=64, description="Only jobs older than the one with this id.")
    ] = None,
) -> Response:
    """The jobs of all clients, newest first: every key gives access to all jobs."""
    manager = _manager(request)
    found = manager.store.page(limit + 1, status, before)
    following = found[limit - 1].id if len(found) > limit else None
    body = {"jobs": [_to_response(manager, job) for job in found[:limit]], "next": following}
    return Response(orjson.dumps(body), media_type=JSON, headers=_FRESH)


@router.get(
    "/jobs/{job}", summary="State of a job", response_model=JobStatus,
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def get_job(
    request: Request,
    job: Id,
    wait: Annotated[
        float, Query(ge=0, le=30, description="Seconds to hold the response back until the state changes.")
    ] = 0.0,
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
            "model": Fitted | Inspection | CapturePoints,
            "description": "`Fitted` for fit, `Inspection` for inspect, `CapturePoints` for points, a file for the "
            "others.",
            "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in [*FILES, *FILMS, HTML]},
        },
        304: {"description": "The result has not changed (`If-None-Match`)."},
        **documented(401, 404, 409, 422, 429, 503, 504),
    },
)  # fmt: skip
async def result(request: Request, job: Id) -> Response:
    """The result of a job that is done."""
    manager = _manager(request)
    found = manager.get(job)
    path, tag = manager.result(found), f'"{found.result}"'
    shown, policy = ("inline", _SANDBOX) if found.media_type == HTML else ("attachment", {})
    headers = {
        "ETag": tag, "Cache-Control": "private, max-age=86400, immutable", "X-Content-Type-Options": "nosniff",
        "Content-Disposition": _disposition(shown, found.filename), "Content-Length": str(found.size), **policy,
    }  # fmt: skip
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers={"ETag": tag})
    try:
        file = path.open("rb")
    except FileNotFoundError:
        raise Problem(404, "the job was removed") from None
    return StreamingResponse(_chunks(file), media_type=found.media_type, headers=headers)


@router.post(
    "/jobs/{job}/cancel", summary="Cancel a job", response_model=JobStatus,
    responses=documented(401, 404, 409, 422, 429, 503, 504, 507),
)  # fmt: skip
async def cancel(request: Request, job: Id) -> Response:
    """Cancel a queued or running job and keep its state. Cancelling it again is not an error."""
    manager = _manager(request)
    try:
        manager.cancel(manager.get(job))
    except Full:
        raise no_room() from None
    found = manager.get(job)
    if found.status != "cancelled":
        raise Problem(409, f"the job is {found.status} and can't be cancelled; DELETE removes it")
    return _state(manager, found)


@router.delete(
    "/jobs/{job}", summary="Cancel or remove a job", response_model=JobStatus,
    responses={204: {"description": "The job had ended and was removed with its files."},
               **documented(401, 404, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def remove(request: Request, job: Id) -> Response:
    """Cancel a queued or running job; remove an ended one with its result. A fitted model stays."""
    manager = _manager(request)
    found = manager.get(job)
    try:
        if found.status in WAITING:
            manager.cancel(found)
            return _state(manager, manager.get(job))
        manager.remove(found)
    except Full:
        raise no_room() from None
    return Response(status_code=204)


def _manager(request: Request) -> JobManager:
    return request.app.state.service.jobs


@asynccontextmanager
async def _uploaded(request: Request, manager: JobManager) -> AsyncIterator[Upload]:
    """The upload of a request, on disk."""
    manager.check_open()
    try:
        async with received(request, manager.file_store) as upload:
            yield upload
    except Full:
        raise no_room() from None


def _fields(model: type[Fields], upload: Upload) -> Fields:
    """The fields of an upload."""
    try:
        return model.model_validate(upload.fields)
    except ValidationError as error:
        raise RequestValidationError([{**e, "loc": ("body", *e["loc"])} for e in error.errors()]) from None


def _check_files(upload: Upload, most: int | None = None) -> list[str]:
    """Names of the files that contain motion."""
    names = [file.name for file in upload.files if file.name.endswith(CAPTURE)]
    if not names:
        raise Problem(422, f"upload a file called *{', *'.join(CAPTURE)} in the field 'files'", field="/files",
                      bound={"min_length": 1})  # fmt: skip
    if most is not None and len(names) > most:
        raise Problem(422, f"at most {most} capture file, got {len(names)}", field="/files", bound={"max_length": most})
    return names


def _static(asked: ReportFields, names: list[str]) -> str | None:
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
    """202 with the location of the job."""
    return _state(manager, job, 202, Location=f"/v1/jobs/{job.id}")


def _state(manager: JobManager, job: Job, status: int = 200, **headers: str) -> Response:
    """`JobStatus` of a job as JSON."""
    body = orjson.dumps(_to_response(manager, job))
    return Response(body, status, headers={**headers, **_FRESH}, media_type=JSON)


def _to_response(manager: JobManager, job: Job) -> dict[str, Any]:
    """`JobStatus` of a job."""
    error = job.error and {
        "type": "about:blank", "title": HTTPStatus(job.error["status"]).phrase, "request_id": None, "errors": [],
        **job.error,
    }  # fmt: skip
    when = lambda time: time and datetime.fromtimestamp(time, UTC)
    return {
        "id": job.id, "kind": job.kind, "status": job.status, "progress": job.progress, "message": job.message,
        "model": job.model, "files": [name for name, _ in manager.store.inputs(job.id)],
        "created": when(job.created), "started": when(job.started), "ended": when(job.ended),
        "media_type": job.media_type, "size": job.size, "error": error,
        "result": f"/v1/jobs/{job.id}/result" if job.result else None,
    }  # fmt: skip


def _chunks(file: IO[bytes]) -> Iterator[bytes]:
    """A file in chunks; closes it."""
    with file:
        while chunk := file.read(_CHUNK):
            yield chunk


def _disposition(kind: str, name: str) -> str:
    """Content-Disposition of a file to be shown or saved as `name`, in any alphabet (RFC 6266, section 4.3)."""
    plain = "".join(c if c.isascii() else "-" for c in name)
    return f'{kind}; filename="{plain}"' + ("" if name.isascii() else f"; filename*=UTF-8''{quote(name)}")
