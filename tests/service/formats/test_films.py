"""Films over HTTP: they begin at once, come while they are drawn, and stop when nobody watches."""

import io
import socket
import time

import av
import httpx
import numpy as np
import pytest

import motionenv
from tests.service.waiting import until

ASK = {"seed": 5, "seconds": 2.0, "fps": 30, "picture": {"width": 160, "height": 120}}
LONG = {"seed": 1, "seconds": 60, "fps": 30, "picture": {"width": 640, "height": 480}}


def frames(data: bytes) -> np.ndarray:
    with av.open(io.BytesIO(data)) as container:
        return np.stack([f.to_ndarray(format="rgb24") for f in container.decode(video=0)])


def test_a_film_is_what_python_draws(server):
    answer = server.http.post("/v1/synthesis", json=ASK, headers={"Accept": "video/mp4"})
    assert answer.headers["content-type"] == "video/mp4"
    shown = frames(answer.content)
    drawn = np.stack(list(motionenv.film(
        motionenv.synthesize("walk/fpca", 2.0, 30, seed=5), np.pi / 4, width=160, height=120, elevation=np.radians(3.5)
    )))  # fmt: skip
    assert shown.shape == drawn.shape
    assert np.abs(shown.astype(int) - drawn).mean() < 4


def test_a_film_begins_before_it_is_drawn(server):
    ask = ASK | {"seconds": 4.0, "picture": {"width": 320, "height": 240}}
    server.http.post("/v1/synthesis", json=ASK, headers={"Accept": "video/mp4"})  # the first film loads the encoder
    begun = time.perf_counter()
    times, data = [], b""
    with server.http.stream("POST", "/v1/synthesis", json=ask, headers={"Accept": "video/mp4"}) as answer:
        for part in answer.iter_raw():
            times.append(time.perf_counter() - begun)
            data += part
    assert len(frames(data)) == 120
    assert times[0] < 0.5 * times[-1]
    assert times[0] < 1.5  # 0.05 s on a quiet machine
    assert len(times) >= 8


def cpu(pid: int) -> float:
    """Seconds of processor time that a process has taken."""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100


def vanish(url: str, accept: bytes, after: float, ask: bytes) -> None:
    """Ask for something, and hang up."""
    host, port = url.removeprefix("http://").split(":")
    head = b"POST /v1/synthesis HTTP/1.1\r\nhost: localhost\r\naccept: %b\r\n" % accept
    with socket.create_connection((host, int(port))) as connection:
        connection.sendall(head + b"content-type: application/json\r\ncontent-length: %d\r\n\r\n%b" % (len(ask), ask))
        time.sleep(after)


@pytest.mark.parametrize("accept", [b"video/mp4", b"image/gif"])
def test_who_goes_stops_the_work(server, accept):
    while not server.http.get("/v1/models/mixed/tree").json()["ready"]:
        time.sleep(0.5)  # it is made once, and takes processor time
    begun = len(asked_for(server))
    vanish(server.url, accept, 2.0, httpx.Request("POST", "http://x", json=LONG).content)
    until(lambda: len(asked_for(server)) > begun)
    until(lambda: idle(server.process.pid))
    assert server.http.get("/health/live").status_code == 200


def idle(pid: int) -> bool:
    """Whether a process takes less than 0.3 s of processor time in the next second."""
    before = cpu(pid)
    time.sleep(1.0)
    return cpu(pid) - before < 0.3


def asked_for(server) -> list[dict]:
    """Walks that were asked for, and answered or not wanted any more."""
    return [event for event in server.events("request") if event["path"] == "/v1/synthesis"]
