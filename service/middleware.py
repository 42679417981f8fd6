"""What happens to every request before and after its route: ASGI middleware without a body of its own.

`Observing` gives it an id, a deadline, a line in the log and its place in the metrics; `Guarding` asks for the key,
refuses what pages of other sites send in a visitor's name, counts what may be asked, and stops bodies that are too
large.
"""

import asyncio
import base64
import binascii
import hashlib
import hmac
import itertools
import re
import secrets
import time
from typing import Any

import structlog
from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import FixedWindowRateLimiter
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.metrics import Metrics
from service.problems import problem_response
from service.settings import Settings

_ID = re.compile(rb"[A-Za-z0-9_.-]{1,64}")
_PROCESS, _NUMBER = secrets.token_hex(4), itertools.count(1)
#: What load balancers ask, without a key.
FREE = ("/health/", "/v2/health/")
_log = structlog.get_logger("motionenv.service")


class Observing:
    """Id, deadline, log and metrics of each request; a defect becomes a problem of status 500.

    Args:
        app: what answers.
        settings: of the service.
        metrics: that count.
    """

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics):
        self.app, self.metrics, self.seconds = app, metrics, settings.request_seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "websocket":
            await self._connected(scope, receive, send)
            return
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        answer = _Answer(send, _request_id(scope))
        scope["request_id"] = answer.request_id
        self.metrics.running.inc()
        try:
            await self._answered(scope, receive, answer)
        finally:
            self.metrics.running.dec()
            self._note(scope, answer)

    async def _connected(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a WebSocket run, and log it when it has ended."""
        scope["request_id"], begun, client = _request_id(scope), time.perf_counter(), scope.get("client")
        try:
            await self.app(scope, receive, send)
        finally:
            _log.info(
                "websocket", request_id=scope["request_id"], path=scope["path"],
                seconds=round(time.perf_counter() - begun, 6), client=client[0] if client else None,
                key=scope.get("key"),
            )  # fmt: skip

    async def _answered(self, scope: Scope, receive: Receive, answer: "_Answer") -> None:
        """Have the request answered in time, whatever happens; the time counts from the body's last part."""

        async def heard() -> Message:
            message = await receive()
            if message.get("more_body") and answer.deadline is not None:
                answer.deadline.reschedule(asyncio.get_running_loop().time() + self.seconds)
            return message

        try:
            async with asyncio.timeout(self.seconds) as answer.deadline:
                await self.app(scope, heard, answer.send)
        except TimeoutError:
            if answer.status:
                raise
            answer.deadline = None
            await _answer(scope, receive, answer.send, 504, f"no answer within {self.seconds:g} s: ask for less")
        except Exception:  # the last resort: whatever it is, the client gets a problem and the log the rest
            _log.exception("request failed", request_id=answer.request_id, path=scope["path"])
            if answer.status:
                raise
            answer.deadline = None
            detail = "this is a defect of the service: please report it"
            await _answer(scope, receive, answer.send, 500, detail)

    def _note(self, scope: Scope, answer: "_Answer") -> None:
        """Count and log the request."""
        seconds, route, client = time.perf_counter() - answer.begun, _route(scope), scope.get("client")
        self.metrics.count(scope["method"], route, answer.status, seconds)
        _log.info(
            "request", request_id=answer.request_id, method=scope["method"], path=scope["path"], route=route,
            status=answer.status, seconds=round(seconds, 6), bytes=answer.size, client=client[0] if client else None,
            key=scope.get("key"),
        )  # fmt: skip


class _Answer:
    """What has been sent of an answer.

    Args:
        send: of ASGI.
        request_id: to tell the client.
    """

    def __init__(self, send: Send, request_id: str):
        self.begun, self.status, self.size = time.perf_counter(), 0, 0
        self.request_id, self._send = request_id, send
        self.deadline: asyncio.Timeout | None = None

    async def send(self, message: Message) -> None:
        """Send part of the answer; its beginning ends the deadline."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            if self.deadline is not None:
                self.deadline.reschedule(None)
            message["headers"] = [*message.get("headers", ()), (b"x-request-id", self.request_id.encode())]
        else:
            self.size += len(message.get("body", b""))
        await self._send(message)


class Guarding:
    """Keys, rates and sizes.

    Args:
        app: what answers.
        settings: of the service.
    """

    def __init__(self, app: ASGIApp, settings: Settings):
        self.app = app
        self.digests = [hashlib.sha256(key.get_secret_value().encode()).digest() for key in settings.keys]
        self.origins = frozenset(origin.encode() for origin in settings.cors)
        self.names = None if settings.keys or settings.open else _names(settings)
        self.max_json, self.max_upload = settings.max_json, settings.max_upload
        self.rate = RateLimitItemPerMinute(settings.rate) if settings.rate else None
        self.limiter = FixedWindowRateLimiter(MemoryStorage())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass, or answer it."""
        if scope["type"] not in ("http", "websocket") or scope["path"].startswith(FREE):
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        if self.names is not None and not self.names.fullmatch(headers.get(b"host", b"")):
            detail = "without keys the service answers only by this machine's own names: list others in hosts"
            await _refuse(scope, receive, send, 421, detail, None)
            return
        if self.digests and not self._known(headers, scope):
            challenge = {"WWW-Authenticate": 'Basic realm="motionenv", Bearer realm="motionenv"'}
            await _refuse(scope, receive, send, 401, "an API key is needed, as Authorization: Bearer <key>", challenge)
            return
        if _from_elsewhere(scope, headers) and not self.origins & {headers.get(b"origin"), b"*"}:
            await _refuse(scope, receive, send, 403, "another site's page asks this: only origins in cors may", None)
            return
        wait = self._wait(scope)
        if wait:
            retry = {"Retry-After": str(wait)}
            await _refuse(scope, receive, send, 429, f"more requests than allowed: ask again in {wait} s", retry)
            return
        form = headers.get(b"content-type", b"").lower().startswith(b"multipart/form-data")
        most = self.max_upload if form else self.max_json
        if int(headers.get(b"content-length", b"0")) > most:
            await _refuse(
                scope, receive, send, 413, f"the body must be of {most} bytes at most", {"Connection": "close"}
            )
            return
        chunked = b"transfer-encoding" in headers
        await self.app(scope, _limited(receive, most) if chunked else receive, send)

    def _known(self, headers: dict[bytes, bytes], scope: Scope) -> bool:
        """Whether the request has a key; the scope remembers a part of its digest, for log and rate."""
        given = _key(headers)
        if given is None:
            return False
        digest = hashlib.sha256(given).digest()
        matches = [hmac.compare_digest(digest, known) for known in self.digests]  # all of them: no early end
        scope["key"] = digest.hex()[:8] if any(matches) else None
        return any(matches)

    def _wait(self, scope: Scope) -> int:
        """Seconds to wait until the next request is allowed; 0 when it is."""
        if self.rate is None:
            return 0
        client = scope.get("client")
        who = scope.get("key") or (client[0] if client else "?")
        if self.limiter.hit(self.rate, who):
            return 0
        return max(1, round(self.limiter.get_window_stats(self.rate, who).reset_time - time.time()))


def _names(settings: Settings) -> re.Pattern[bytes]:
    """Hosts as whom a service that only its own machine can reach is asked.

    A page of another site can have its own name lead here (DNS rebinding): to the browser it then is of one origin with
    the service, which it may read from and write to.
    """
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    names = {"localhost", "127.0.0.1", "[::1]", host, *settings.hosts}
    return re.compile(rf"({'|'.join(map(re.escape, sorted(names)))})(:\d+)?".encode(), re.IGNORECASE)


def _from_elsewhere(scope: Scope, headers: dict[bytes, bytes]) -> bool:
    """Whether a page of another site asks for more than to look, as its visitor's browser says.

    A browser sends forms there without asking first, even to a service that only its own machine can reach, and with
    the password that it keeps for it. Decided as Go's http.CrossOriginProtection does.
    """
    if scope["type"] == "http" and scope["method"] in ("GET", "HEAD", "OPTIONS"):
        return False
    site, origin = headers.get(b"sec-fetch-site"), headers.get(b"origin")
    if site is not None:
        return site not in (b"same-origin", b"none")
    return origin is not None and origin.partition(b"://")[2] != headers.get(b"host")


def _key(headers: dict[bytes, bytes]) -> bytes | None:
    """The key that a request came with: a bearer token, X-API-Key, or the password of Basic, which browsers ask for."""
    kind, _, value = headers.get(b"authorization", b"").partition(b" ")
    if kind.lower() == b"bearer":
        return value.strip()
    if kind.lower() == b"basic":
        try:
            return base64.b64decode(value, validate=True).partition(b":")[2]
        except binascii.Error:
            return None
    return headers.get(b"x-api-key")


def _request_id(scope: Scope) -> str:
    """The client's X-Request-ID if it is a plain word, else a new one: the process, and which of its requests."""
    for name, value in scope["headers"]:
        if name == b"x-request-id" and _ID.fullmatch(value):
            return value.decode()
    return f"{_PROCESS}{next(_NUMBER):08x}"


def _route(scope: Scope) -> str:
    """The path's template, so that metrics don't grow with what clients make up."""
    route = scope.get("route")
    return getattr(route, "path", "unknown")


def _limited(receive: Receive, most: int) -> Receive:
    """`receive`, ending with a 413 after `most` bytes."""
    size = 0

    async def limited() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        if size > most:
            raise HTTPException(413, f"the body must be of {most} bytes at most")
        return message

    return limited


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, detail: str, headers: Any) -> None:
    """Answer instead of the route; a server that can't answer a WebSocket's opening request closes it with 403."""
    if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": detail[:120]})
        return
    await _answer(scope, receive, send, status, detail, headers)


async def _answer(scope: Scope, receive: Receive, send: Send, status: int, detail: str, headers: Any = None) -> None:
    """Send a problem."""
    await problem_response(status, detail, request_id=scope.get("request_id"), headers=headers)(scope, receive, send)
