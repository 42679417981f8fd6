"""Jobs are begun, ended and begun again, by one process of those that serve."""

import os
import re
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import httpx
import psutil
import pytest

from tests.service.jobs.handing import LONG, SHORT, ended, processes, until_running
from tests.service.waiting import requests_running, until


def test_what_ran_at_shutdown_runs_again(serving, tmp_path):
    with serving(tmp_path, reserve=0) as server:
        running = server.http.post("/v1/jobs/render", json=LONG)
        waiting = server.http.post("/v1/jobs/render", json=SHORT)
        until_running(server, running)
        with ThreadPoolExecutor(1) as pool:
            asking = pool.submit(httpx.get, f"{server.url}{waiting.headers['Location']}?wait=2", timeout=60)
            until(lambda: requests_running(server) == 1)
            server.process.send_signal(signal.SIGTERM)
            assert asking.result().json()["status"] == "queued"
            assert server.process.wait(10) in (0, -signal.SIGTERM)
    with serving(tmp_path, reserve=0) as server:
        until_running(server, running)
        assert server.http.delete(running.headers["Location"]).json()["status"] == "cancelled"
        assert ended(server, waiting)["status"] == "done"


def until_ready(server) -> None:
    """The address is known before a worker listens there."""
    for _ in range(600):
        try:
            if server.http.get("/health/ready").status_code == 200:
                return
        except httpx.ConnectError:
            time.sleep(0.05)
    raise AssertionError("".join(server.lines))


def supervisors(server, data: Path) -> list[psutil.Process]:
    """The server process that runs the jobs, if one does."""
    holds = lambda process: str(data / "jobs.lock") in [file.path for file in process.open_files()]
    return [child for child in psutil.Process(server.process.pid).children() if holds(child)]


@pytest.mark.slow
def test_two_server_processes_share_the_jobs_and_one_is_enough(serving, tmp_path):
    with serving(tmp_path, workers=2, reserve=0) as server:
        until_ready(server)
        answers = [server.http.post("/v1/jobs/render", json=SHORT | {"seed": i}) for i in range(2)]
        for answer in answers * 2:
            with httpx.Client(base_url=server.url, timeout=60) as other:  # each connection may meet the other process
                asked = SimpleNamespace(http=other)
                assert ended(asked, answer)["status"] == "done"
        long = server.http.post("/v1/jobs/render", json=LONG)
        with httpx.Client(base_url=server.url, timeout=60) as other:
            until_running(SimpleNamespace(http=other), long)
            assert other.delete(long.headers["Location"]).json()["status"] == "cancelled"
        until(lambda: not processes(server))
        (first,) = supervisors(server, tmp_path)
        first.kill()
        with httpx.Client(base_url=server.url, timeout=60, transport=httpx.HTTPTransport(retries=3)) as other:
            asked = SimpleNamespace(http=other)
            assert ended(asked, other.post("/v1/jobs/render", json=SHORT))["status"] == "done"
            assert supervisors(server, tmp_path) != [first]
            counted = lambda: re.search(r'motionenv_jobs{status="done"} (\S+)', other.get("/metrics").text)[1]
            until(lambda: counted() == "3.0")  # and never those of the process that was killed as well


def test_a_killed_process_is_begun_again(job_server):
    asked = job_server.http.post("/v1/jobs/render", json=SHORT | {"seconds": 4})
    until_running(job_server, asked)
    while not (found := processes(job_server)):
        time.sleep(0.02)
    os.kill(found[0].pid, signal.SIGKILL)
    assert ended(job_server, asked)["status"] == "done"
