"""Compression of large text, in clients' and proxies' terms: the header `Accept-Encoding`."""

from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipResponder
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import formats

_LEAST = 16_384  # [bytes] below which compression isn't worth its time
_LEVEL = 1  # numbers get little smaller by more effort, which takes several times as long
_TEXT = {formats.JSON, formats.CSV, formats.BVH, formats.TRC, formats.MOT}
_BINARY = {formats.NPY, formats.ZIP, *formats.FILES, *formats.FILMS, "application/octet-stream"} - _TEXT


class CompressionMiddleware:
    """Compress large JSON and other text for clients that accept gzip; their ETags become weak (RFC 9110, 8.8.3.3).

    Results of jobs stay as they are: parts of them can be asked for, and their ETag is their SHA-256.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._excluded = (*DEFAULT_EXCLUDED_CONTENT_TYPES, *_BINARY)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request."""
        gzip = any(name == b"accept-encoding" and b"gzip" in value for name, value in scope.get("headers", ()))
        if scope["type"] != "http" or scope["path"].endswith("/result") or not gzip:
            await self.app(scope, receive, send)
            return

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = _weakened(message["headers"])
            await send(message)

        responder = GZipResponder(self.app, _LEAST, compresslevel=_LEVEL, exclude_content_types=self._excluded)
        await responder(scope, receive, sent)


def _weakened(headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """The headers of what was compressed: a weak ETag, and Vary without the name that Starlette adds once more."""
    if (b"content-encoding", b"gzip") not in headers:
        return headers
    once = lambda value: b", ".join(dict.fromkeys(value.split(b", ")))
    weak = {b"etag": lambda value: b"W/" + value if value[:1] == b'"' else value, b"vary": once}
    return [(name, weak.get(name, bytes)(value)) for name, value in headers]
