"""Traces for OpenTelemetry: FastAPI makes a span of each request that is sampled; a collector gets them over OTLP."""

import re
from typing import Any

from motionenv import MotionError, __version__

_TRACEPARENT = re.compile(rb"00-(?!0{32})([0-9a-f]{32})-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}")


def tracer_provider(address: str, share: float) -> Any:
    """OpenTelemetry's provider of tracers for FastAPI.

    Args:
        address: of the collector, OTLP over HTTP: http://localhost:4318/v1/traces.
        share: of the requests without a `traceparent` that are traced; those with one follow its flag.

    Raises:
        MotionError: OpenTelemetry's packages are missing.
    """
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
        from opentelemetry.sdk.trace.sampling import ParentBased, TraceIdRatioBased
    except ImportError as error:
        raise MotionError(f"traces need {error.name}: pip install 'motionenv[telemetry]'") from None
    resource = Resource.create({"service.name": "motionenv", "service.version": __version__})
    provider = TracerProvider(ParentBased(TraceIdRatioBased(share)), resource, shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(address)))
    return provider


def trace_of(header: bytes | None) -> str | None:
    """Id of the client's trace in its header `traceparent` (W3C Trace Context), which is ignored if malformed."""
    found = header and _TRACEPARENT.fullmatch(header)
    return found[1].decode() if found else None
