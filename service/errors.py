"""Errors as problem+json (RFC 9457), with the field, its bounds and what to do.

Values sent by the client are never echoed: they may contain secrets, or what JSON can't hold (NaN, lone surrogates).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from http import HTTPStatus
from typing import Any, get_args

import orjson
from pydantic import BaseModel, Field, ValidationError
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from motionenv import MotionError
from motionenv.models import did_you_mean
from service.jobs.store import Full

MEDIA_TYPE = "application/problem+json"
#: Kinds of problems by the last part of their `type`: status and title.
KINDS: dict[str, tuple[int, str]] = {
    "malformed-request": (400, "The request can't be read"), "wrong-host": (400, "This service has another name"),
    "no-key": (401, "This service needs an API key"),
    "unknown-key": (401, "The API key isn't known"), "cross-site": (403, "Pages of other sites may not do this"),
    "not-found": (404, "There is no such thing"), "method-not-allowed": (405, "The path takes other methods"),
    "format-not-offered": (406, "No format that is accepted is offered"),
    "conflict": (409, "The state of a job or model doesn't allow this"),
    "precondition-failed": (412, "The response is the one you have"), "too-large": (413, "The body is too large"),
    "wrong-media-type": (415, "The body is of another media type"),
    "range-not-satisfiable": (416, "There is no such part of the file"), "invalid-field": (422, "A field is invalid"),
    "rate-limited": (429, "Too many requests"), "internal-error": (500, "The service failed"),
    "busy": (503, "The service is busy or starting"),
    "timeout": (504, "It took too long"), "disk-full": (507, "The disk is full"),
}  # fmt: skip
_USUAL = {status: kind for kind, (status, _) in reversed(KINDS.items())}
_PAGE = """<!doctype html><html lang="en" style="color-scheme: light dark"><title>{0}</title>
<meta name="viewport" content="width=device-width"><body style="font: 1rem/1.5 system-ui; margin: 15vh auto;
max-width: 34rem; padding: 1rem"><h1>{0}</h1><p>{1}.</p><p><a href="/">Back to motionenv</a></p>"""
_PAGE_HEADERS = {"Vary": "Accept", "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'"}
#: The detail of a 507.
FULL = "the service's disk is full: remove jobs or models, or contact its operator"
_NO_JSON = "the body is not valid JSON"
#: Names of bounds in pydantic's errors that are passed on.
_BOUNDS = ("gt", "ge", "lt", "le", "multiple_of", "min_length", "max_length", "pattern", "expected")


class FieldProblem(BaseModel):
    """A problem with one field."""

    field: str = Field(description="JSON pointer into the body, or name of the parameter.", examples=["/fps"])
    problem: str = Field(description="What was expected.", examples=["Input should be less than or equal to 240"])
    bound: dict[str, Any] | None = Field(None, description="The bounds that were violated.", examples=[{"le": 240}])


class ProblemDetail(BaseModel):
    """An error response (RFC 9457)."""

    type: str = Field(
        description="What kind of problem it is: `/docs#` and " + ", ".join(KINDS) + ".",
        examples=["/docs#invalid-field"],
    )
    title: str = Field(description="The kind in words.", examples=["A field is invalid"])
    status: int = Field(ge=400, le=599, description="HTTP status.", examples=[422])
    detail: str = Field(description="What was wrong, and what to do.")
    request_id: str | None = Field(None, description="Id of the request in the logs.")
    errors: list[FieldProblem] = Field(default_factory=list, description="Each invalid field.")


class Problem(HTTPException):
    """An error response: what was wrong and what to do, with the JSON pointer and bounds of the invalid field."""

    def __init__(
        self, status: int, detail: str, *, field: str | None = None, bound: Mapping[str, Any] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        super().__init__(status, detail, dict(headers or {}))
        self.errors = [] if field is None else [{"field": field, "problem": detail, "bound": bound and dict(bound)}]


def busy(detail: str, seconds: int = 1) -> Problem:
    """503: the service is overloaded; the client may retry in `seconds`."""
    return Problem(503, f"{detail}; retry in {seconds} s", headers={"Retry-After": str(seconds)})


@contextmanager
def about(*fields: str) -> Iterator[None]:
    """Let errors of the library within the block that name no field be about these."""
    try:
        yield
    except MotionError as error:
        error.fields = error.fields or fields
        raise


def at_most(value: float, most: float, field: str, name: str, unit: str, *, each: float = 1) -> None:
    """Reject a value larger than this service or a format allows: 422 with the field, a JSON pointer, and its bound.

    That bound follows from `each`, the value per unit of the field.
    """
    if value > most:
        bound = {"le": most / each}
        raise Problem(422, f"{name} must be at most {most} {unit}, got {value:g}", field=field, bound=bound)


def told(
    status: int, detail: str, *, request_id: str | None = None, errors: Sequence = (), kind: str | None = None
) -> dict[str, Any]:
    """`ProblemDetail`; `errors` are of single fields, like `FieldProblem`; `kind` is by default the status's."""
    kind = kind or _USUAL.get(status)
    if kind is None:  # of a status that only Starlette gives
        about = {"type": "about:blank", "title": HTTPStatus(status).phrase}
    else:
        about = {"type": f"/docs#{kind}", "title": KINDS[kind][1]}
    return {
        **about, "status": status, "detail": detail.encode("utf-8", "replace").decode(), "request_id": request_id,
        "errors": list(errors),
    }  # fmt: skip


def problem_response(status: int, detail: str, *, headers: dict[str, str] | None = None, **more: Any) -> Response:
    """An error response; arguments as of `told`."""
    body = told(status, detail, **more)
    return Response(orjson.dumps(body), status, headers=headers, media_type=MEDIA_TYPE)


def documented(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI of error responses with these `statuses`; 401 implies 403, as both are decided before the route."""
    statuses = (*statuses, 403) if 401 in statuses else statuses
    content = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/ProblemDetail"}}}
    return {status: {"description": HTTPStatus(status).phrase, "content": content} for status in sorted(statuses)}


def install(app: Starlette) -> None:
    """Install exception handlers, so that every error is an RFC 9457 response."""
    from fastapi.exceptions import RequestValidationError  # processes of jobs don't need FastAPI

    handlers = {
        Problem: _of_problem, HTTPException: _of_http, RequestValidationError: _of_validation,
        MotionError: _of_motion, Full: _of_full_disk,
    }  # fmt: skip
    for kind, handler in handlers.items():
        app.add_exception_handler(kind, handler)


def _answer(request: Request, status: int, detail: str, **more: Any) -> Response:
    if request.method == "GET" and request.headers.get("accept", "").startswith("text/html"):  # somebody looks at it
        page = _PAGE.format(told(status, detail)["title"], escape(detail[:1].upper() + detail[1:].partition(":")[0]))
        return Response(page, status, {**(more.get("headers") or {}), **_PAGE_HEADERS}, "text/html")
    return problem_response(status, detail, request_id=request.scope.get("request_id"), **more)


async def _of_problem(request: Request, error: Any) -> Response:
    return _answer(request, error.status_code, error.detail, errors=error.errors, headers=error.headers)


async def _of_http(request: Request, error: Any) -> Response:
    path, paths, headers = request.url.path[:100], request.app.state.paths, error.headers
    if error.status_code == 404:
        detail = f"not found: {path}; see /docs{did_you_mean(path, paths.keys() - {path})}"
    elif error.status_code == 405:  # Starlette names the methods of the first route with this path only
        headers = {"Allow": ", ".join(sorted(paths[request.scope["route"].path]))}
        detail = f"method {request.method} is not allowed"
    elif error.status_code == 400:  # FastAPI's, of what Python's json can't read, such as other encodings
        detail = _NO_JSON
    else:
        detail = str(error.detail)
    return _answer(request, error.status_code, detail, headers=headers)


async def _of_validation(request: Request, error: Any) -> Response:
    body = getattr(request.scope.get("route"), "body_field", None)
    if body is not None and isinstance(error.body, bytes):  # FastAPI parses only what is declared as JSON
        return _answer(request, 415, "the body must be JSON with Content-Type: application/json")
    status, detail, errors = _of_fields(error.errors(), body and body.field_info.annotation)
    return _answer(request, status, detail, errors=errors)


async def _of_motion(request: Request, error: Any) -> Response:
    body = getattr(request.scope.get("route"), "body_field", None)
    known = None if body is None else body.field_info.annotation.model_fields
    names = [name for name in error.fields if known is None or name.partition(".")[0] in known]
    pointer = lambda name: name if known is None else f"/{name.replace('.', '/')}"
    errors = [{"field": pointer(name), "problem": str(error), "bound": None} for name in names]
    return _answer(request, 422, str(error), errors=errors)


async def _of_full_disk(request: Request, error: Any) -> Response:
    return _answer(request, 507, FULL)


def invalid(error: ValidationError, kind: type[BaseModel], where: str = "body") -> Problem:
    """The response to a body, to the fields of a form, or with "query" to parameters, that aren't a `kind`."""
    found = error.errors(include_url=False, include_input=False)
    status, detail, errors = _of_fields([{**one, "loc": (where, *one["loc"])} for one in found], kind)
    problem = Problem(status, detail)
    problem.errors = errors
    return problem


def _of_fields(found: Sequence[Mapping[str, Any]], kind: type[BaseModel] | None = None) -> tuple[int, str, list]:
    if found[0]["type"] == "json_invalid" and not _is_field(found[0]["loc"]):
        return 400, _NO_JSON, []
    each = [_field_problems(one, kind) for one in found]
    told = "; ".join(f"{', '.join(one['field'] for one in of)}: {of[0]['problem']}" for of in each[:5])
    return 422, told, [one for of in each for one in of][:100]


def _field_problems(error: Mapping[str, Any], kind: type[BaseModel] | None) -> list[dict[str, Any]]:
    """A pydantic error of one field, or of the several that a `MotionError` of a validator names."""
    names = getattr((error.get("ctx") or {}).get("error"), "fields", ())
    places = [(*error["loc"], *name.split(".")) for name in names] or [error["loc"]]
    return [field_problem({**error, "loc": place}, kind) for place in places]


def field_problem(error: Mapping[str, Any], kind: type[BaseModel] | None = None) -> dict[str, Any]:
    """A pydantic error as `FieldProblem`; `kind` is what the body should have been."""
    place = [str(part) for part in error["loc"]]
    if place and place[0] == "body":
        field = "/" + "/".join(part.replace("~", "~0").replace("/", "~1") for part in place[1:])
    else:
        field = ".".join(place[1:]) or place[0]
    context = error.get("ctx") or {}
    bound = {name: context[name] for name in _BOUNDS if isinstance(context.get(name), (int, float, str))}
    problem = error["msg"].removeprefix("Value error, ")  # pydantic's words before a validator's own
    if error["type"] == "extra_forbidden" and kind is not None:
        problem = f"there is no such field{did_you_mean(place[-1], _fields(kind, error['loc'][1:-1]))}"
    return {"field": field, "problem": problem, "bound": bound or None}


def _is_field(loc: Sequence[str | int]) -> bool:
    """Whether an error is of a field, which may hold JSON of its own, and not of the whole body."""
    return len(loc) > 1 and isinstance(loc[1], str)


def _fields(kind: Any, loc: Sequence[str | int]) -> Iterable[str]:
    for part in loc:
        if isinstance(part, str):
            field = kind.model_fields.get(part)
            kind = next(_models(field.annotation), None) if field else None
            if kind is None:
                return ()
    return kind.model_fields


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)
