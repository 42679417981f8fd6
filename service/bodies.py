"""Routes that take JSON, read by pydantic at once.

FastAPI reads a body with the standard library's json and then looks, for each request, for parameters, dependencies and
responses of every kind: as much time as it takes to make a walk. These routes have one body and none of the rest.
"""

from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.types import Receive, Scope, Send

from service.problems import Problem

Body = TypeVar("Body", bound=BaseModel)


class JsonRoute(APIRoute):
    """A route whose endpoint takes `request` and the body, `asked`, and returns a response.

    Args:
        path: of the route.
        endpoint: `async def endpoint(request: Request, asked: SomeModel) -> Response`.
        options: of FastAPI's route.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any):
        super().__init__(path, endpoint, **options)
        self._kind = get_type_hints(endpoint)["asked"]
        self.app = self._answered

    async def _answered(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope, receive, send)
        response = await self.endpoint(request, await parsed(request, self._kind))
        await response(scope, receive, send)


async def parsed(request: Request, kind: type[Body]) -> Body:
    """The JSON body of a request.

    Args:
        request: of HTTP.
        kind: what it should be.

    Raises:
        Problem: 415, it says that it is something else, as forms on other sites' pages do; 400, the client went.
        RequestValidationError: it isn't right.
    """
    said = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if said != "application/json" and not (said.startswith("application/") and said.endswith("+json")):
        raise Problem(415, "the body must be JSON, and say so: Content-Type: application/json")
    try:
        return kind.model_validate_json(await request.body())
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
        raise RequestValidationError([{**one, "loc": ("body", *one["loc"])} for one in found]) from None
    except ClientDisconnect:
        raise Problem(400, "the client went away") from None
