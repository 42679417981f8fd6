"""HTTP caching: the same request gives the same bytes, so an ETag is known before any work is done."""

import hashlib
from functools import lru_cache

from fastapi import Request
from starlette.responses import Response

from motionenv import __version__

_SEEDED = "private, max-age=86400"
_VERSION = __version__.encode()


def make_etag(*parts: str | bytes) -> str:
    """A strong ETag of everything that determines a response: the version of motionenv, and `parts`."""
    whole = [_VERSION, *(part if isinstance(part, bytes) else part.encode() for part in parts)]
    digest = hashlib.blake2b(b"\0".join(whole), digest_size=16).hexdigest()
    return f'"{digest}"'


def cache_headers(etag: str | None, *, control: str = _SEEDED) -> dict[str, str]:
    """Caching headers of a response; `etag` is None if it isn't reproducible."""
    if etag is None:
        return {"Cache-Control": "no-store", "Vary": "Accept, Accept-Encoding"}
    return {"ETag": etag, "Cache-Control": control, "Vary": "Accept, Accept-Encoding"}


def etag_matches(request: Request, etag: str | None) -> bool:
    """Whether If-None-Match contains `etag`, by weak comparison (RFC 9110, 8.8.3.2)."""
    given = request.headers.get("if-none-match")
    return given is not None and etag is not None and etag in _tags(given)


@lru_cache(maxsize=256)
def _tags(header: str) -> frozenset[str]:
    return frozenset(one.strip().removeprefix("W/") for one in header.split(","))


def not_modified(headers: dict[str, str]) -> Response:
    """304 with the `headers` of the full response."""
    return Response(status_code=304, headers=headers)
