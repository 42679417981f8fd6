"""Requests that are repeated or refused, against servers that are busy, broken, locked or not there."""

import http.server
import json
import threading
import time
from contextlib import contextmanager

import pytest

import motionenv
from motionenv import MotionError, ServiceError


@contextmanager
def answering(*answers):
    """A server that gives one answer after the other, (status, headers, body), and the times when it was asked."""
    left, times = list(answers), []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            times.append(time.monotonic())
            status, headers, body = left.pop(0)
            self.send_response(status)
            for name, value in ({"Content-Length": len(body)} | headers).items():
                self.send_header(name, str(value))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Handler) as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{running.server_port}", times
        finally:
            running.shutdown()
            thread.join()


NONE = 200, {}, json.dumps({"models": []}).encode()


def test_keys_come_from_argument_or_environment(locked, monkeypatch):
    monkeypatch.delenv("MOTIONENV_KEY", raising=False)
    with motionenv.Client(locked.url) as client:
        with pytest.raises(ServiceError, match="key") as refused:
            client.models()
        assert refused.value.status == 401
    with motionenv.Client(locked.url, locked.key) as client:
        assert client.models()
        assert locked.key not in repr(client) + repr(client._connection)
    monkeypatch.setenv("MOTIONENV_KEY", locked.key)
    with motionenv.Client(locked.url) as client:
        assert client.models()


def test_nobody_there_is_said():
    with motionenv.Client("http://127.0.0.1:9", retries=0) as client:
        with pytest.raises(ServiceError, match="start it with `motionenv serve`") as gone:
            client.models()
    assert gone.value.status is None
    with pytest.raises(MotionError, match="must begin with http"):
        motionenv.Client("localhost:8000")


def test_what_is_busy_is_asked_again_when_it_says():
    busy = 503, {"Retry-After": 1}, b'{"detail": "too many"}'
    with answering(busy, NONE) as (url, times), motionenv.Client(url) as client:
        assert client.models() == []
    assert 0.9 < times[1] - times[0] < 3


def test_patience_has_an_end():
    with answering((429, {"Retry-After": 60}, b'{"detail": "slower"}')) as (url, times):
        with motionenv.Client(url, patience=2) as client, pytest.raises(ServiceError, match="slower") as busy:
            client.models()
    assert (busy.value.status, busy.value.retry_after, len(times)) == (429, 60.0, 1)


def test_a_date_says_when_too():
    date = time.strftime("%a, %d %b %Y %H:%M:%S GMT", time.gmtime(time.time() + 100))
    with answering((503, {"Retry-After": date}, b"<html>")) as (url, _), motionenv.Client(url) as client:
        with pytest.raises(ServiceError, match="503 Service Unavailable from") as busy:
            client.models()
    assert 95 < busy.value.retry_after <= 100


def test_a_broken_answer_leaves_no_file(tmp_path):
    with answering((200, {"Content-Length": 100}, b"half")) as (url, _), motionenv.Client(url) as client:
        with pytest.raises(ServiceError, match="broke"):
            client._connection.save(tmp_path / "half.mp4", "GET", "/")
    assert list(tmp_path.iterdir()) == []
