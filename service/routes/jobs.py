"""Jobs: `/v1/jobs`, and `POST` and `DELETE` of fitted models."""

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from http import HTTPStatus
from typing import IO, Annotated, Any, TypeVar

import orjson
from fastapi import APIRouter, Header, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from starlette.responses import Response, StreamingResponse

from service.formats import FILES, FILMS, JSON
from service.jobs.desk import Desk, no_room
from service.jobs.store import WAITING, Full, Job
from service.jobs.uploads import CAPTURE, Upload, as_fields, received
from service.problems import Problem, at_most, documented
from service.schemas.jobs import (
    ConvertFields,
    FitFields,
    Fitted,
    Inspection,
    JobPage,
    JobStatus,
    ReadFields,
    RenderRequest,
    Status,
)  # fmt: skip

router = APIRouter(prefix="/v1", tags=["jobs"])
_STEP = 0.1  # [s] between looks while a client waits
_CHUNK = 1 << 18
_FRESH = {"Cache-Control": "no-store"}
_HANDED_IN = (400, 401, 413, 415, 422, 429, 503, 504, 507)
Fields = TypeVar("Fields", bound=BaseModel)
Id = Annotated[str, Path(min_length=1, max_length=64, description="Id of the job.")]
Name = Annotated[str, Path(pattern=r"^[a-z0-9][a-z0-9-]{0,62}$", examples=["my-walk"])]
Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key", min_length=1, max_length=255,
        description="The same key with the same request gives the same job again.",
    ),
]  # fmt: skip
_ACCEPTED: dict[int | str, dict[str, Any]] = {202: {
    "model": JobStatus, "description": "The job waits.",
    "headers": {"Location": {"description": "Of the job.", "schema": {"type": "string"}}},
}}  # fmt: skip


@router.post(
    "/models", status_code=202, summary="Fit a model to uploaded capture", tags=["models"],
    responses={**_ACCEPTED, **documented(409, *_HANDED_IN)},
    openapi_extra=as_fields(FitFields.model_json_schema(), few=False),
)  # fmt: skip
async def fit(request: Request, key: Key = None) -> Response:
    """Learn from motion capture. The job's result says which files the model learned from."""
    desk = _desk(request)
    async with _handed_in(request, desk) as upload:
        asked = _fields(FitFields, upload)
        _check_files(upload)
        job = desk.add(
            "fit", asked.model_dump(), upload.files, media_type=JSON, filename=f"{asked.name}.json",
            model=f"fitted/{asked.name}", key=key,
        )  # fmt: skip
    return _accepted(desk, job)


@router.delete(
    "/models/fitted/{name}", status_code=204, summary="Remove a fitted model", tags=["models"],
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def remove_model(request: Request, name: Name) -> Response:
    """Remove a model that a job has fitted; those that ship stay."""
    _desk(request).remove_model(f"fitted/{name}")
    return Response(status_code=204)


@router.post(
    "/jobs/inspect", status_code=202, summary="Look into capture files",
    responses={**_ACCEPTED, **documented(*_HANDED_IN)},
    openapi_extra=as_fields(ReadFields.model_json_schema(), few=False),
)  # fmt: skip
async def inspect(request: Request, key: Key = None) -> Response:
    """Find what is in motion capture: markers or joints, the body that moves, the cycles of a walk (`Inspection`)."""
    desk = _desk(request)
    async with _handed_in(request, desk) as upload:
        asked = _fields(ReadFields, upload)
        _check_files(upload)
        job = desk.add(
            "inspect", asked.model_dump(), upload.files, media_type=JSON, filename="inspection.json", key=key
        )
    return _accepted(desk, job)


@router.post(
    "/jobs/convert", status_code=202, summary="Convert a capture file",
    responses={**_ACCEPTED, **documented(*_HANDED_IN)},
    openapi_extra=as_fields(ConvertFields.model_json_schema(), few=True),
)  # fmt: skip
async def convert(request: Request, key: Key = None) -> Response:
    """Retarget motion capture to the body with 25 degrees of freedom, and write it in another format."""
    desk = _desk(request)
    async with _handed_in(request, desk) as upload:
        asked = _fields(ConvertFields, upload)
        name = _check_files(upload, most=1)[0].rpartition(".")[0]
        suffix = FILES.get(asked.format, ".json")
        settings = asked.model_dump() | {"suffix": suffix}
        job = desk.add("convert", settings, upload.files, media_type=asked.format, filename=f"{name}{suffix}", key=key)
    return _accepted(desk, job)


@router.post(
    "/jobs/render", status_code=202, summary="Render a long walk",
    responses={**_ACCEPTED, **documented(400, 401, 404, 413, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def render(request: Request, asked: RenderRequest, key: Key = None) -> Response:
    """Make a video that is too long to wait for. Without a seed each job draws one."""
    desk, limits = _desk(request), request.app.state.service.settings
    desk.check_open()
    if asked.model not in desk.catalogue.names():
        raise Problem(404, f"there is no model {asked.model!r}: GET /v1/models lists them", field="/model")
    at_most(asked.frames, limits.max_frames, "/seconds", "seconds · fps", "frames", each=asked.fps)
    shown = asked.picture
    pixels = shown.width * shown.height
    at_most(pixels, limits.max_pixels, "/picture/width", "width · height", "pixels", each=shown.height)
    suffix = FILMS[asked.format]
    settings = {"request": asked.model_dump(exclude={"format"}), "suffix": suffix}
    job = desk.add("render", settings, [], media_type=asked.format, filename=f"walk{suffix}", key=key)
    return _accepted(desk, job)


@router.get(
    "/jobs", summary="Jobs", response_model=JobPage, responses=documented(401, 422, 429, 503, 504),
)  # fmt: skip
async def list_jobs(
    request: Request,
    limit: Annotated[int, Query(ge=1, le=500, description="Jobs on a page.")] = 50,
    status: Annotated[Status | None, Query(description="Only these.")] = None,
    before: Annotated[str | None, Query(max_length=64, description="Only jobs older than this one, by id.")] = None,
) -> Response:
    """Everybody's jobs, the newest first: whoever has a key sees all."""
    desk = _desk(request)
    found = desk.store.page(limit + 1, status, before)
    following = found[limit - 1].id if len(found) > limit else None
    body = {"jobs": [_told(desk, job) for job in found[:limit]], "next": following}
    return Response(orjson.dumps(body), media_type=JSON, headers=_FRESH)


@router.get(
    "/jobs/{job}", summary="Where a job is", response_model=JobStatus,
    responses=documented(401, 404, 422, 429, 503, 504),
)  # fmt: skip
async def get_job(
    request: Request,
    job: Id,
    wait: Annotated[
        float,
        Query(ge=0, le=30, description="Seconds to wait for a change of a job that goes on, instead of asking again."),
    ] = 0.0,
) -> Response:
    """Status and progress; with `wait`, as soon as either changes."""
    desk, until = _desk(request), time.monotonic() + wait
    found = first = desk.get(job)
    going = lambda: found == first and found.status in WAITING and "closing" not in request.scope
    while going() and time.monotonic() < until:
        await asyncio.sleep(_STEP)
        found = desk.get(job)
    return Response(orjson.dumps(_told(desk, found)), media_type=JSON, headers=_FRESH)


@router.get(
    "/jobs/{job}/result", summary="What a job made",
    responses={
        200: {
            "model": Fitted | Inspection,
            "description": "`Fitted` of fit, `Inspection` of inspect, the file of the others.",
            "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in [*FILES, *FILMS]},
        },
        304: {"description": "The result is that of `If-None-Match`."},
        **documented(401, 404, 409, 422, 429, 503, 504),
    },
)  # fmt: skip
async def result(request: Request, job: Id) -> Response:
    """The result's bytes, once the job is done."""
    desk = _desk(request)
    found = desk.get(job)
    path, tag = desk.result(found), f'"{found.result}"'
    headers = {
        "ETag": tag, "Cache-Control": "private, max-age=86400, immutable", "X-Content-Type-Options": "nosniff",
        "Content-Disposition": f'attachment; filename="{found.filename}"', "Content-Length": str(found.size),
    }  # fmt: skip
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers={"ETag": tag})
    try:
        file = path.open("rb")
    except FileNotFoundError:
        raise Problem(404, "the job has just been removed") from None
    return StreamingResponse(_chunks(file), media_type=found.media_type, headers=headers)


@router.post(
    "/jobs/{job}/cancel", summary="Cancel a job", response_model=JobStatus,
    responses=documented(401, 404, 409, 422, 429, 503, 504, 507),
)  # fmt: skip
async def cancel(request: Request, job: Id) -> Response:
    """Stop a job that waits or runs, and keep what is known of it. To cancel it again is no error."""
    desk = _desk(request)
    try:
        desk.cancel(desk.get(job))
    except Full:
        raise no_room() from None
    found = desk.get(job)
    if found.status != "cancelled":
        raise Problem(409, f"the job is {found.status}: there is nothing to cancel, DELETE removes it")
    return Response(orjson.dumps(_told(desk, found)), media_type=JSON, headers=_FRESH)


@router.delete(
    "/jobs/{job}", summary="Cancel or remove a job", response_model=JobStatus,
    responses={204: {"description": "The job had ended, and is removed with its files."},
               **documented(401, 404, 422, 429, 503, 504, 507)},
)  # fmt: skip
async def remove(request: Request, job: Id) -> Response:
    """Cancel a job that waits or runs; remove one that has ended, its result too (a fitted model stays)."""
    desk = _desk(request)
    found = desk.get(job)
    try:
        if found.status in WAITING:
            desk.cancel(found)
            return Response(orjson.dumps(_told(desk, desk.get(job))), media_type=JSON, headers=_FRESH)
        desk.remove(found)
    except Full:
        raise no_room() from None
    return Response(status_code=204)


def _desk(request: Request) -> Desk:
    return request.app.state.service.jobs


@asynccontextmanager
async def _handed_in(request: Request, desk: Desk) -> AsyncIterator[Upload]:
    """The upload of a request, on disk.

    Raises:
        Problem: 503 or 507 before it is read, or what is wrong with it.
    """
    desk.check_open()
    try:
        async with received(request, desk.blobs) as upload:
            yield upload
    except Full:
        raise no_room() from None


def _fields(model: type[Fields], upload: Upload) -> Fields:
    """The fields of an upload.

    Raises:
        RequestValidationError: they aren't right.
    """
    try:
        return model.model_validate(upload.fields)
    except ValidationError as error:
        raise RequestValidationError([{**e, "loc": ("body", *e["loc"])} for e in error.errors()]) from None


def _check_files(upload: Upload, most: int | None = None) -> list[str]:
    """Names of the files that hold motion.

    Raises:
        Problem: 422, there are none, or too many.
    """
    names = [file.name for file in upload.files if file.name.endswith(CAPTURE)]
    if not names:
        raise Problem(422, f"upload a file called *{', *'.join(CAPTURE)} in the field 'files'", field="/files",
                      bound={"min_length": 1})  # fmt: skip
    if most is not None and len(names) > most:
        raise Problem(422, "one capture file at a time", field="/files", bound={"max_length": most})
    return names


def _accepted(desk: Desk, job: Job) -> Response:
    """202, and where the job is."""
    headers = {"Location": f"/v1/jobs/{job.id}", **_FRESH}
    return Response(orjson.dumps(_told(desk, job)), 202, headers=headers, media_type=JSON)


def _told(desk: Desk, job: Job) -> dict[str, Any]:
    """`JobStatus` of a job."""
    error = job.error and {
        "type": "about:blank", "title": HTTPStatus(job.error["status"]).phrase, "request_id": None, "errors": [],
        **job.error,
    }  # fmt: skip
    when = lambda time: time and datetime.fromtimestamp(time, UTC)
    return {
        "id": job.id, "kind": job.kind, "status": job.status, "progress": job.progress, "message": job.message,
        "model": job.model, "files": [name for name, _ in desk.store.inputs(job.id)],
        "created": when(job.created), "started": when(job.started), "ended": when(job.ended),
        "media_type": job.media_type, "size": job.size, "error": error,
        "result": f"/v1/jobs/{job.id}/result" if job.result else None,
    }  # fmt: skip


def _chunks(file: IO[bytes]) -> Iterator[bytes]:
    """A file in pieces, closed at its end."""
    with file:
        while chunk := file.read(_CHUNK):
            yield chunk
