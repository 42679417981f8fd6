"""A service of several processes, as on several machines: each has a data folder of its own."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tests.service.running import ORDINARY, ROOT, Server, run_service

BUCKET = "s3://sets"


class Worker:
    """A `motionenv work`."""

    def __init__(self, folder: Path, environment: dict[str, str], module: str, **settings: object):
        self.module = module
        values = {"data": folder, "job_memory": 2_000_000_000, "reserve": 0} | settings
        names = {f"MOTIONENV_SERVICE_{name.upper()}": str(value) for name, value in values.items()}
        self.environment, self.lines, self.ready = os.environ | environment | names, [], threading.Event()
        folder.mkdir(exist_ok=True)
        self.begin()

    def begin(self) -> None:
        """Start it, again if it was killed."""
        self.process = subprocess.Popen(
            [*ORDINARY, sys.executable, "-m", self.module], cwd=ROOT, env=self.environment, stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        self.ready.clear()
        threading.Thread(target=self._read, args=[self.process], daemon=True).start()

    def _read(self, process: subprocess.Popen) -> None:
        with process.stderr as said:  # type: ignore[union-attr]
            for line in said:
                self.lines.append(line)
                if "worker is ready" in line:
                    self.ready.set()

    def kill(self) -> None:
        """Kill it as a power cut would."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """Stop it as an operator would."""
        if self.process.poll() is None:
            self.ready.wait(60)  # before that it ends as any program does
            self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(40) in (0, -signal.SIGKILL)

    def events(self, event: str) -> list[dict]:
        """What it logged as `event`."""
        logged = [json.loads(line) for line in self.lines if line.startswith("{")]
        return [one for one in logged if one["event"] == event]


@contextmanager
def workers(
    folder: Path, number: int, environment: dict[str, str], module: str = "service.cluster", **settings: object
) -> Iterator[list[Worker]]:
    """Workers that are ready, with folders within one."""
    running = [Worker(folder / f"worker-{i}", environment, module, **settings) for i in range(number)]
    try:
        for worker in running:
            assert worker.ready.wait(60), worker.lines
        yield running
    finally:
        for worker in running:
            worker.stop()


@contextmanager
def servers(folder: Path, number: int, environment: dict[str, str], **settings: object) -> Iterator[list[Server]]:
    """Servers with folders within one; jobs run elsewhere."""
    with ExitStack() as stack:
        stack.enter_context(_environment(environment))
        yield [stack.enter_context(run_service(folder / f"server-{i}", **settings)) for i in range(number)]


@contextmanager
def _environment(more: dict[str, str]) -> Iterator[None]:
    """Environment variables for processes that start meanwhile."""
    before = dict(os.environ)
    os.environ.update(more)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
