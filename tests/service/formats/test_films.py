"""Films over HTTP: they are what Python draws, and begin before they are drawn."""

import io
import time

import av
import numpy as np

import motionenv

ASK = {"seed": 5, "seconds": 2.0, "fps": 30, "picture": {"width": 160, "height": 120}}


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
    assert len(times) >= 8
