"""Load tests with the program wrk (`apt install wrk`, `brew install wrk`)."""

import re
import resource
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks import Skipped
from benchmarks.service.servers import KEY, Served, machine

SYNTHESIS = ("/v1/synthesis", '{"seed":%d,"seconds":4,"fps":30}')
SAMPLES = ("/v1/tree/samples", '{"seed":%d,"n":300,"start":"walk"}')
_CONNECTIONS = 16
_SCRIPT = """
local n = %d
request = function()
  n = n + 1
  return wrk.format("POST", "%s", {
    ["Content-Type"] = "application/json", ["Authorization"] = "Bearer %s", ["Accept"] = "%s"
  }, string.format('%s', n))
end
"""


@dataclass
class Load:
    """Result of a load test.

    Attributes:
        per_second: requests per second.
        p50: median latency [ms].
        p99: 99th percentile of the latency [ms].
        cpu: CPU time per request of all processes of the server [µs].
        count: number of requests.
        wrong: number of requests without status 200.
        others: share of the machine's CPU time used by neither server nor wrk.
    """

    per_second: float
    p50: float
    p99: float
    cpu: float
    count: int
    wrong: int
    others: float


def median(loads: Sequence[Load]) -> Load:
    """The median of each attribute; `count` and `wrong` are sums."""
    middle = {name: statistics.median(getattr(load, name) for load in loads)
              for name in ("per_second", "p50", "p99", "cpu", "others")}  # fmt: skip
    return Load(**middle, count=sum(load.count for load in loads), wrong=sum(load.wrong for load in loads))


def load(
    server: Served, what: tuple[str, str], accept: str, seconds: int, *, path: str | None = None, first: int = 0
) -> Load:
    """Send requests to a server over 16 connections.

    Args:
        server: the server.
        what: path, and body with %d for the seed, which increases with each request.
        accept: media type of the response.
        seconds: duration.
        path: overrides the path in `what`.
        first: first seed.
    """
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder:
        script = Path(folder, "load.lua")
        script.write_text(_SCRIPT % (first, path or what[0], KEY, accept, what[1]))
        command = ["wrk", "-t1", f"-c{_CONNECTIONS}", f"-d{seconds}s", "--timeout", "10s", "--latency", "-s",
                   str(script), server.url]  # fmt: skip
        own, wrk, (busy, all_) = server.cpu(), _of_children(), machine()
        told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        spent, asking, (busy_after, all_after) = server.cpu() - own, _of_children() - wrk, machine()
    count = int(_number(told, r"(\d+) requests in"))
    wrong = _number(told, r"Non-2xx or 3xx responses: (\d+)") + sum(
        int(n) for n in re.findall(r"(?:connect|read|write|timeout) (\d+)", told)
    )
    return Load(
        per_second=_number(told, r"Requests/sec:\s+([\d.]+)"),
        p50=_milliseconds(told, "50%"),
        p99=_milliseconds(told, "99%"),
        cpu=spent / max(count, 1) * 1e6,
        count=count,
        wrong=int(wrong),
        others=max(0.0, busy_after - busy - spent - asking) / (all_after - all_),
    )


def check_wrk() -> None:
    """Skip the benchmark if wrk is missing."""
    if shutil.which("wrk") is None:
        raise Skipped("the program wrk is missing: apt install wrk, or brew install wrk")


def _of_children() -> float:
    """CPU time [s] of child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _number(text: str, pattern: str) -> float:
    found = re.search(pattern, text)
    return float(found[1]) if found else 0.0


def _milliseconds(text: str, share: str) -> float:
    found = re.search(rf"{share}\s+([\d.]+)(us|ms|s|m)\b", text)
    return float(found[1]) * {"us": 1e-3, "ms": 1.0, "s": 1e3, "m": 6e4}[found[2]] if found else float("nan")
