"""Traces for OpenTelemetry: a span for each request that is sampled, sent to a collector over OTLP.

Spans are made when a request ends, and another thread sends them: what that costs is measured by
`motionenv bench service.tracing`. Needs `motionenv[telemetry]`.
"""

import random
import re
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from motionenv import MotionError, __version__

_PARENT = re.compile(rb"00-(?P<trace>[0-9a-f]{32})-(?P<span>[0-9a-f]{16})-(?P<flags>[0-9a-f]{2})")
_SAMPLED = 1  # the flag of W3C's Trace Context


class Parent(NamedTuple):
    """The span of a client that asks, from its header `traceparent` (W3C Trace Context)."""

    trace: str
    span: str
    sampled: bool


def parent_of(header: bytes | None) -> Parent | None:
    """The parent that a header names, or None; malformed ones and those of zeros are ignored, as the standard says."""
    found = header and _PARENT.fullmatch(header)
    if not found or not int(found["trace"], 16) or not int(found["span"], 16):
        return None
    return Parent(found["trace"].decode(), found["span"].decode(), bool(int(found["flags"], 16) & _SAMPLED))


class Tracer:
    """Sends spans to a collector.

    Args:
        address: of the collector, OTLP over HTTP: http://localhost:4318/v1/traces.
        share: of the requests without a `traceparent` that are traced; those with one follow its flag.

    Raises:
        MotionError: OpenTelemetry's packages are missing.
    """

    def __init__(self, address: str, share: float) -> None:
        try:
            from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
            from opentelemetry.sdk.resources import Resource
            from opentelemetry.sdk.trace.export import BatchSpanProcessor
        except ImportError as error:
            raise MotionError(f"traces need {error.name}: pip install 'motionenv[telemetry]'") from None
        self.share = share
        self._random = random.Random()  # ids of spans, which aren't part of any result
        self._resource = Resource.create({"service.name": "motionenv", "service.version": __version__})
        self._processor = BatchSpanProcessor(OTLPSpanExporter(address))

    def wants(self, parent: Parent | None) -> bool:
        """Whether to trace a request."""
        return parent.sampled if parent else self._random.random() < self.share

    def record(self, name: str, seconds: float, parent: Parent | None, failed: bool, about: Mapping[str, Any]) -> None:
        """Send the span of a request that has just ended.

        Args:
            name: its method and route.
            seconds: how long it took [s].
            parent: the client's span.
            failed: whether the service failed.
            about: attributes, by their names in OpenTelemetry's conventions.
        """
        from opentelemetry.sdk.trace import ReadableSpan
        from opentelemetry.trace import SpanContext, SpanKind, Status, StatusCode, TraceFlags

        flags, end = TraceFlags(TraceFlags.SAMPLED), time.time_ns()
        trace = int(parent.trace, 16) if parent else self._random.getrandbits(128)
        above = parent and SpanContext(trace, int(parent.span, 16), is_remote=True, trace_flags=flags)
        context = SpanContext(trace, self._random.getrandbits(64), is_remote=False, trace_flags=flags)
        status = Status(StatusCode.ERROR if failed else StatusCode.UNSET)
        self._processor.on_end(ReadableSpan(
            name, context, above, self._resource, about, kind=SpanKind.SERVER, status=status,
            start_time=end - int(seconds * 1e9), end_time=end,
        ))  # fmt: skip

    def close(self) -> None:
        """Send what is left."""
        self._processor.shutdown()
