"""More than can be done, by clients that are slow, many, or gone: health is told throughout, and memory comes back.

The long run: pytest -m benchmark -s tests/service/hostile/test_load.py (200 renders at once, in two ways).
"""

import asyncio
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import httpx
import numpy as np
import psutil
import pytest

from tests.service.waiting import until

FILM = {"seed": 1, "seconds": 1, "fps": 30, "picture": {"width": 320, "height": 240}}
MP4 = {"Accept": "video/mp4"}


@dataclass
class Rush:
    """What came of many renders at once.

    Attributes:
        statuses: how many answers of each.
        health: seconds of each look at /health/live meanwhile.
        seconds: until all were answered.
        growth: of the memory, from before to after [MB].
    """

    statuses: Counter
    health: np.ndarray
    seconds: float
    growth: float


def memory(server) -> float:
    """Resident [MB]."""
    return psutil.Process(server.process.pid).memory_info().rss / 1e6


async def _rush(server, count: int) -> Rush:
    """`count` films at once; those that are refused must be told when to come again."""
    limits = httpx.Limits(max_connections=count + 8)
    async with httpx.AsyncClient(
        base_url=server.url, timeout=300, limits=limits, headers=server.http.headers
    ) as client:
        await client.post("/v1/synthesis", json=FILM, headers=MP4)  # what is only loaded once
        before = memory(server)

        async def film(seed: int) -> int:
            answer = await client.post("/v1/synthesis", json=FILM | {"seed": seed}, headers=MP4)
            if answer.status_code == 200:
                assert answer.content[4:8] == b"ftyp"
            else:
                assert int(answer.headers["retry-after"]) >= 1
                assert answer.headers["content-type"] == "application/problem+json"
            return answer.status_code

        with looking(server) as health:
            begun = time.perf_counter()
            statuses = Counter(await asyncio.gather(*(film(seed) for seed in range(count))))
            seconds = time.perf_counter() - begun
    return Rush(statuses, np.array(health), seconds, memory(server) - before)


_LOOKING = """
import sys, time, httpx
with httpx.Client(base_url=sys.argv[1], timeout=60) as client:
    while True:
        begun = time.perf_counter()
        client.get("/health/live").raise_for_status()
        print(time.perf_counter() - begun, flush=True)
        time.sleep(0.02)
"""


@contextmanager
def looking(server) -> Iterator[list[float]]:
    """Seconds of each look at /health/live within the block, by a process that does nothing else."""
    health: list[float] = []
    with subprocess.Popen([sys.executable, "-c", _LOOKING, server.url], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()  # its own start
        yield health
        process.terminate()
        health += [float(line) for line in process.stdout.read().splitlines()]
    assert process.returncode == -signal.SIGTERM


def rush(server, count: int) -> Rush:
    """Many renders at once; run twice, as the allocator keeps what the first took."""
    asyncio.run(_rush(server, count))
    return asyncio.run(_rush(server, count))


@pytest.fixture(scope="module")
def small(serving, tmp_path_factory) -> Iterator:
    """A service with few places."""
    with serving(tmp_path_factory.mktemp("load"), threads=2, waiting=4) as running:
        yield running


def test_more_films_than_there_are_places_are_refused_and_health_is_told(small):
    found = rush(small, 20)
    assert found.statuses[200] >= 6
    assert found.statuses[503] == 20 - found.statuses[200]
    assert np.percentile(found.health, 99) < 1  # 250 ms on a quiet machine: see the long run
    assert found.growth < 40


def test_without_a_key_nothing_of_the_document_answers(locked):
    paths = locked.http.get("/openapi.json").json()["paths"]
    asked = 0
    for path, methods in paths.items():
        for method in methods:
            where = path.replace("{", "").replace("}", "")
            answer = httpx.request(method.upper(), locked.url + where, json={} if method == "post" else None)
            free = path.startswith("/health/")
            assert (answer.status_code == 200) if free else (answer.status_code == 401), (method, path)
            asked += 1
    assert asked >= 20
    assert httpx.request("GET", f"{locked.url}/v1/stream", headers=_upgrade()).status_code in (401, 403)


def _upgrade() -> dict[str, str]:
    return {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}  # fmt: skip


def vanished(server, count: int) -> float:
    """Seconds until nothing runs any more for so many clients that ask for a minute's film and hang up."""
    host, port = server.url.removeprefix("http://").split(":")
    body = b'{"seed":1,"seconds":60,"fps":30,"picture":{"width":640,"height":480}}'
    head = b"POST /v1/synthesis HTTP/1.1\r\nhost: localhost\r\naccept: video/mp4\r\ncontent-type: application/json\r\n"
    if server.key:
        head += f"authorization: Bearer {server.key}\r\n".encode()
    clients = [socket.create_connection((host, int(port))) for _ in range(count)]
    for client in clients:
        client.sendall(head + b"content-length: %d\r\n\r\n" % len(body) + body)
    assert clients[0].recv(100).startswith(b"HTTP/1.1 200")
    for client in clients:
        client.close()
    gone = time.monotonic()
    while busy(server):
        assert time.monotonic() - gone < 20
        time.sleep(0.02)
    return time.monotonic() - gone


def test_who_asks_and_hangs_up_leaves_nothing_running(small):
    assert vanished(small, 5) < 4  # 1 s on a quiet machine: see the long run
    assert small.http.post("/v1/synthesis", json=FILM, headers=MP4).status_code == 200


def test_who_does_not_read_holds_up_nobody(small):
    """As many as there are threads, and one more, ask for more than their sockets hold, and read nothing."""
    host, port = small.url.removeprefix("http://").split(":")
    body = b'{"seed":1,"seconds":1000,"fps":30}'
    head = b"POST /v1/synthesis HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"
    clients = [socket.create_connection((host, int(port))) for _ in range(3)]
    for client in clients:
        client.sendall(head + b"content-length: %d\r\n\r\n" % len(body) + body)
    until(lambda: busy(small))
    assert small.http.post("/v1/synthesis", json=FILM, headers=MP4, timeout=10).status_code == 200
    for client in clients:
        client.close()


def busy(server) -> bool:
    """Whether any request runs but the one that asks."""
    lines = server.http.get("/metrics").text.splitlines()
    return any(line.startswith("motionenv_requests_running") and float(line.split()[1]) > 1 for line in lines)


@pytest.mark.benchmark
def test_two_hundred_renders_at_once(serving, tmp_path, capsys):
    with serving(tmp_path, keys=["a-key-that-only-tests-know"]) as running:
        found, seconds = rush(running, 200), [vanished(running, 20) for _ in range(5)]
    told = {status: found.statuses[status] for status in sorted(found.statuses)}
    p50, p99 = np.percentile(found.health, [50, 99]) * 1000
    with capsys.disabled():
        sys.stdout.write(
            f"\n200 films at once: {told} in {found.seconds:.1f} s; /health/live p50 {p50:.0f} ms, p99 {p99:.0f} ms, "
            f"worst {found.health.max() * 1000:.0f} ms of {len(found.health)}; memory {found.growth:+.0f} MB\n"
            f"20 clients that hang up: nothing runs after {', '.join(f'{s:.2f}' for s in seconds)} s\n"
        )
    assert set(told) <= {200, 429, 503}
    assert p99 < 250
    assert max(seconds) < 1
    assert found.growth < 40
