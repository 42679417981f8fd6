"""Jobs on uploaded files: what is in captures, models fitted to them, and models from elsewhere."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from fastapi import APIRouter, Request
from pydantic import BaseModel, ValidationError
from starlette.responses import Response

from service.errors import Problem, documented, invalid
from service.formats import FILES, JSON, REPORTS
from service.jobs.uploads import CAPTURE, Received, Upload, as_fields, received, safe_name
from service.routes.jobs import ACCEPTED, Key, queued
from service.schemas import jobs as schemas

router = APIRouter(prefix="/v1", tags=["jobs"])
_UPLOAD_ERRORS = (400, 401, 413, 415, 422, 429, 503, 504, 507)
Fields = TypeVar("Fields", bound=BaseModel)


def _takes_files(path: str, summary: str, fields: type[BaseModel], *, few=False, also=(), **options: Any) -> Callable:
    """Decorator of a route that queues a job for uploaded files: with `few` for one capture; `also`: more refusals."""
    return router.post(
        path, status_code=202, summary=summary, responses={**ACCEPTED, **documented(*also, *_UPLOAD_ERRORS)},
        openapi_extra=as_fields(fields.model_json_schema(), few=few), **options,
    )  # fmt: skip


@_takes_files("/models", "Fit a model to uploaded capture", schemas.FitFields, also=(409,), tags=["models"])
async def fit_model(request: Request, key: Key = None) -> Response:
    """Fit a model to motion capture. The result of the job lists the files that were used and left out."""
    async with _uploaded(request, schemas.FitFields, "fit") as (asked, files, _):
        about = {"media_type": JSON, "filename": f"{asked.name}.json", "model": f"fitted/{asked.name}"}
        return await queued(request, "fit", asked.model_dump(), files, key=key, **about)


@_takes_files("/models/files", "Add a model from a file", schemas.ModelFields, few=True, also=(409,), tags=["models"])
async def upload_model(request: Request, key: Key = None) -> Response:
    """Take a model's file (.npz), as `GET /v1/models/fitted/{name}/file` or `motionenv fit` makes it.

    With `replace`, it takes the place of a model of that name at once: what has begun goes on with the old one.
    """
    async with _uploaded(request, schemas.ModelFields, "import", most=1) as (asked, files, _):
        about = {"media_type": JSON, "filename": f"{asked.name}.json", "model": f"fitted/{asked.name}"}
        return await queued(request, "import", asked.model_dump(), files, key=key, **about)


@_takes_files("/jobs/inspect", "Inspect capture files", schemas.ReadFields)
async def inspect_captures(request: Request, key: Key = None) -> Response:
    """Find markers or joints, the moving body and the gait cycles of a walk; the result is an `Inspection`."""
    async with _uploaded(request, schemas.ReadFields, "inspect") as (asked, files, _):
        about = {"media_type": JSON, "filename": "inspection.json"}
        return await queued(request, "inspect", asked.model_dump(), files, key=key, **about)


@_takes_files("/jobs/points", "List the points of a capture file", schemas.ReadFields, few=True)
async def list_points(request: Request, key: Key = None) -> Response:
    """List the points of a file, where they are, and which landmarks they may be; the result is `CapturePoints`."""
    async with _uploaded(request, schemas.ReadFields, "points", most=1) as (asked, files, _):
        about = {"media_type": JSON, "filename": "points.json"}
        return await queued(request, "points", asked.model_dump(), files, key=key, **about)


@_takes_files("/jobs/report", "Report on the gait in capture files", schemas.ReportFields)
async def report_gait(request: Request, key: Key = None) -> Response:
    """Step parameters and joint angles over the gait cycle, as a self-contained page, JSON or CSV."""
    async with _uploaded(request, schemas.ReportFields, "report") as (asked, files, names):
        suffix = REPORTS[asked.format]
        settings = asked.model_dump() | {"static": _static(asked, names), "suffix": suffix}
        about = {"media_type": asked.format, "filename": f"report{suffix}"}
        return await queued(request, "report", settings, files, key=key, **about)


@_takes_files("/jobs/convert", "Convert a capture file", schemas.ConvertFields, few=True)
async def convert_capture(request: Request, key: Key = None) -> Response:
    """Retarget motion capture to the body with 25 degrees of freedom and write it in another format."""
    async with _uploaded(request, schemas.ConvertFields, "convert", most=1) as (asked, files, names):
        suffix = FILES.get(asked.format, ".json")
        about = {"media_type": asked.format, "filename": names[0].rpartition(".")[0] + suffix}
        return await queued(request, "convert", asked.model_dump() | {"suffix": suffix}, files, key=key, **about)


@asynccontextmanager
async def _uploaded(
    request: Request, fields: type[Fields], kind: str, most: int | None = None
) -> AsyncIterator[tuple[Fields, list[Received], list[str]]]:
    """An upload on disk, for a job of a kind: its fields, its files, and the names of those that hold motion."""
    manager = request.app.state.service.jobs
    await manager.check_open(kind)
    async with received(request, manager.file_store) as upload:
        yield _fields(fields, upload), upload.files, _check_files(upload, most)


def _fields(model: type[Fields], upload: Upload) -> Fields:
    try:
        return model.model_validate(upload.fields)
    except ValidationError as error:
        raise invalid(error, model) from None


def _check_files(upload: Upload, most: int | None = None) -> list[str]:
    names = [file.name for file in upload.files if file.name.endswith(CAPTURE)]
    if not names:
        raise Problem(422, f"upload a file called *{', *'.join(CAPTURE)} in the field 'files'", field="/files",
                      bound={"min_length": 1})  # fmt: skip
    if most is not None and len(names) > most:
        raise Problem(422, f"at most {most} capture file, got {len(names)}", field="/files", bound={"max_length": most})
    return names


def _static(asked: schemas.ReportFields, names: list[str]) -> str | None:
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
