"""`/asyncapi.json`: the stream, which OpenAPI has no words for (AsyncAPI 3.0)."""

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

from motionenv import __version__
from motionenv.types import POSE
from service.errors import FieldProblem
from service.schemas.stream import StreamSettings

router = APIRouter(include_in_schema=False)
#: Why a stream ends, by its close code.
CLOSES = {
    1000: "the client closed it",
    1003: "a message was binary: settings are text",
    1007: "a message wasn't a JSON object",
    1008: "no settings came within 10 s, or a key is missing",
    1012: "the service restarts",
}


@router.get("/asyncapi.json")
async def describe_stream(request: Request) -> Response:
    """The AsyncAPI document."""
    return JSONResponse(document(request.url.netloc, request.url.scheme == "https"))


def document(host: str, secure: bool) -> dict[str, Any]:
    """The AsyncAPI document of the service at `host`."""
    closes = "; ".join(f"{code}: {why}" for code, why in CLOSES.items())
    return {
        "asyncapi": "3.0.0",
        "info": {"title": "motionenv", "version": __version__, "description": "Poses without end, in real time."},
        "defaultContentType": "application/json",
        "servers": {"this": {"host": host, "protocol": "wss" if secure else "ws"}},
        "channels": {"stream": {
            "address": "/v1/stream",
            "description": "Too many streams: the handshake is answered by 503 with Retry-After. "
            f"Close codes: {closes}.",
            "messages": {name: {"$ref": f"#/components/messages/{name}"} for name in _MESSAGES},
        }},
        "operations": {
            "changeSettings": _operation("receive", "settings"),
            "sendMotion": _operation("send", "accepted", "problem", "pose"),
        },
        "components": {"messages": _MESSAGES},
    }  # fmt: skip


def _operation(action: str, *messages: str) -> dict[str, Any]:
    """What the service does with some messages."""
    refs = [{"$ref": f"#/channels/stream/messages/{name}"} for name in messages]
    return {"action": action, "channel": {"$ref": "#/channels/stream"}, "messages": refs}


_MESSAGES: dict[str, dict[str, Any]] = {
    "settings": {
        "summary": "Settings that change; the first message begins the motion.",
        "payload": StreamSettings.model_json_schema(),
        "examples": [{"payload": {"model": "walk/fpca", "seed": 7, "fps": 60}}, {"payload": {"speed": 1.6}}],
    },
    "accepted": {
        "summary": "The answer to settings.",
        "payload": {
            "type": "object",
            "required": ["type", "fps", "height", "pose"],
            "properties": {
                "type": {"const": "settings"},
                "fps": {"type": "number", "description": "Frames per second."},
                "height": {"type": "number", "description": "Body height [m]."},
                "pose": {"const": list(POSE), "description": "Names of a pose's entries."},
            },
        },
    },
    "problem": {
        "summary": "Why settings can't be used; the motion goes on as it was.",
        "payload": {
            "type": "object",
            "required": ["type", "detail", "errors"],
            "properties": {
                "type": {"const": "problem"},
                "detail": {"type": "string"},
                "errors": {"type": "array", "items": FieldProblem.model_json_schema()},
            },
        },
    },
    "pose": {
        "summary": "One pose: 25 little-endian float32 [m, rad] in the order of `pose`, as a binary message.",
        "contentType": "application/octet-stream",
        "payload": {"type": "string", "format": "binary", "minLength": 100, "maxLength": 100},
    },
}
