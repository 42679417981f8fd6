"""Jobs outlive what happens to the service: shutdown, kill -9 of server and processes, a full disk."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import httpx
import numpy as np
import psutil
import pytest

import motionenv
from tests.service.jobs.handing import (
    LONG,
    SHORT,
    as_file,
    ended,
    processes,
    result,
    some_walks,
    until_running,
    uploads,
)
from tests.service.waiting import until

ROOT = Path(__file__).parents[3]


class Killable:
    """A service that is begun again and again on the same folder."""

    def __init__(self, data: Path, log: Path, before: tuple[str, ...] = (), **settings):
        self.data, self.log, self.before = data, log, before
        values = {"port": 0, "reserve": 0, "job_memory": 2_000_000_000} | settings
        self.environment = {f"MOTIONENV_SERVICE_{name.upper()}": json.dumps(v) for name, v in values.items()}
        self.environment["MOTIONENV_SERVICE_DATA"] = str(data)

    def begin(self) -> None:
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [*self.before, sys.executable, "-m", "service"], cwd=ROOT, env=os.environ | self.environment, stderr=log
            )
        until = time.monotonic() + 60
        while not (found := re.search(r"running on (http://[^\s\"]+)", self.log.read_text())):
            assert time.monotonic() < until, self.log.read_text()
            time.sleep(0.02)
        self.http = httpx.Client(base_url=found[1], timeout=60)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.http.close()

    def events(self, event: str) -> list[dict]:
        return [logged for line in self.log.read_text().splitlines() if (logged := json.loads(line))["event"] == event]


def fit(service: Killable, walks: dict[str, bytes], name: str) -> httpx.Response:
    return service.http.post("/v1/models", files=uploads(walks), data={"kind": "eigenwalkers", "name": name})


def hand_in(service: Killable, walks: dict[str, bytes], number: int) -> dict[str, str]:
    """A job of each kind that takes seconds: kind by id."""
    one = dict(list(walks.items())[:1])
    answers = {
        "fit": fit(service, walks, f"model-{number}"),
        "render": service.http.post("/v1/jobs/render", json=SHORT),
        "inspect": service.http.post("/v1/jobs/inspect", files=uploads(one)),
    }
    return {answer.raise_for_status().json()["id"]: kind for kind, answer in answers.items()}


def kill_at_random(service: Killable, rng: np.random.Generator) -> None:
    """Kill the service, and in half of the cases the job's process before it; none outlives it."""
    time.sleep(rng.uniform(0.1, 4.0))
    jobs = processes(service)
    if jobs and rng.integers(2):
        jobs[0].kill()
    service.kill()
    until(lambda: not [job for job in jobs if alive(job)])


def alive(process: psutil.Process) -> bool:
    """Whether a process runs, and is more than an entry that nobody has waited for."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def checked(service: Killable, jobs: dict[str, str], expected: np.ndarray) -> list[str]:
    """How each job has ended; a result that isn't whole, or a model that isn't right, is an error."""
    statuses = []
    for job, kind in jobs.items():
        told = ended(service, SimpleNamespace(status_code=202, headers={"Location": f"/v1/jobs/{job}"}), 300)
        statuses.append(told["status"])
        if told["status"] == "failed":  # only those that never had the time
            assert re.search("(ended|killed) 5 times", told["message"]), told["message"]
            continue
        answer = result(service, told)
        assert hashlib.sha256(answer.content).hexdigest() == answer.headers["ETag"].strip('"')
        if kind == "fit":
            model = motionenv.load(service.data / "models" / f"{told['model'].removeprefix('fitted/')}.npz")
            np.testing.assert_array_equal(model.components_, expected)
    return statuses


def survived(data: Path, log: Path, rounds: int) -> dict[str, int]:
    """Kills a service at random times while it fits, renders and reads; what became of the jobs."""
    rng, walks = np.random.default_rng(1), dict(list(some_walks().items())[::2])  # one of each person
    service, jobs, interrupted = Killable(data, log), {}, 0
    for i in range(rounds):
        service.begin()
        interrupted += len(service.events("job was interrupted"))
        jobs |= hand_in(service, walks, i)
        kill_at_random(service, rng)
    service.begin()
    try:
        assert ended(service, fit(service, walks, "undisturbed"), 600)["status"] == "done"
        expected = motionenv.load(data / "models" / "undisturbed.npz").components_
        statuses = checked(service, jobs, expected)
        assert {path.suffix for path in (data / "models").iterdir()} == {".npz"}
        assert not list((data / "work").iterdir())
        assert not list((data / "incoming").iterdir())
    finally:
        service.kill()
    return {"jobs": len(jobs), "done": statuses.count("done"), "interrupted": interrupted}


@pytest.mark.slow
def test_kills_lose_no_job_and_leave_nothing_half_done(tmp_path):
    told = survived(tmp_path / "data", tmp_path / "log", 2)
    assert told["done"] == told["jobs"] == 6


@pytest.mark.benchmark
def test_twenty_kills_lose_no_job_and_leave_nothing_half_done(tmp_path, capsys):
    told = survived(tmp_path / "data", tmp_path / "log", 20)
    with capsys.disabled():
        sys.stdout.write(f"\n20 times kill -9: {told}\n")


@pytest.fixture
def small(tmp_path) -> Iterator[SimpleNamespace]:
    """A service whose data folder is a disk of 40 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ("unshare", "-Urm", "sh", "-c", f'mount -t tmpfs -o size=40m none "{disk}" && exec "$@"', "sh")
    if not shutil.which("unshare") or subprocess.run([*mount, "true"], capture_output=True).returncode:
        pytest.skip("no small disk can be mounted here: it takes unshare and user namespaces")
    service = Killable(disk / "data", tmp_path / "log", mount)
    service.begin()
    service.disk = Path(f"/proc/{service.process.pid}/root") / disk.relative_to("/")
    yield service
    service.kill()


def fill(disk: Path) -> Path:
    """Take all that is left of a disk."""
    path = disk / "filler"
    with path.open("wb", buffering=0) as file:
        for size in (1 << 20, 4096):
            try:
                while True:
                    file.write(bytes(size))
            except OSError:
                continue
    return path


def test_a_full_disk_is_said_and_jobs_can_still_be_removed(small):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=7), ".npz")
    inspected = small.http.post("/v1/jobs/inspect", files=uploads({"a.npz": motion}))
    assert ended(small, inspected)["status"] == "done"
    running = small.http.post("/v1/jobs/render", json=LONG)
    until_running(small, running)
    next_one = small.http.post("/v1/jobs/inspect", files=uploads({"b.npz": motion}))
    filler = fill(small.disk)
    before = sorted(path for path in small.disk.rglob("*") if path.is_file())
    big = b"HIERARCHY" + bytes(2_000_000)
    refused = [
        small.http.post("/v1/jobs/inspect", files=uploads({"c.bvh": big})),
        small.http.post("/v1/jobs/inspect", files=uploads({"c.bvh": big[:3000]})),
        small.http.post("/v1/jobs/render", json=LONG),
        chunked(small, big),
    ]
    assert {answer.status_code for answer in refused} <= {507, 202}
    assert refused[0].status_code == refused[3].status_code == 507
    assert not list((small.disk / "data" / "incoming").iterdir())
    assert small.http.get("/v1/jobs").status_code == 200
    assert small.http.delete(running.headers["Location"]).json()["status"] == "cancelled"
    assert small.http.delete(inspected.headers["Location"]).status_code == 204
    assert ended(small, next_one)["status"] in ("done", "failed")
    assert len(before) > 3
    filler.unlink()
    again = small.http.post("/v1/jobs/inspect", files=uploads({"d.npz": motion}))
    assert ended(small, again)["status"] == "done"


def chunked(service, content: bytes) -> httpx.Response:
    """An upload that doesn't say how long it is."""
    head = b'--x\r\nContent-Disposition: form-data; name="files"; filename="a.bvh"\r\n\r\n'
    parts = iter([head, content, b"\r\n--x--\r\n"])
    return service.http.post(
        "/v1/jobs/inspect", content=parts, headers={"Content-Type": "multipart/form-data; boundary=x"}
    )
