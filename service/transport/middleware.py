"""Id, time-out, log and metrics of every request."""

import asyncio
import itertools
import re
import secrets
import time

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.observability.metrics import Metrics
from service.settings import Settings
from service.transport.access import send_problem

_ID = re.compile(rb"[A-Za-z0-9_.-]{1,64}")
_PROCESS, _NUMBER = secrets.token_hex(4), itertools.count(1)
_log = structlog.get_logger("motionenv.service")


class ObservabilityMiddleware:
    """Id, time-out, log and metrics of each request; unexpected exceptions become status 500."""

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics) -> None:
        self.app, self.metrics, self.seconds = app, metrics, settings.request_seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request."""
        if scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
            return
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        response = _Response(send, _request_id(headers))
        scope["request_id"] = response.request_id
        self.metrics.running.inc()
        try:
            await self._http(scope, receive, response)
        finally:
            self.metrics.running.dec()
            self._note(scope, response)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        scope["request_id"], begun = _request_id(dict(scope["headers"])), time.perf_counter()
        client = scope.get("client")
        try:
            await self.app(scope, receive, send)
        finally:
            _log.info(
                "websocket", request_id=scope["request_id"], path=scope["path"],
                seconds=round(time.perf_counter() - begun, 6), client=client[0] if client else None,
                key=scope.get("key"),
            )  # fmt: skip

    async def _http(self, scope: Scope, receive: Receive, response: "_Response") -> None:
        """Handle an HTTP request; the time-out starts again with each chunk of its body."""

        async def receive_chunk() -> Message:
            message = await receive()
            if message.get("more_body") and response.deadline is not None:
                response.deadline.reschedule(asyncio.get_running_loop().time() + self.seconds)
            return message

        # HEAD is a GET whose body the server doesn't send.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope
        try:
            async with asyncio.timeout(self.seconds) as response.deadline:
                await self.app(inner, receive_chunk, response.send)
        except TimeoutError:
            if response.status:
                raise
            response.deadline = None
            await send_problem(
                scope, receive, response.send, 504, f"no response within {self.seconds:g} s: request less"
            )
        except Exception:  # the client gets an error response, the log the details
            _log.exception("request failed", request_id=response.request_id, path=scope["path"])
            if response.status:
                raise
            response.deadline = None
            await send_problem(scope, receive, response.send, 500, "internal error: please report it")
        finally:
            scope.update({name: inner[name] for name in ("route", "key") if name in inner})

    def _note(self, scope: Scope, response: "_Response") -> None:
        seconds, route, client = time.perf_counter() - response.begun, _route(scope), scope.get("client")
        self.metrics.count(scope["method"], route, response.status, seconds)
        _log.info(
            "request", request_id=response.request_id, method=scope["method"], path=scope["path"], route=route,
            status=response.status, seconds=round(seconds, 6), bytes=response.size,
            client=client[0] if client else None, key=scope.get("key"),
        )  # fmt: skip


class _Response:
    def __init__(self, send: Send, request_id: str):
        self.begun, self.status, self.size = time.perf_counter(), 0, 0
        self.request_id, self._send = request_id, send
        self.deadline: asyncio.Timeout | None = None

    async def send(self, message: Message) -> None:
        """Send a message; the first one ends the time-out."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            if self.deadline is not None:
                self.deadline.reschedule(None)
            message["headers"] = [*message.get("headers", ()), (b"x-request-id", self.request_id.encode())]
        else:
            self.size += len(message.get("body", b""))
        await self._send(message)


def _request_id(headers: dict[bytes, bytes]) -> str:
    """The client's X-Request-ID if it is well-formed, otherwise process id and request number."""
    given = headers.get(b"x-request-id", b"")
    return given.decode() if _ID.fullmatch(given) else f"{_PROCESS}{next(_NUMBER):08x}"


def _route(scope: Scope) -> str:
    """The template of the path: metrics must not grow with arbitrary paths."""
    route = scope.get("route")
    return getattr(route, "path", "unknown")
