"""Spans reach a collector, with the client's trace, and only those that are wanted."""

import asyncio
import gzip
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode

from service.app import create_app
from service.observability.tracing import trace_of
from service.settings import Settings
from tests.service.running import run_service
from tests.service.waiting import until

TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"


@contextmanager
def collector() -> Iterator[tuple[str, list]]:
    """The address of a collector, and the spans that it has received, by OpenTelemetry's own protocol buffers."""
    spans: list = []

    class Collector(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            if self.headers.get("Content-Encoding") == "gzip":
                body = gzip.decompress(body)
            for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
                for scope in resource.scope_spans:
                    spans.extend((resource.resource, span) for span in scope.spans)
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Collector)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/v1/traces", spans
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def attributes(thing) -> dict:
    return {one.key: getattr(one.value, one.value.WhichOneof("value")) for one in thing.attributes}


def test_spans_of_requests_reach_the_collector(tmp_path):
    with collector() as (address, spans):
        with run_service(tmp_path, traces=address, trace_share=0.0) as server:
            for flag in ("01", "00"):  # sampled by the client, and not
                header = {"traceparent": f"00-{TRACE}-{SPAN}-{flag}"}
                assert server.http.get("/v1/models/walk/fpca", headers=header).status_code == 200
            server.http.get("/v1/body")  # not in the share
            until(lambda: len(server.events("request")) >= 3)
            assert [event["trace"] for event in server.events("request")] == [TRACE, TRACE, None]
        assert len(spans) == 1  # the service sends what is left when it ends
    (resource, span), told = spans[0], attributes(spans[0][1])
    assert attributes(resource)["service.name"] == "motionenv"
    assert (span.trace_id.hex(), span.parent_span_id.hex()) == (TRACE, SPAN)
    assert span.span_id.hex() not in (SPAN, "0" * 16)
    assert span.name == "GET /v1/models/{group}/{name}"
    assert (told["http.route"], told["http.response.status_code"]) == ("/v1/models/{group}/{name}", 200)
    assert 0 < span.end_time_unix_nano - span.start_time_unix_nano < 30e9


def test_a_share_is_traced_and_failures_are_marked(tmp_path):
    app = create_app(Settings(data=tmp_path, traces="http://127.0.0.1:9/v1/traces", trace_share=0.25))
    app.add_api_route("/defect", lambda: 1 / 0)
    tracing = app.state.service.tracing
    spans = InMemorySpanExporter()
    tracing.add_span_processor(SimpleSpanProcessor(spans))

    async def ask() -> None:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            for _ in range(400):
                await client.get("/health/live")
            await client.get("/defect", headers={"traceparent": f"00-{TRACE}-{SPAN}-01"})

    asyncio.run(ask())
    *fine, bad = spans.get_finished_spans()
    assert 60 < len(fine) < 140
    assert {span.status.status_code for span in fine} == {StatusCode.UNSET}
    assert (bad.name, bad.status.status_code) == ("GET /defect", StatusCode.ERROR)


@pytest.mark.slow
def test_a_collector_that_is_gone_costs_no_answer(tmp_path):
    with run_service(tmp_path, traces="http://127.0.0.1:9/v1/traces", trace_share=1.0) as server:
        assert all(server.http.get("/v1/body").status_code == 200 for _ in range(20))


@pytest.mark.parametrize(
    ("header", "found"),
    [
        (f"00-{TRACE}-{SPAN}-01", TRACE), (f"00-{TRACE}-{SPAN}-02", TRACE), (f"00-{TRACE.upper()}-{SPAN}-01", None),
        (f"00-{'0' * 32}-{SPAN}-01", None), (f"00-{TRACE}-{'0' * 16}-01", None), (f"00-{TRACE}-{SPAN}", None),
        ("", None),
    ],
)  # fmt: skip
def test_only_what_the_standard_allows_is_a_trace(header, found):
    assert trace_of(header.encode()) == found
    assert trace_of(None) is None
