"""Access control: API keys, protection against cross-site requests, rate limits and size limits."""

import base64
import binascii
import hashlib
import hmac
import re
import time
from collections.abc import MutableMapping
from typing import Any, NamedTuple

from limits import RateLimitItemPerMinute
from limits.aio.storage import Storage
from limits.aio.strategies import FixedWindowRateLimiter
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import problem_response
from service.settings import Settings

#: Paths without access control, for load balancers.
FREE = ("/health/",)
_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(?::\d*)?")
_CHALLENGE = {"WWW-Authenticate": 'Basic realm="motionenv", Bearer realm="motionenv"'}


class Access(NamedTuple):
    """Access control for jobs and models.

    Attributes:
        owner: part of the digest of the request's key; empty without keys, and for what was made before there were any.
        everything: whether the request may see the jobs and models of all owners.
    """

    owner: str
    everything: bool

    def to(self, owner: str) -> bool:
        """Whether the request may see and change what belongs to `owner`."""
        return self.everything or owner == self.owner


#: Of the service itself.
EVERYTHING = Access("", everything=True)


def access_of(scope: MutableMapping[str, Any]) -> Access:
    """The access of a request that `AccessMiddleware` has let pass."""
    return Access(scope.get("key") or "", scope.get("admin", True))


class _Refusal(NamedTuple):
    """Refusal of a request; `kind` of problem if it isn't the status's usual one."""

    status: int
    detail: str
    headers: dict[str, str] | None = None
    kind: str | None = None


class AccessMiddleware:
    """API keys, cross-site protection, rate and size limits."""

    def __init__(self, app: ASGIApp, settings: Settings, counts: Storage) -> None:
        self.app = app
        self.digests = [_digest(key.get_secret_value().encode()) for key in settings.all_keys]
        self.admins = {digest.hex()[:8] for digest in self.digests[len(settings.keys) :]}
        self.hosts = [host.lower() for host in trusted_hosts(settings)]
        self.origins = frozenset(origin.encode() for origin in settings.cors)
        self.max_json, self.max_upload = settings.max_json, settings.max_upload
        self.rate = RateLimitItemPerMinute(settings.rate) if settings.rate else None
        self.limiter = FixedWindowRateLimiter(counts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        if not self._is_ours(headers.get(b"host", b"")):
            told = "this service doesn't answer to this name: its operator can list it in hosts"
            await _refuse(scope, receive, send, _Refusal(400, told, kind="wrong-host"))
            return
        if scope["path"].startswith(FREE):
            await self.app(scope, receive, send)
            return
        form = headers.get(b"content-type", b"").lower().startswith(b"multipart/form-data")
        most = self.max_upload if form else self.max_json
        if self.rate is not None:
            send = self._counted(scope, send, self.rate.amount)
        if refusal := await self._refusal(scope, headers, most):
            await _refuse(scope, receive, send, refusal)
            return
        chunked = b"transfer-encoding" in headers
        await self.app(scope, _limited(receive, most) if chunked else receive, send)

    def _is_ours(self, given: bytes) -> bool:
        """Whether the header Host has one of `trusted_hosts`."""
        if "*" in self.hosts:
            return True
        name = _HOST.fullmatch(given.decode("latin1").lower())
        host = name[1] if name else ""
        return any(host == known or (known[:2] == "*." and host.endswith(known[1:])) for known in self.hosts)

    async def _refusal(self, scope: Scope, headers: dict[bytes, bytes], most: int) -> _Refusal | None:
        known = not self.digests or self._known(headers, scope)
        if self.rate is not None and not await self.limiter.hit(self.rate, _who(scope)):
            wait = (await self._left(scope))[1]
            return _Refusal(429, f"rate limit exceeded: retry in {wait} s", {"Retry-After": str(wait)})
        if not known:
            if _key(headers) is None:
                return _Refusal(401, "an API key is required: Authorization: Bearer <key>", _CHALLENGE, "no-key")
            unknown = {"WWW-Authenticate": f'{_CHALLENGE["WWW-Authenticate"]}, error="invalid_token"'}
            return _Refusal(401, "this service doesn't know this API key: check it", unknown, "unknown-key")
        if _is_cross_site(scope, headers) and not self.origins & {headers.get(b"origin"), b"*"}:
            return _Refusal(403, "cross-site requests are allowed only from origins in cors")
        if int(headers.get(b"content-length", b"0")) > most:
            return _Refusal(413, f"the body must have at most {most} bytes", {"Connection": "close"})
        return None

    def _known(self, headers: dict[bytes, bytes], scope: Scope) -> bool:
        """Whether the request has a valid key; part of its digest goes to the scope: log, rate limit and `Access`."""
        given = _key(headers)
        if given is None:
            return False
        digest = _digest(given)
        matches = [hmac.compare_digest(digest, known) for known in self.digests]  # all of them: constant time
        scope["key"] = digest.hex()[:8] if any(matches) else None
        scope["admin"] = scope["key"] in self.admins
        return any(matches)

    async def _left(self, scope: Scope) -> tuple[int, int]:
        """Requests that a client has left, and the seconds until it has all of them again."""
        assert self.rate is not None
        stats = await self.limiter.get_window_stats(self.rate, _who(scope))
        return max(0, stats.remaining), max(1, round(stats.reset_time - time.time()))

    def _counted(self, scope: Scope, send: Send, most: int) -> Send:
        """`send` that adds what is left of the rate limit (draft-ietf-httpapi-ratelimit-headers-10)."""

        async def counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                remaining, seconds = await self._left(scope)
                policy, state = f'"minute";q={most};w=60', f'"minute";r={remaining};t={seconds}'
                told = [(b"ratelimit-policy", policy.encode()), (b"ratelimit", state.encode())]
                message["headers"] = [*message.get("headers", ()), *told]
            await send(message)

        return counted


def _who(scope: Scope) -> str:
    client = scope.get("client")
    return scope.get("key") or (client[0] if client else "?")


def trusted_hosts(settings: Settings) -> list[str]:
    """Host names by which the service may be addressed: any with keys or `open`, otherwise its own and `hosts`.

    Otherwise another site could let its own name resolve to this machine (DNS rebinding): to the browser, its pages
    and the service would then be of one origin.
    """
    if settings.all_keys or settings.open:
        return ["*"]
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    return ["localhost", "127.0.0.1", "[::1]", host, *settings.hosts]


def _digest(key: bytes) -> bytes:
    return hashlib.sha256(key).digest()


def _is_cross_site(scope: Scope, headers: dict[bytes, bytes]) -> bool:
    """Whether a browser sends a request that changes something for a page of another site (CSRF).

    Browsers send forms to other sites without a preflight, even to localhost, and with stored passwords. The rules are
    those of Go's http.CrossOriginProtection.
    """
    if scope["type"] == "http" and scope["method"] in ("GET", "HEAD", "OPTIONS"):
        return False
    site, origin = headers.get(b"sec-fetch-site"), headers.get(b"origin")
    if site is not None:
        return site not in (b"same-origin", b"none")
    return origin is not None and origin.partition(b"://")[2] != headers.get(b"host")


def _key(headers: dict[bytes, bytes]) -> bytes | None:
    """The key of a request: a bearer token, X-API-Key, or the password of Basic authentication (for browsers)."""
    kind, _, value = headers.get(b"authorization", b"").partition(b" ")
    if kind.lower() == b"bearer":
        return value.strip()
    if kind.lower() == b"basic":
        try:
            return base64.b64decode(value, validate=True).partition(b":")[2]
        except binascii.Error:
            return None
    return headers.get(b"x-api-key")


def _limited(receive: Receive, most: int) -> Receive:
    size = 0

    async def limited() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        if size > most:
            raise HTTPException(413, f"the body must have at most {most} bytes")
        return message

    return limited


async def _refuse(scope: Scope, receive: Receive, send: Send, why: _Refusal) -> None:
    """Send an error response; a WebSocket is closed (403) if the server doesn't support responses to its handshake."""
    if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": why.detail[:120]})
        return
    await send_problem(scope, receive, send, why.status, why.detail, headers=why.headers, kind=why.kind)


async def send_problem(scope: Scope, receive: Receive, send: Send, status: int, detail: str, **more: Any) -> None:
    """Send an error response; further arguments as of `service.errors.problem_response`."""
    await problem_response(status, detail, request_id=scope.get("request_id"), **more)(scope, receive, send)
