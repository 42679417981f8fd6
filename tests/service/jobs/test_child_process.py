"""A job's process: what becomes of the job when it crashes, or takes too much."""

import asyncio
import io
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import orjson
import psutil
import pytest

import motionenv
from service.jobs.child_process import Failed, run
from tests.service.jobs.handing import LONG, as_file, ended, processes, until_running, uploads
from tests.service.running import ROOT


def test_a_crash_of_the_process_fails_the_job_and_nothing_else(job_server):
    """As ezc3d does on some damaged C3D files."""
    asked = job_server.http.post("/v1/jobs/render", json=LONG)
    until_running(job_server, asked)
    while not (found := processes(job_server)):
        time.sleep(0.05)
    os.kill(found[0].pid, signal.SIGSEGV)
    job = ended(job_server, asked)
    assert (job["status"], job["error"]["status"], job["error"]["title"]) == ("failed", 422, "A field is invalid")
    assert "crashed (SIGSEGV)" in job["error"]["detail"]
    assert job_server.http.get(f"{asked.headers['Location']}/result").status_code == 409


def heavy() -> bytes:
    """An NPZ of some megabytes that holds what it says, 4.4 million frames."""
    motion = motionenv.synthesize("walk/fpca", 0.5, 60, seed=1)
    file = io.BytesIO(as_file(motion, ".npz"))
    made = io.BytesIO()
    with zipfile.ZipFile(file) as small, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for member in small.infolist():
            if member.filename != "poses.npy":
                archive.writestr(member.filename, small.read(member))
        with archive.open("poses.npy", "w") as poses:
            shape = (880 * (1 << 20) // 200, 25)
            np.lib.format.write_array_header_1_0(poses, {"descr": "<f8", "fortran_order": False, "shape": shape})
            for _ in range(880):
                poses.write(bytes(1 << 20))
    return made.getvalue()


@pytest.mark.slow
def test_too_much_memory_or_time_fails_the_job(serving, tmp_path):
    with serving(tmp_path, job_memory=1_000_000_000, reserve=0) as little:
        job = ended(little, little.http.post("/v1/jobs/inspect", files=uploads({"heavy.npz": heavy()})))
        assert (job["status"], job["error"]["status"]) == ("failed", 422)
        assert "memory limit of 1 GB" in job["error"]["detail"]
    with serving(tmp_path, job_seconds=1.5, reserve=0) as short:
        job = ended(short, short.http.post("/v1/jobs/render", json=LONG))
        assert "time limit of 1.5 s" in job["error"]["detail"]


@pytest.fixture
def folder(tmp_path) -> Path:
    """A job's folder with a walk."""
    (tmp_path / "input").mkdir()
    motionenv.write(motionenv.synthesize("walk/fpca", 1, 60, seed=1), tmp_path / "input" / "walk.bvh")
    return tmp_path


def children(folder: Path) -> list[psutil.Process]:
    """Processes of this one that work in a folder."""
    return [child for child in psutil.Process().children() if child.cwd() == str(folder)]


CONVERT = {"kind": "convert", "settings": {"fps": None, "unit": None, "suffix": ".npz"}}


def ran(folder: Path, work: dict, seconds: float = 60.0) -> list[tuple[float, str]]:
    """The progress of a job."""
    told: list[tuple[float, str]] = []

    async def tell(share: float, message: str) -> None:
        told.append((share, message))

    asyncio.run(run(work, folder, seconds, 3_000_000_000, tell))
    return told


def test_progress_goes_up_and_the_result_is_there(folder):
    told = ran(folder, CONVERT)
    assert [share for share, _ in told] == sorted(share for share, _ in told)
    assert told[0] == (0.0, "reading walk.bvh")
    with np.load(folder / "result") as made:
        assert made["poses"].shape == (60, 25)


def test_what_is_wrong_with_a_file_is_the_clients(folder):
    (folder / "input" / "walk.bvh").write_text("HIERARCHY\nnonsense")
    with pytest.raises(Failed, match=r"^walk\.bvh") as failed:
        ran(folder, CONVERT)
    assert failed.value.status == 422
    assert str(folder) not in failed.value.detail


def test_what_is_wrong_with_the_service_is_500_and_says_nothing_of_it(folder):
    with pytest.raises(Failed, match="internal error, please report it") as failed:
        ran(folder, CONVERT | {"kind": "unheard"})
    assert failed.value.status == 500
    assert "KeyError: 'unheard'" in (folder / "log").read_text()


def test_a_job_that_is_not_wanted_any_more_takes_its_process_with_it(folder):
    walk = {"seconds": 600.0, "fps": 30.0, "seed": 1, "picture": {"width": 64, "height": 64}}
    work = {"kind": "render", "settings": {"request": walk, "model": "walk/fpca", "suffix": ".mp4"}}

    async def cancelled() -> None:
        drawing = asyncio.Event()

        async def look(share: float, _: str) -> None:
            if share:
                drawing.set()

        task = asyncio.create_task(run(work, folder, 60, 3_000_000_000, look))
        await asyncio.wait_for(drawing.wait(), 60)
        assert len(children(folder)) == 1
        task.cancel()
        await asyncio.wait({task})
        assert task.cancelled()

    asyncio.run(cancelled())
    assert not children(folder)


def test_keys_of_the_service_do_not_reach_the_process(folder, monkeypatch):
    """It reads files of strangers."""
    monkeypatch.setenv("MOTIONENV_SERVICE_KEYS", '["a-key-that-only-tests-know"]')
    seen: list[bool] = []

    async def look(share: float, _: str) -> None:
        seen.extend("MOTIONENV_SERVICE_KEYS" in child.environ() for child in children(folder))

    asyncio.run(run(CONVERT, folder, 60, 3_000_000_000, look))
    assert seen
    assert not any(seen)


def test_a_process_of_another_parent_does_nothing(folder):
    limits = {"memory": 3_000_000_000, "cpu": 60.0, "parent": 1}
    command, environment = [sys.executable, "-P", "-m", "service.jobs.worker"], os.environ | {"PYTHONPATH": str(ROOT)}
    work = orjson.dumps({**CONVERT, "limits": limits})
    done = subprocess.run(command, cwd=folder, env=environment, input=work, capture_output=True)
    assert (done.returncode, done.stdout) == (1, b"")
    assert not (folder / "result").exists()


LIMITED = """
import os, resource
from service.jobs.worker import limit
limit(3_000_000_000, 7.0, os.getppid())
for name in ("AS", "CPU", "CORE", "FSIZE", "NOFILE"):
    print(name, *resource.getrlimit(getattr(resource, f"RLIMIT_{name}")))
print("NICE", os.nice(0), 0)
try:
    bytearray(4_000_000_000)
except MemoryError:
    print("MEMORY", 1, 1)
"""


def test_limits_are_those_of_the_system(tmp_path):
    done = subprocess.run([sys.executable, "-c", LIMITED], cwd=ROOT, capture_output=True, text=True, check=True)
    told = {name: (int(soft), int(hard)) for name, soft, hard in map(str.split, done.stdout.splitlines())}
    assert told["AS"] == (3_000_000_000, 3_000_000_000)
    assert told["CPU"] == (8, 13)
    assert told["CORE"] == (0, 0)
    assert told["NOFILE"] == (256, 256)
    assert told["FSIZE"] == (2 << 30, 2 << 30)
    assert told["NICE"][0] >= 10
    assert "MEMORY" in told
