"""Clients that send slowly, too much or for ever: what uvicorn bounds alone, and with the proxy of `service/deploy`."""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import httpx
import pytest
from websockets.sync.client import connect

from tests.service.running import raw
from tests.service.waiting import until

CADDYFILE = Path(__file__).parents[3] / "service" / "deploy" / "Caddyfile"
HEAD = b"POST /v1/synthesis HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"


@pytest.fixture(scope="module")
def proxy(server, tmp_path_factory) -> Iterator[str]:
    """The address of Caddy in front of a service; skips where it isn't installed, or fails if CI promised it."""
    caddy = shutil.which("caddy")
    if caddy is None:
        refuse = pytest.fail if os.environ.get("MOTIONENV_REQUIRE_CADDY") else pytest.skip
        refuse("Caddy isn't installed: apt-get install caddy")
    with socket.create_server(("127.0.0.1", 0)) as free:
        url = f"http://localhost:{free.getsockname()[1]}"
    host, port = server.url.removeprefix("http://").split(":")
    folder = tmp_path_factory.mktemp("caddy")
    names = {"SITE": url, "UPSTREAM": host, "UPSTREAM_PORT": port, "HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    with (folder / "log").open("wb") as log:
        command = [str(caddy), "run", "--config", str(CADDYFILE), "--adapter", "caddyfile"]
        process = subprocess.Popen(command, env=os.environ | names, stderr=log)

    def ready() -> bool:
        assert process.poll() is None, (folder / "log").read_text()
        with suppress(httpx.TransportError):
            return httpx.get(f"{url}/health/live").status_code == 200
        return False

    try:
        until(ready)
        yield url
    finally:
        process.terminate()
        process.wait(10)


def health(url: str) -> bool:
    return httpx.get(f"{url}/health/live").status_code == 200


@pytest.mark.parametrize("where", ["server", "proxy"])
def test_a_header_without_end_is_cut_off(where, server, request):
    url = server.url if where == "server" else request.getfixturevalue("proxy")
    answer, _ = raw(url, b"GET / HTTP/1.1\r\nhost: localhost\r\na: ", *[b"x" * 10_000] * 20)
    assert answer == b"" or answer.startswith((b"HTTP/1.1 400", b"HTTP/1.1 431"))
    assert health(url)


def test_the_proxy_passes_on_what_the_service_says(server, proxy):
    ask = {"seed": 1, "seconds": 0.1}
    direct, proxied = (httpx.post(f"{url}/v1/synthesis", json=ask) for url in (server.url, proxy))
    assert (proxied.status_code, proxied.content) == (200, direct.content)
    assert proxied.headers["etag"] == direct.headers["etag"]
    with connect(f"ws{proxy.removeprefix('http')}/v1/stream") as stream:
        stream.send("{}")
        assert '"settings"' in stream.recv(timeout=30)


def test_slow_clients_hold_up_nobody_at_uvicorn_alone(server):
    """They stay for as long as they like, but cost a socket each."""
    host, port = server.url.removeprefix("http://").split(":")
    clients = [socket.create_connection((host, int(port))) for _ in range(100)]
    for client in clients:
        client.sendall(b"GET /health/live HTTP/1.1\r\nhost: lo")
    assert health(server.url)
    for client in clients:
        client.close()


def goes_on(url: str) -> float:
    """Seconds until the server hangs up on a client that goes on sending a body that nobody wants."""
    host, port = url.removeprefix("http://").split(":")
    begun = time.monotonic()
    with socket.create_connection((host, int(port)), timeout=5) as client, suppress(ConnectionError):
        client.sendall(HEAD.replace(b"synthesis", b"nothing") + b"transfer-encoding: chunked\r\n\r\n")
        while time.monotonic() - begun < 30:
            client.sendall(b"1000\r\n" + b" " * 4096 + b"\r\n")
            time.sleep(0.02)
    return time.monotonic() - begun


@pytest.mark.slow
def test_slow_clients_are_hung_up_by_the_proxy(proxy):
    """All of them at once: each takes as long as a client may."""
    slow = [b"GET /health/live HTTP/1.1\r\n", *[b"a: b\r\n"] * 30]
    with ThreadPoolExecutor() as pool:
        header = pool.submit(raw, proxy, *slow, pause=0.5)  # 15 s of sending
        idle = pool.submit(raw, proxy)
        blank = pool.submit(raw, proxy, b"\r\n\r\n")
        endless = pool.submit(goes_on, proxy)
    answer, seconds = header.result()
    assert not answer.startswith(b"HTTP/1.1 200")
    assert seconds < 16
    assert idle.result()[1] < 13
    assert blank.result()[1] < 13
    assert endless.result() < 20
