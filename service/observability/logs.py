"""Logs as JSON lines on stderr, uvicorn's included."""

import logging
import sys
from datetime import UTC, datetime

import orjson
import structlog


def configure() -> None:
    """Send what structlog and the standard library log to stderr as JSON."""
    shared: list = [structlog.processors.add_log_level, _stamped, structlog.processors.format_exc_info]
    structlog.configure(
        processors=[*shared, structlog.processors.JSONRenderer(serializer=_serialized)],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        logger_factory=structlog.BytesLoggerFactory(sys.stderr.buffer),
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(sys.stderr)
    renderer = structlog.processors.JSONRenderer(serializer=lambda *a, **k: _serialized(*a, **k).decode())
    handler.setFormatter(structlog.stdlib.ProcessorFormatter(foreign_pre_chain=shared, processors=[
        structlog.stdlib.ProcessorFormatter.remove_processors_meta, renderer,
    ]))  # fmt: skip
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.INFO)
    logging.captureWarnings(True)  # Python prints them as text


def _stamped(_logger: object, _method: str, event: structlog.types.EventDict) -> structlog.types.EventDict:
    """Add a timestamp, formatted by orjson, which is faster than Python."""
    event["timestamp"] = datetime.now(UTC)
    return event


def _serialized(event: object, default=None, **_: object) -> bytes:
    return orjson.dumps(event, default=repr, option=orjson.OPT_NON_STR_KEYS | orjson.OPT_UTC_Z)
