"""Servers for the benchmarks of the service, each a process of its own, and what they take of the machine."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

ROOT = Path(__file__).parents[1]
KEY = "a-key-that-only-benchmarks-know"
_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Served:
    """A running server.

    Attributes:
        url: where it listens.
        process: the first of its processes.
        seconds: from its start until it was ready.
        log: what it says goes there.
    """

    url: str
    process: subprocess.Popen
    seconds: float
    log: Path

    def client(self, timeout: float = 60.0) -> httpx.Client:
        """An HTTP client with the key."""
        return httpx.Client(base_url=self.url, timeout=timeout, headers={"Authorization": f"Bearer {KEY}"})

    def processes(self) -> list[int]:
        """Ids of its processes."""
        found, new = [], [self.process.pid]
        while new:
            found += new
            new = [int(child) for pid in new for child in _children(pid)]
        return found

    def cpu(self) -> float:
        """Seconds of CPU that its processes have taken."""
        return sum(_cpu(pid) for pid in self.processes())

    def memory(self) -> float:
        """Resident memory of its processes [MB]."""
        return sum(_resident(pid) for pid in self.processes())


@contextmanager
def service(data: Path, **settings: object) -> Iterator[Served]:
    """`motionenv serve` with keys, metrics and its log in a file, stopped at the end as an operator would.

    Args:
        data: folder of its files.
        settings: of the service.
    """
    values = {"port": 0, "keys": [KEY], "data": str(data)} | settings
    names = {f"MOTIONENV_SERVICE_{k.upper()}": v if isinstance(v, str) else json.dumps(v) for k, v in values.items()}
    with running([sys.executable, "-m", "service"], names, "/health/ready") as served:
        yield served


@contextmanager
def running(command: list[str], names: dict[str, str], ready: str) -> Iterator[Served]:
    """A server that says where it is `running on`.

    Args:
        command: that starts it.
        names: environment variables.
        ready: path that answers 200 once it is.
    """
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder:
        log, begun = Path(folder, "log"), time.perf_counter()
        with log.open("wb") as file:
            environment = os.environ | {"OMP_NUM_THREADS": "1"} | names
            process = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=file, stdout=file)
        try:
            url = _address(process, log)
            while not _ready(url + ready):
                time.sleep(0.01)
            yield Served(url, process, time.perf_counter() - begun, log)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)


def machine() -> tuple[float, float]:
    """Seconds of CPU that all processes have taken, and that there were, on all cores."""
    fields = [float(x) / _TICKS for x in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    idle = fields[3] + fields[4]
    return sum(fields) - idle, sum(fields)


def _address(process: subprocess.Popen, log: Path) -> str:
    """Where a server that starts will listen."""
    while process.poll() is None:
        if found := re.search(r"running on (http://[^\s\"]+)", log.read_text()):
            return found[1]
        time.sleep(0.01)
    raise SystemExit(f"the server didn't start:\n{log.read_text()}")


def _ready(url: str) -> bool:
    """Whether 200 comes; several workers are only listened to when they run."""
    try:
        return httpx.get(url).status_code == 200
    except httpx.ConnectError:
        return False


def _children(pid: int) -> list[str]:
    return [child for task in Path(f"/proc/{pid}/task").glob("*/children") for child in task.read_text().split()]


def _cpu(pid: int) -> float:
    """User's and system's seconds; the name of a process, which is in brackets, may hold blanks."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _resident(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
