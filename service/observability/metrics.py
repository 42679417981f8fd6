"""Prometheus metrics of one process, or of all workers if PROMETHEUS_MULTIPROC_DIR is set."""

import os
from collections.abc import Mapping
from functools import partial

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.multiprocess import MultiProcessCollector

_SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
STATUSES = ("queued", "running", "done", "failed", "cancelled")
MEDIA_TYPE = "text/plain; version=1.0.0; charset=utf-8"


class Metrics:
    """Metrics of a service."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self._requests = Counter(
            "motionenv_requests", "Requests.", ("method", "route", "status"), registry=self.registry
        )
        self._seconds = Histogram(
            "motionenv_request_seconds", "Time to the end of the response.", ("route",), buckets=_SECONDS,
            registry=self.registry,
        )  # fmt: skip
        gauge = partial(Gauge, registry=self.registry, multiprocess_mode="livesum")
        latest = partial(Gauge, registry=self.registry, multiprocess_mode="livemostrecent")
        self.running = gauge("motionenv_requests_running", "Requests in progress.")
        self.computing = gauge("motionenv_threads_held", "Requests that hold or await a thread.")
        self._jobs = latest("motionenv_jobs", "Jobs by status.", ("status",))
        self._children: dict[tuple[str, str, int], tuple[Counter, Histogram]] = {}

    def count(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request to a template of a path; its status is 0 if the client disconnected before the response."""
        key = (method, route, status)
        if key not in self._children:
            self._children[key] = self._requests.labels(*map(str, key)), self._seconds.labels(route)
        requests, histogram = self._children[key]
        requests.inc()
        histogram.observe(seconds)

    def count_jobs(self, counts: Mapping[str, int]) -> None:
        """Tell how many jobs there are, by status."""
        for status in STATUSES:
            self._jobs.labels(status).set(counts.get(status, 0))

    def text(self) -> bytes:
        """All metrics in the text format of Prometheus."""
        if "PROMETHEUS_MULTIPROC_DIR" not in os.environ:
            return generate_latest(self.registry)
        every = CollectorRegistry()
        MultiProcessCollector(every)
        return generate_latest(every)
