"""Waiting for what other processes and threads do, instead of guessing how long it takes."""

import time
from collections.abc import Callable

import httpx


def until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    """Wait until `condition()` holds.

    Args:
        condition: asked again and again.
        seconds: after which waiting is given up; long, because machines may be busy.
    """
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "what was waited for didn't happen"
        time.sleep(0.02)


def requests_running(server) -> int:
    """How many requests a service is answering, beside the one that asks."""
    lines = httpx.get(f"{server.url}/metrics").text.splitlines()
    return int(float(next(line.split()[1] for line in lines if line.startswith("motionenv_requests_running ")))) - 1
