"""What Prometheus is told, read by its own parser."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from service.observability.metrics import Metrics
from tests.service.waiting import until

ROOT = Path(__file__).parents[2]

ASK = {"seed": 1, "seconds": 0.1}


def test_threads_in_use_are_counted(server):
    held = lambda: float(re.search(rb"^motionenv_threads_held (\S+)", server.http.get("/metrics").content, re.M)[1])
    film = {**ASK, "seconds": 10, "picture": {"width": 640, "height": 480}}
    with server.http.stream("POST", "/v1/synthesis", json=film, headers={"Accept": "video/mp4"}):
        assert held() == 1
    until(lambda: held() == 0)


def samples(text: bytes) -> dict[tuple, float]:
    """Values by name and labels."""
    families = text_string_to_metric_families(text.decode())
    return {(s.name, *sorted(s.labels.items())): s.value for family in families for s in family.samples}


def test_requests_are_counted_by_method_route_and_status():
    metrics, seconds = Metrics(), [0.0005, 0.003, 0.2, 100.0]
    for value in seconds:
        metrics.count("GET", "/v1/models", 200, value)
    metrics.count("POST", "/v1/models", 503, 0.2)
    metrics.count_jobs({"queued": 3})
    told, route = samples(metrics.text()), ("route", "/v1/models")
    total = "motionenv_requests_total"
    assert told[total, ("method", "GET"), route, ("status", "200")] == 4
    assert told[total, ("method", "POST"), route, ("status", "503")] == 1
    assert told["motionenv_request_seconds_sum", route] == pytest.approx(sum(seconds) + 0.2)
    for bound in (0.001, 0.005, 0.25, 60.0, float("inf")):
        name = "motionenv_request_seconds_bucket"
        (found,) = [v for k, v in told.items() if k[0] == name and float(dict(k[1:])["le"]) == bound]
        assert found == sum(value <= bound for value in [*seconds, 0.2])
    assert told["motionenv_jobs", ("status", "queued")] == 3


COUNTING = """
import sys
from service.observability.metrics import Metrics
from tests.service.waiting import until
metrics = Metrics()
for _ in range(int(sys.argv[1])):
    metrics.count("GET", "/", 200, 0.1)
metrics.running.inc()
sys.stdout.buffer.write(metrics.text())
"""


def test_server_processes_tell_the_sum_of_all(tmp_path):
    environment = os.environ | {"PROMETHEUS_MULTIPROC_DIR": str(tmp_path)}
    for count, total in ((2, 2), (3, 5)):
        command = [sys.executable, "-c", COUNTING, str(count)]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=True)
        told = samples(done.stdout)
        assert told["motionenv_requests_total", ("method", "GET"), ("route", "/"), ("status", "200")] == total
