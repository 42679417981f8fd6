"""Requests that nobody thought of: everything that the OpenAPI allows, and what it forbids, by schemathesis.

The long run: pytest -m benchmark tests/service/hostile/test_requests.py (10,000 requests and more).
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def fuzzed(server, folder: Path, *options: str) -> int:
    """How many requests schemathesis made, none of which failed a check."""
    command = [
        sys.executable, "-m", "schemathesis.cli", "--config-file", str(HERE / "schemathesis.toml"), "run",
        f"{server.url}/openapi.json", "--header", f"Authorization: Bearer {server.key}", "--seed", "1", *options,
    ]  # fmt: skip
    environment = os.environ | {
        "SCHEMATHESIS_HOOKS": "tests.service.hostile.schemathesis_hooks",
        "PYTHONPATH": str(HERE.parents[1]),
    }
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    told = "\n".join(line[:1000] for line in (done.stdout + done.stderr).splitlines())
    assert done.returncode == 0, told[-20_000:]
    assert server.http.get("/health/live").status_code == 200
    assert not server.events("request failed")
    return int(re.search(r"(\d+) generated", done.stdout)[1])


@pytest.fixture
def fuzzable(serving, tmp_path):
    """A service whose queue takes all jobs, and gives none of them long."""
    settings = {"keys": ["a-key-that-only-tests-know"], "job_waiting": 1_000_000, "job_seconds": 2}
    with serving(tmp_path / "data", max_frames=3000, max_pixels=320 * 240, **settings) as running:
        while running.http.post("/v1/tree/samples", json={}).status_code == 503:  # until the tree is made
            time.sleep(0.5)
        yield running


@pytest.mark.slow
def test_a_few_hundred_requests(fuzzable, tmp_path):
    assert fuzzed(fuzzable, tmp_path, "--max-examples", "3") > 300


@pytest.mark.benchmark
def test_ten_thousand_requests(fuzzable, tmp_path):
    assert fuzzed(fuzzable, tmp_path, "--max-examples", "400", "--continue-on-failure") > 10_000
