"""Parts of files: the header `Range` (RFC 9110, section 14)."""

import re

from fastapi import Request

from service.errors import Problem

_ONE = re.compile(r"bytes=(?:(?P<first>\d{1,18})-(?P<last>\d{0,18})|-(?P<length>\d{1,18}))")


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
