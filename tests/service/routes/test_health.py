"""Liveness, readiness and metrics."""

import asyncio

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from service.app import create_app
from service.settings import Settings


@pytest.mark.parametrize("path", ["/health/live", "/health/ready"])
def test_health_is_told_without_a_key(locked, path):
    assert httpx.get(f"{locked.url}{path}").status_code == 200


def test_nothing_is_ready_before_the_models_are_loaded_and_after_the_end(tmp_path):
    app = create_app(Settings(data=tmp_path))

    async def ask() -> list[httpx.Response]:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            found = [await client.get("/health/ready"), await client.get("/health/live")]
            async with app.router.lifespan_context(app):
                found.append(await client.get("/health/ready"))
            return [*found, await client.get("/health/ready"), await client.get("/health/live")]

    early, alive, ready, late, still = asyncio.run(ask())
    for answer in (early, late):
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "1")
        assert answer.headers["content-type"] == "application/problem+json"
        assert "models are being loaded" in answer.json()["detail"]
    assert (ready.status_code, ready.json()) == (200, {"status": "ready"})
    assert alive.json() == still.json() == {"status": "alive"}


def test_metrics_are_text_that_prometheus_reads(server):
    answer = server.http.get("/metrics")
    assert answer.headers["content-type"] == "text/plain; version=1.0.0; charset=utf-8"
    families = {family.name: family for family in text_string_to_metric_families(answer.text)}
    running = families["motionenv_requests_running"].samples[0].value
    assert running >= 1  # this one
    assert {"motionenv_requests", "motionenv_request_seconds", "motionenv_jobs"} <= set(families)
