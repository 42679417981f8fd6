"""`/docs`: the API reference, with a sample of each call and a form to try it.

It works offline, unlike FastAPI's own, whose scripts come from a CDN and could use the API with the key that the
browser remembers. The only script is the page's own, which does nothing until a button is pressed.
"""

import json
import re
from collections.abc import Iterator
from html import escape
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, Response

from service.errors import KINDS
from service.reference import asyncapi
from service.reference.samples import SAMPLES, curl, path_of
from service.routes.page import FOLDER

router = APIRouter(include_in_schema=False)
_BOUNDS = {
    "minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<", "minLength": "length ≥",
    "maxLength": "length ≤", "minItems": "items ≥", "maxItems": "items ≤", "pattern": "matches",
}  # fmt: skip
_POLICY = "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src blob:; media-src blob:"
_HEADERS = {"Content-Security-Policy": _POLICY, "Cache-Control": "no-cache"}
_STREAM = """import motionenv

with motionenv.Client("{origin}") as client, client.stream("walk/fpca", seed=7, fps=60) as stream:
    poses = [next(stream) for _ in range(120)]
    stream.change(speed=1.6)"""


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The API reference: all operations, the stream, problems and schemas."""
    origin, key = str(request.base_url).rstrip("/"), bool(request.app.state.service.settings.all_keys)
    told = request.app.openapi()
    problems = "".join(
        f"<dt id='{kind}'><code>{kind}</code><dd>{status}. {escape(title)}." for kind, (status, title) in KINDS.items()
    )
    body = "".join([*_paths(told, origin, key), *_stream(origin), f"<h2>Problems</h2><dl>{problems}</dl>",
                    "<h2>Schemas</h2>", *_schemas(told)])  # fmt: skip
    return HTMLResponse(f"{_head(origin, key)}{body}</main>", headers=_HEADERS)


def _head(origin: str, key: bool) -> str:
    style, script = (f"assets/{next((FOLDER / 'assets').glob(pattern)).name}" for pattern in ("docs-*.css", "try-*.js"))
    first = f"""import motionenv

client = motionenv.Client("{origin}")"""
    wanted = "<p>Every call needs a key, here in the variable <code>MOTIONENV_KEY</code>.</p>" if key else ""
    return (
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>motionenv HTTP API</title><link rel=stylesheet href='{style}'>"
        f"<script type=module src='{script}'></script><main><h1>motionenv HTTP API</h1>"
        "<p>For programs: <a href='openapi.json'>openapi.json</a>, and <a href='asyncapi.json'>asyncapi.json</a> of "
        f"the stream.</p>{wanted}<p>Samples of Python begin with</p><pre>{escape(first)}</pre>"
    )


def _paths(told: dict[str, Any], origin: str, key: bool) -> Iterator[str]:
    for path, operations in told["paths"].items():
        for method, operation in operations.items():
            name = operation["operationId"]
            yield f"<section id='{name}'><h2><code>{method.upper()} {escape(path)}</code></h2>"
            yield f"<p><b>{escape(operation['summary'])}.</b> {_prose(operation.get('description', ''))}</p>"
            yield from _samples(name, method, path, origin, key)
            parameters = {p["name"]: {**p["schema"], **p} for p in operation.get("parameters", ())}
            yield from _table(parameters)
            for kind, body in operation.get("requestBody", {}).get("content", {}).items():
                yield f"<p>Request body <code>{escape(kind)}</code>: {_type(body.get('schema', {}))}</p>"
                yield from _table(body.get("schema", {}).get("properties", {}))
            yield from _answers(operation["responses"])
            yield "</section>"


def _samples(name: str, method: str, path: str, origin: str, key: bool) -> Iterator[str]:
    """How to call an operation, and a form for it."""
    sample = SAMPLES[name]
    yield f"<pre>{escape(curl(name, method, path, origin, key=key))}</pre>"
    if sample.python:
        yield f"<pre>{escape(sample.python)}</pre>"
    yield f"<details class=try data-method={method.upper()}><summary>Try it</summary><form>"
    yield f"<label>Path <input name=path value='{escape(path_of(name, path)[1:])}'></label>"
    if sample.body is not None or "--json" in sample.arguments:
        content = escape(json.dumps(sample.body or {}, indent=1))
        yield f"<label>Body <textarea name=body rows=6>{content}</textarea></label>"
        yield "<label>Accept <input name=accept value='application/json, */*;q=0.5'></label>"
    elif "-F " in sample.arguments:
        fields = " ".join(re.findall(r"-F (?!files)(\S+)", sample.arguments))
        yield "<label>Files <input name=files type=file multiple></label>"
        yield f"<label>Fields <input name=fields value='{escape(fields)}'></label>"
    if key:
        yield "<label>Key <input name=key type=password autocomplete=off></label>"
    yield "<button>Send</button></form><div class=answer role=status></div></details>"


def _answers(responses: dict[str, Any]) -> Iterator[str]:
    refusals = [status for status in responses if status >= "400"]
    for status, answer in responses.items():
        if status in refusals:
            continue
        kinds = ", ".join(f"<code>{escape(kind)}</code>" for kind in answer.get("content", {}))
        yield f"<div>{status}: {_prose(answer.get('description', ''))} {kinds}</div>"
    yield f"<div>Errors: {', '.join(refusals) or 'none'}</div>"


def _stream(origin: str) -> Iterator[str]:
    """The WebSocket, as the AsyncAPI document tells it."""
    told = asyncapi.document("", secure=False)
    messages = told["components"]["messages"]
    yield "<section id='stream'><h2><code>WS /v1/stream</code></h2><p><b>Motion without end.</b> The client sends "
    yield "settings, at any time those that change; the service answers, and sends a pose for each frame.</p>"
    yield f"<pre>{escape(_STREAM.format(origin=origin))}</pre>"
    yield from _table(messages["settings"]["payload"]["properties"])
    for message in messages.values():
        yield f"<p>{_prose(message['summary'])}</p>"
        yield from _table(message["payload"].get("properties", {}) if message is not messages["settings"] else {})
    yield f"<p>{_prose(told['channels']['stream']['description'])}</p></section>"


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
