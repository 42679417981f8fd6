"""The server's processes: what runs is finished at the end, and what can't be started says so."""

import io
import signal
import socket
import subprocess
import sys
from pathlib import Path

import av
import httpx
import pytest

from service.server import application
from tests.service.waiting import requests_running, until

ROOT = Path(__file__).parents[2]
FILM = {"seed": 1, "seconds": 8, "fps": 30, "picture": {"width": 320, "height": 240}}


@pytest.mark.slow
def test_a_running_answer_is_finished_at_the_end_and_no_other_begun(serving, tmp_path):
    with serving(tmp_path) as server:
        ask = {"json": FILM, "headers": {"Accept": "video/mp4"}, "timeout": 60}
        with httpx.stream("POST", f"{server.url}/v1/synthesis", **ask) as answer:
            parts = answer.iter_raw()
            body = next(parts)
            server.process.send_signal(signal.SIGTERM)
            until(lambda: any("Shutting down" in line for line in server.lines))
            with pytest.raises(httpx.TransportError):
                httpx.get(f"{server.url}/health/live")
            body += b"".join(parts)
        assert server.process.wait(30) in (0, -signal.SIGTERM)
    with av.open(io.BytesIO(body)) as film:
        assert len(list(film.decode(video=0))) == FILM["seconds"] * FILM["fps"]


@pytest.mark.slow
def test_what_takes_longer_than_the_time_to_end_is_cut_off(serving, tmp_path):
    with serving(tmp_path, shutdown_seconds=0) as server:
        long = FILM | {"seconds": 60, "picture": {"width": 1280, "height": 720}}
        ask = {"json": long, "headers": {"Accept": "video/mp4"}, "timeout": 60}
        with httpx.stream("POST", f"{server.url}/v1/synthesis", **ask) as answer:
            parts = answer.iter_raw()
            next(parts)
            assert requests_running(server) == 1
            server.process.send_signal(signal.SIGTERM)
            assert server.process.wait(20) in (0, -signal.SIGTERM)


def test_a_port_that_is_taken_ends_with_an_error(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        command = [sys.executable, "-m", "service", "--port", port, "--data", str(tmp_path / "data")]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode != 0
    assert f"('127.0.0.1', {port}): address already in use" in done.stderr


def test_a_worker_takes_the_settings_of_the_environment(tmp_path):
    """In a process of its own: it sends all logs to stderr."""
    code = "from service.server import application; print(application().state.service.settings.data)"
    environment = {"MOTIONENV_SERVICE_DATA": str(tmp_path / "mine"), "PATH": ""}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, str(tmp_path / "mine"))
    assert callable(application)
