"""A job's process: what becomes of the job when it crashes, or takes too much."""

import io
import os
import signal
import time
import zipfile

import numpy as np

import motionenv
from tests.service.jobs.handing import LONG, as_file, ended, processes, until_running, uploads


def test_a_crash_of_the_process_fails_the_job_and_nothing_else(job_server):
    """As ezc3d does on some damaged C3D files."""
    asked = job_server.http.post("/v1/jobs/render", json=LONG)
    until_running(job_server, asked)
    while not (found := processes(job_server)):
        time.sleep(0.05)
    os.kill(found[0].pid, signal.SIGSEGV)
    job = ended(job_server, asked)
    assert (job["status"], job["error"]["status"], job["error"]["title"]) == ("failed", 422, "Unprocessable Entity")
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


def test_too_much_memory_or_time_fails_the_job(serving, tmp_path):
    with serving(tmp_path, job_memory=1_000_000_000, reserve=0) as little:
        job = ended(little, little.http.post("/v1/jobs/inspect", files=uploads({"heavy.npz": heavy()})))
        assert (job["status"], job["error"]["status"]) == ("failed", 422)
        assert "memory limit of 1 GB" in job["error"]["detail"]
    with serving(tmp_path, job_seconds=1.5, reserve=0) as short:
        job = ended(short, short.http.post("/v1/jobs/render", json=LONG))
        assert "time limit of 1.5 s" in job["error"]["detail"]
