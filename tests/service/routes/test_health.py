"""Liveness, readiness and metrics."""

import httpx
import pytest


@pytest.mark.parametrize("path", ["/health/live", "/health/ready"])
def test_health_is_told_without_a_key(locked, path):
    assert httpx.get(f"{locked.url}{path}").status_code == 200
