"""The page: what `bundle.py` bundled into `service/web/dist`, or a plain page that says how to get it."""

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.responses import Response

from service.problems import Problem, documented

router = APIRouter(tags=["page"], include_in_schema=False)
FOLDER = Path(__file__).parents[1] / "web"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {"Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}
_FOREVER = "private, max-age=31536000, immutable"  # names of assets hold a digest of what is in them


@dataclass(frozen=True)
class _File:
    """One file, plain and compressed."""

    body: bytes
    zipped: bytes
    media_type: str
    tag: str


@router.get("/")
async def index(request: Request) -> Response:
    """The page, asked for anew each time."""
    files = _files(FOLDER / "dist")
    return _sent(request, files.get("index.html") or _file("plain.html", FOLDER / "plain.html"), "private, no-cache")


@router.get("/assets/{name}", responses=documented(404))
async def asset(request: Request, name: str) -> Response:
    """A file of the page: only those that were there when the service began."""
    file = _files(FOLDER / "dist").get(name)
    if file is None or name == "index.html":
        raise Problem(404, "there is no such file: load the page again")
    return _sent(request, file, _FOREVER)


@lru_cache(maxsize=1)
def _files(folder: Path) -> dict[str, _File]:
    """The files in `folder` by name; none where there is no such folder."""
    return {path.name: _file(path.name, path) for path in folder.glob("*.*")}


def _file(name: str, path: Path) -> _File:
    body = path.read_bytes()
    media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return _File(body, gzip.compress(body, 9, mtime=0), media_type, hashlib.blake2b(body, digest_size=12).hexdigest())


def _sent(request: Request, file: _File, cache: str) -> Response:
    """`file`, compressed where the client takes that; nothing where it has it."""
    zipped = "gzip" in request.headers.get("accept-encoding", "")
    tag = f'"{file.tag}{"-gzip" if zipped else ""}"'
    headers = {**_HEADERS, "Cache-Control": cache, "ETag": tag, "Vary": "Accept-Encoding"}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    if zipped:
        headers["Content-Encoding"] = "gzip"
    return Response(file.zipped if zipped else file.body, headers=headers, media_type=file.media_type)
