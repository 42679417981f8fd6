"""The web page, from the bundle in `service/web/dist`."""

from pathlib import Path
from typing import Any

from fastapi import APIRouter
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles

router = APIRouter(tags=["page"], include_in_schema=False)
FOLDER = Path(__file__).parents[1] / "web" / "dist"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {"Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}


class Assets(StaticFiles):
    """Static files that browsers may cache forever: their names hold a hash of their content."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        """The response to a request for a file that exists."""
        response = super().file_response(*args, **kwargs)
        response.headers.update({**_HEADERS, "Cache-Control": "private, max-age=31536000, immutable"})
        return response


@router.get("/")
async def index() -> FileResponse:
    """The page itself, sent anew each time: its name stays the same when its content changes."""
    return FileResponse(FOLDER / "index.html", headers={**_HEADERS, "Cache-Control": "private, no-store"})


#: Scripts and styles of the page.
ASSETS = Assets(directory=FOLDER / "assets")
