"""`/docs`: the OpenAPI document as a page without scripts.

FastAPI's own page runs scripts from a CDN: it doesn't work offline, and such a script could use the API with the key
that the browser remembers.
"""

import re
from collections.abc import Iterator
from html import escape
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, Response

router = APIRouter(include_in_schema=False)
_BOUNDS = {
    "minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<", "minLength": "length ≥",
    "maxLength": "length ≤", "minItems": "items ≥", "maxItems": "items ≤", "pattern": "matches",
}  # fmt: skip
_HEADERS = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'", "Cache-Control": "no-cache"}
_STYLE = """
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }
body { max-width: 60rem; margin: auto; padding: 1rem }
table { border-collapse: collapse; width: 100%; display: block; overflow-x: auto }
td, th { border-bottom: 1px solid #8884; padding: .3rem .6rem; text-align: left; vertical-align: top }
code { font-size: .9em }
h2 { border-top: 2px solid #8884; padding-top: 1rem }
"""


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The API reference: all operations and schemas."""
    told = request.app.openapi()
    body = "".join([*_paths(told), "<h2>Schemas</h2>", *_schemas(told)])
    head = f"<!doctype html><html lang=en><meta charset=utf-8><title>motionenv HTTP API</title><style>{_STYLE}</style>"
    first = "<meta name=viewport content='width=device-width'><h1>motionenv HTTP API</h1><p>Machine-readable: "
    return HTMLResponse(f"{head}{first}<a href='openapi.json'>openapi.json</a>.</p>{body}", headers=_HEADERS)


def _paths(told: dict[str, Any]) -> Iterator[str]:
    for path, operations in told["paths"].items():
        for method, operation in operations.items():
            yield f"<h2><code>{method.upper()} {escape(path)}</code></h2><p><b>{escape(operation['summary'])}.</b> "
            yield f"{_prose(operation.get('description', ''))}</p>"
            parameters = {p["name"]: {**p["schema"], **p} for p in operation.get("parameters", ())}
            yield from _table(parameters)
            for kind, body in operation.get("requestBody", {}).get("content", {}).items():
                yield f"<p>Request body <code>{escape(kind)}</code>: {_type(body.get('schema', {}))}</p>"
                yield from _table(body.get("schema", {}).get("properties", {}))
            refusals = [status for status in operation["responses"] if status >= "400"]
            for status, answer in operation["responses"].items():
                if status in refusals:
                    continue
                kinds = ", ".join(f"<code>{escape(kind)}</code>" for kind in answer.get("content", {}))
                yield f"<div>{status}: {_prose(answer.get('description', ''))} {kinds}</div>"
            yield f"<div>Errors: {', '.join(refusals) or 'none'}</div>"


def _schemas(told: dict[str, Any]) -> Iterator[str]:
    for name, schema in told["components"]["schemas"].items():
        yield f"<h3 id='{escape(name)}'>{escape(name)}</h3><p>{_prose(schema.get('description', ''))}</p>"
        yield from _table(schema.get("properties", {}))


def _table(fields: dict[str, Any]) -> Iterator[str]:
    """Fields with type, bounds, default, example and meaning."""
    if not fields:
        return
    yield "<table><tr><th>field<th>type<th>bounds<th>default<th>example<th>meaning"
    for name, field in fields.items():
        parts = [field, *field.get("anyOf", ())]
        bounds = ", ".join(f"{sign} {part[key]}" for part in parts for key, sign in _BOUNDS.items() if key in part)
        default, example = (str(field.get(key, "")) for key in ("default", "examples"))
        named, *rest = (escape(cell) for cell in (name, bounds, default, example.strip("[]")))
        rest.append(_prose(field.get("description", "")))
        yield f"<tr><td><code>{named}</code><td>{_type(field)}" + "".join(f"<td>{cell}" for cell in rest)
    yield "</table>"


def _prose(text: str) -> str:
    """Text as HTML; backquoted names become code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _type(schema: dict[str, Any]) -> str:
    """A type as HTML, with links to named schemas."""
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f"<a href='#{name}'>{name}</a>"
    if "anyOf" in schema:
        return " or ".join(map(_type, schema["anyOf"]))
    if "enum" in schema:
        return " | ".join(escape(str(value)) for value in schema["enum"])
    if schema.get("type") == "array":
        return f"list of {_type(schema.get('items', {}))}"
    return escape(str(schema.get("type", schema.get("const", "any"))))
