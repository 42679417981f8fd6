"""A real service on a real port, in a process of its own."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

ROOT = Path(__file__).parents[2]
#: Runs a command without root's right to read and write every file, which would hide mistakes.
ORDINARY = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.getuid() == 0 else []


@dataclass
class Server:
    """A running service: address, files, process, the lines that it logged, and a client with its key, if any."""

    url: str
    data: Path
    process: subprocess.Popen
    lines: list[str]
    http: httpx.Client
    key: str | None

    def events(self, event: str) -> list[dict]:
        """What was logged as `event`."""
        return [logged for line in self.lines if (logged := json.loads(line)).get("event") == event]


@contextmanager
def run_service(data: Path, **settings: object) -> Iterator[Server]:
    """A service with `settings` and its files in `data`, stopped at the end as an operator would."""
    values = {"port": 0, "data": data} | settings
    names = {f"MOTIONENV_SERVICE_{name.upper()}": v if isinstance(v, str) else json.dumps(v, default=str)
             for name, v in values.items()}  # fmt: skip
    names["MOTIONENV_SERVICE_DATA"] = str(data)
    process = subprocess.Popen(
        [*ORDINARY, sys.executable, "-m", "service"], cwd=ROOT, env=os.environ | names, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    lines: list[str] = []
    started = threading.Event()
    address: list[str] = []

    def read() -> None:
        for line in process.stderr:  # type: ignore[union-attr]
            lines.append(line)
            if found := re.search(r"running on (http://[^\s\"]+)", line):
                address.append(found[1])
                started.set()
        started.set()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    started.wait(180)  # kernels are compiled where no cache has them
    assert address, "".join(lines)
    try:
        key = next(iter(values.get("keys", ())), None)
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        with httpx.Client(base_url=address[0], timeout=120, headers=headers) as client:
            yield Server(address[0], data, process, lines, client, key)
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(40) in (0, -signal.SIGTERM)
        reader.join(5)
        process.stderr.close()  # type: ignore[union-attr]


def raw(url: str, *parts: bytes, pause: float = 0.0, wait: float = 15.0) -> tuple[bytes, float]:
    """What a server answers to bytes sent one part after the other, and after how many seconds it hangs up."""
    host, port = url.removeprefix("http://").split(":")
    begun = time.monotonic()
    with socket.create_connection((host, int(port)), timeout=wait) as connection:
        answer = b""
        try:
            for part in parts:
                connection.sendall(part)
                time.sleep(pause)
            while data := connection.recv(65536):
                answer += data
        except (ConnectionResetError, BrokenPipeError):
            pass
    return answer, time.monotonic() - begun
