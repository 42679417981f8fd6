"""Server processes for the benchmarks of the service, and their CPU time and memory."""

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

from benchmarks import ROOT

KEY = "a-key-that-only-benchmarks-know"
_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Served:
    """A running server.

    Attributes:
        url: address of the server.
        process: its main process.
        seconds: time from start to readiness.
        log: file of its output.
    """

    url: str
    process: subprocess.Popen
    seconds: float
    log: Path

    def client(self, timeout: float = 60.0) -> httpx.Client:
        """An HTTP client with the key."""
        return httpx.Client(base_url=self.url, timeout=timeout, headers={"Authorization": f"Bearer {KEY}"})

    def processes(self) -> list[int]:
        """Ids of the main process and its descendants."""
        found, new = [], [self.process.pid]
        while new:
            found += new
            new = [int(child) for pid in new for child in _children(pid)]
        return found

    def cpu(self) -> float:
        """CPU time [s] of its processes."""
        return sum(_cpu(pid) for pid in self.processes())

    def memory(self) -> float:
        """Resident memory of its processes [MB]."""
        return sum(_resident(pid) for pid in self.processes())


@contextmanager
def service(data: Path, **settings: object) -> Iterator[Served]:
    """Run `motionenv serve` with a key, metrics and a log file; stop it with SIGTERM.

    Args:
        data: the service's data folder.
        settings: settings of the service.
    """
    values = {"port": 0, "keys": [KEY], "data": str(data)} | settings
    names = {f"MOTIONENV_SERVICE_{k.upper()}": v if isinstance(v, str) else json.dumps(v) for k, v in values.items()}
    with running([sys.executable, "-m", "service"], names, "/health/ready") as served:
        yield served


@contextmanager
def running(command: list[str], names: dict[str, str], ready: str) -> Iterator[Served]:
    """Run a server that logs `running on` and its address.

    Args:
        command: command that starts the server.
        names: environment variables.
        ready: path that returns 200 once the server is ready.
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
    """Used and total CPU time [s] of the machine, over all cores."""
    fields = [float(x) / _TICKS for x in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    idle = fields[3] + fields[4]
    return sum(fields) - idle, sum(fields)


def _address(process: subprocess.Popen, log: Path) -> str:
    """Wait for the address of a starting server in its log."""
    while process.poll() is None:
        if found := re.search(r"running on (http://[^\s\"]+)", log.read_text()):
            return found[1]
        time.sleep(0.01)
    raise SystemExit(f"the server didn't start:\n{log.read_text()}")


def _ready(url: str) -> bool:
    """Whether a URL returns 200. With several workers, connections are refused until these run."""
    try:
        return httpx.get(url).status_code == 200
    except httpx.ConnectError:
        return False


def _children(pid: int) -> list[str]:
    return [child for task in Path(f"/proc/{pid}/task").glob("*/children") for child in task.read_text().split()]


def _cpu(pid: int) -> float:
    """User and system CPU time [s]; the name of the process, in brackets, may contain blanks."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _resident(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
