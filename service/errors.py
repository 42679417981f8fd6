"""Errors as problem+json (RFC 9457), with the field, its bounds and what to do.

Values sent by the client are never echoed: they may contain secrets, or what JSON can't hold (NaN, lone surrogates).
"""

from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

import orjson
from pydantic import BaseModel, Field
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match

from motionenv import MotionError
from service.jobs.store import Full

MEDIA_TYPE = "application/problem+json"
#: The detail of a 507.
FULL = "the service's disk is full: remove jobs or models, or contact its operator"
#: Names of bounds in pydantic's errors that are passed on.
_BOUNDS = ("gt", "ge", "lt", "le", "multiple_of", "min_length", "max_length", "pattern", "expected")


class FieldProblem(BaseModel):
    """A problem with one field."""

    field: str = Field(description="JSON pointer into the body, or name of the parameter.", examples=["/fps"])
    problem: str = Field(description="What was expected.", examples=["Input should be less than or equal to 240"])
    bound: dict[str, Any] | None = Field(None, description="The bounds that were violated.", examples=[{"le": 240}])


class ProblemDetail(BaseModel):
    """An error response (RFC 9457)."""

    type: str = Field("about:blank", description="Always about:blank: the status tells the kind.")
    title: str = Field(description="Name of the status.", examples=["Unprocessable Entity"])
    status: int = Field(ge=400, le=599, description="HTTP status.", examples=[422])
    detail: str = Field(description="What was wrong, and what to do.")
    request_id: str | None = Field(None, description="Id of the request in the logs.")
    errors: list[FieldProblem] = Field(default_factory=list, description="Each invalid field.")


class Problem(HTTPException):
    """An error response: what was wrong and what to do, with the JSON pointer and bounds of the invalid field."""

    def __init__(
        self, status: int, detail: str, *, field: str | None = None, bound: Mapping[str, Any] | None = None,
        headers: Mapping[str, str] | None = None,
    ):  # fmt: skip
        super().__init__(status, detail, dict(headers or {}))
        self.errors = [] if field is None else [{"field": field, "problem": detail, "bound": bound and dict(bound)}]


def busy(detail: str, seconds: int = 1) -> Problem:
    """503: the service is overloaded; the client may retry in `seconds`."""
    return Problem(503, f"{detail}; retry in {seconds} s", headers={"Retry-After": str(seconds)})


def at_most(value: float, most: float, field: str, name: str, unit: str, *, each: float = 1) -> None:
    """Reject a value larger than this service or a format allows: 422 with the field, a JSON pointer, and its bound.

    That bound follows from `each`, the value per unit of the field.
    """
    if value > most:
        bound = {"le": most / each}
        raise Problem(422, f"{name} must be at most {most} {unit}, got {value:g}", field=field, bound=bound)


def problem_response(
    status: int, detail: str, *, request_id: str | None = None, errors: Sequence = (), headers=None
) -> Response:
    """An error response; `errors` are of single fields, like `FieldProblem`."""
    body = {
        "type": "about:blank", "title": HTTPStatus(status).phrase, "status": status,
        "detail": detail.encode("utf-8", "replace").decode(), "request_id": request_id, "errors": list(errors),
    }  # fmt: skip
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
        MotionError: _of_motion, Full: _of_full,
    }  # fmt: skip
    for kind, handler in handlers.items():
        app.add_exception_handler(kind, handler)


def _answer(request: Request, status: int, detail: str, **more: Any) -> Response:
    return problem_response(status, detail, request_id=request.scope.get("request_id"), **more)


async def _of_problem(request: Request, error: Any) -> Response:
    return _answer(request, error.status_code, error.detail, errors=error.errors, headers=error.headers)


async def _of_http(request: Request, error: Any) -> Response:
    details = {404: f"not found: {request.url.path:.100}; see /docs", 405: f"method {request.method} is not allowed"}
    detail = details.get(error.status_code, str(error.detail))
    headers = {"Allow": _allowed(request)} if error.status_code == 405 else error.headers
    return _answer(request, error.status_code, detail, headers=headers)


def _allowed(request: Request) -> str:
    """Methods of all routes with this path; Starlette tells those of the first one only."""
    matching = (route for route in request.app.routes if route.matches(request.scope)[0] is not Match.NONE)
    path = getattr(next(matching, None), "path", None)
    same = (route for route in request.app.routes if getattr(route, "path", None) == path)
    return ", ".join(sorted({method for route in same for method in getattr(route, "methods", None) or ()}))


async def _of_validation(request: Request, error: Any) -> Response:
    errors = [field_problem(e) for e in error.errors()]
    broken = any(e["type"] == "json_invalid" for e in error.errors())
    detail = "the body is not valid JSON" if broken else "; ".join(f"{e['field']}: {e['problem']}" for e in errors[:5])
    return _answer(request, 400 if broken else 422, detail, errors=errors[:100])


async def _of_motion(request: Request, error: Any) -> Response:
    return _answer(request, 422, str(error))


async def _of_full(request: Request, error: Any) -> Response:
    return _answer(request, 507, FULL)


def field_problem(error: Mapping[str, Any]) -> dict[str, Any]:
    """A pydantic error as `FieldProblem`."""
    place = [str(part) for part in error["loc"]]
    if place and place[0] == "body":
        field = "/" + "/".join(part.replace("~", "~0").replace("/", "~1") for part in place[1:])
    else:
        field = ".".join(place[1:]) or place[0]
    context = error.get("ctx") or {}
    bound = {name: context[name] for name in _BOUNDS if isinstance(context.get(name), (int, float, str))}
    problem = error["msg"].removeprefix("Value error, ")  # pydantic's words before a validator's own
    return {"field": field, "problem": problem, "bound": bound or None}
