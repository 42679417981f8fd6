"""Routes whose only input is a JSON body, parsed by pydantic directly.

FastAPI parses the body with the standard library's json and resolves parameters and dependencies for each request,
which takes as long as synthesizing a walk.
"""

from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.types import Receive, Scope, Send

from service.errors import Problem, invalid

Body = TypeVar("Body", bound=BaseModel)


class JsonRoute(APIRoute):
    """A route whose endpoint takes `request` and the body, `asked`, and returns a response."""

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        super().__init__(path, endpoint, **options)
        self._kind = get_type_hints(endpoint)["asked"]
        self.app = self._handle

    async def _handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope, receive, send)
        response = await self.endpoint(request, await parsed(request, self._kind))
        await response(scope, receive, send)


async def parsed(request: Request, kind: type[Body]) -> Body:
    """The JSON body of a request; 415 for other content types, such as that of HTML forms, 422 if it is invalid."""
    said = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if said != "application/json" and not (said.startswith("application/") and said.endswith("+json")):
        raise Problem(415, "the body must be JSON with Content-Type: application/json")
    try:
        return kind.model_validate_json(await request.body(), strict=True)
    except ValidationError as error:
        raise invalid(error, kind) from None
    except ClientDisconnect:
        raise Problem(400, "the client disconnected") from None
