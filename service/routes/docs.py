"""`/docs`: FastAPI's Swagger UI, with its assets from the package fastapi-offline, and what it says of the API."""

import base64
import hashlib
import re
from importlib.resources import files
from typing import Any

from fastapi import APIRouter, FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles

from service.errors import KINDS
from service.routes.page import FOLDER
from service.schemas.stream import StreamSettings
from service.transport.access import FREE

router = APIRouter(include_in_schema=False)
#: Scripts and styles of `/docs`.
ASSETS = StaticFiles(packages=[("fastapi_offline", "static")])
_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "Authorization: Bearer <key>."},
    "header": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
    "basic": {"type": "http", "scheme": "basic", "description": "Any user name; the key is the password."},
}
_PROBLEMS = "\n".join(f"| `{kind}` | {status} | {title} |" for kind, (status, title) in KINDS.items())
_SETTINGS = ", ".join(f"`{name}`" for name in StreamSettings.model_fields)
#: Introduction of the OpenAPI document: what applies to all operations, and the stream, which OpenAPI can't describe.
DESCRIPTION = files(__package__).joinpath("description.md").read_text("utf-8") % {
    "settings": _SETTINGS, "problems": _PROBLEMS
}  # fmt: skip


@router.get("/docs")
async def docs() -> Response:
    """The API reference, with a form to try each operation."""
    bare = get_swagger_ui_html(
        openapi_url="openapi.json", title="motionenv HTTP API", swagger_js_url="docs/swagger-ui-bundle.js",
        swagger_css_url="docs/swagger-ui.css", swagger_favicon_url="docs/favicon.png",
    )  # fmt: skip
    text = bytes(bare.body).decode()
    (starting,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(starting.encode()).digest()).decode()
    script, style = (next(FOLDER.glob(f"assets/contents-*.{kind}")).name for kind in ("js", "css"))
    also = f'<link rel="stylesheet" href="assets/{style}"><script defer src="assets/{script}"></script>'
    page = HTMLResponse(text.replace("</head>", f"{also}</head>"))
    page.headers["Cache-Control"] = "no-cache"
    page.headers["Content-Security-Policy"] = (
        f"default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return page


def require_keys(app: FastAPI) -> None:
    """Describe in the OpenAPI of `app` how keys are sent and which paths need one."""
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        described = generate()
        described.setdefault("components", {})["securitySchemes"] = _SCHEMES
        for path, operations in described["paths"].items():
            if not path.startswith(FREE):
                for operation in operations.values():
                    operation["security"] = [{name: []} for name in _SCHEMES]
        return described

    app.openapi = openapi  # type: ignore[method-assign]
