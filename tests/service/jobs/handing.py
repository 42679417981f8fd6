"""Handing in jobs, for the tests of them: capture to upload, and waiting for what becomes of it."""

import tempfile
import time
from contextlib import suppress
from pathlib import Path

import httpx
import psutil

import motionenv

#: A job that takes minutes.
LONG = {"seconds": 600, "fps": 60, "seed": 1, "picture": {"width": 640, "height": 480}}
#: One that takes seconds.
SHORT = {"seconds": 1, "seed": 3, "picture": {"width": 160, "height": 120}}


def some_walks() -> dict[str, bytes]:
    """Walks as NPZ, two of each of four people, by file name."""
    model = motionenv.load("walk/fpca")
    motions = [motionenv.synthesize(model, 6, 60, seed=i, speed=1.2, phase=0.3 * i) for i in range(8)]
    return {f"p{i // 2}_{i % 2}.npz": as_file(motion, ".npz") for i, motion in enumerate(motions)}


def as_file(motion, suffix: str) -> bytes:
    """The file that `motionenv.write` makes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"motion{suffix}"
        motionenv.write(motion, path)
        return path.read_bytes()


def uploads(files: dict[str, bytes]) -> list:
    """Files as httpx takes them."""
    return [("files", (name, content)) for name, content in files.items()]


def ended(server, answer, seconds: float = 150) -> dict:
    """The job that was handed in, once it has ended."""
    assert answer.status_code == 202, answer.text
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        job = server.http.get(answer.headers["Location"], params={"wait": 5}).raise_for_status().json()
        if job["status"] not in ("queued", "running"):
            return job
    raise AssertionError(f"the job goes on: {job}")


def result(server, job: dict) -> httpx.Response:
    """The answer with the result of a job that is done."""
    assert job["status"] == "done", job["message"]
    return server.http.get(job["result"]).raise_for_status()


def until_running(server, answer) -> dict:
    """The job that was handed in, once it runs."""
    for _ in range(300):
        job = server.http.get(answer.headers["Location"]).json()
        if job["status"] == "running":
            return job
        time.sleep(0.1)
    raise AssertionError(f"the job doesn't run: {job}")


def processes(server) -> list[psutil.Process]:
    """Those of jobs; one that has just ended is none."""
    found = []
    for child in psutil.Process(server.process.pid).children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            found += [child] if "service.jobs.worker" in child.cmdline() else []
    return found
