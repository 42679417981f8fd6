"""What Prometheus is told, read by its own parser."""

import re
import time

ASK = {"seed": 1, "seconds": 0.1}


def test_threads_in_use_are_counted(server):
    held = lambda: float(re.search(rb"^motionenv_threads_held (\S+)", server.http.get("/metrics").content, re.M)[1])
    film = {**ASK, "seconds": 10, "picture": {"width": 640, "height": 480}}
    with server.http.stream("POST", "/v1/synthesis", json=film, headers={"Accept": "video/mp4"}):
        assert held() == 1
    until = time.monotonic() + 10
    while held() and time.monotonic() < until:
        time.sleep(0.05)
    assert held() == 0
