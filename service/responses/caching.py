"""Conditional and range requests (RFC 9110): a request with a seed has an ETag before any work is done."""

import hashlib
import re
import secrets
from functools import lru_cache
from typing import Any

from fastapi import Request
from starlette.responses import Response

from motionenv import __version__
from service.errors import Problem

_SEED_BITS = 32  # of a seed that the service draws
_SEEDED, _REPLACEABLE = "private, max-age=86400", "private, no-cache"
_VERSION = __version__.encode()
_ONE = re.compile(r"bytes=(?:(?P<first>\d{1,18})-(?P<last>\d{0,18})|-(?P<length>\d{1,18}))")


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


async def seeded(request: Request, asked: Any, *parts: str) -> tuple[int, str | None, dict[str, str]]:
    """Seed, ETag and headers of the response to a request of `model` and `seed`; without a seed, one is drawn.

    `parts` determine the response besides the model, the path and the body.
    """
    etag, seed = None, asked.seed
    control = _REPLACEABLE if asked.model.startswith("fitted/") else _SEEDED
    if seed is None:
        seed = secrets.randbits(_SEED_BITS)
    else:
        version = request.app.state.service.model_registry.version(asked.model)
        query = request.scope["query_string"]
        etag = make_etag(request.scope["path"], version, *parts, query, await request.body())
    return seed, etag, {"Motion-Seed": str(seed), **cache_headers(etag, control=control)}


def etag_matches(request: Request, etag: str | None) -> bool:
    """Whether If-None-Match contains `etag`, by weak comparison (RFC 9110, 8.8.3.2)."""
    given = request.headers.get("if-none-match")
    return given is not None and etag is not None and not _tags(given).isdisjoint((etag, "*"))


@lru_cache(maxsize=256)
def _tags(header: str) -> frozenset[str]:
    return frozenset(one.strip().removeprefix("W/") for one in header.split(","))


def not_modified(request: Request, headers: dict[str, str]) -> Response:
    """304 with the `headers` of the full response; for methods other than GET 412 (RFC 9110, 13.1.2)."""
    if request.method != "GET":
        raise Problem(412, "If-None-Match has the ETag of the response: use what you have", headers=headers)
    return Response(status_code=304, headers=headers)


def part_of(request: Request, body: bytes, headers: dict[str, str], media_type: str) -> Response:
    """The response with the `Range` of a body that a request asks for, or with all of it."""
    keep_one_range(request, len(body))
    given = _ONE.fullmatch(dict(request.scope["headers"]).get(b"range", b"").decode().strip())
    headers = {**headers, "Accept-Ranges": "bytes"}
    if given is None or request.headers.get("if-range", headers["ETag"]) != headers["ETag"]:
        return Response(body, headers=headers, media_type=media_type)
    first = int(given["first"]) if given["first"] else max(0, len(body) - int(given["length"]))
    last = min(int(given["last"] or len(body)), len(body) - 1)
    headers["Content-Range"] = f"bytes {first}-{last}/{len(body)}"
    return Response(body[first : last + 1], 206, headers=headers, media_type=media_type)


def keep_one_range(request: Request, size: int) -> None:
    """Let Starlette see the `Range` of a request for a file of `size` bytes only if it is one range of bytes.

    Others are ignored, as the RFC allows: Starlette answers some of them by plain text, which isn't a `ProblemDetail`.

    Raises:
        Problem: 416, the file has no such part.
    """
    given = _ONE.fullmatch(request.headers.get("range", "").strip())
    last = None if given is None else given["last"]
    if given is None or (last and int(last) < int(given["first"])):
        request.scope["headers"] = [(name, value) for name, value in request.scope["headers"] if name != b"range"]
        return
    if int(given["first"] or 0) >= size or given["length"] == "0":
        told = {"Content-Range": f"bytes */{size}"}
        raise Problem(416, f"the file has {size} bytes", field="Range", bound={"lt": size}, headers=told)
