"""Uploads that mean no good: refused at once, or failing in a process of their own while the service answers."""

import io
import time
import zipfile

import numpy as np
import psutil

import motionenv
from tests.service.jobs.handing import as_file, ended, result, uploads


def bomb() -> bytes:
    """An NPZ of some megabytes whose poses say that they are small, and are a gigabyte."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, True, 1) as archive, archive.open("poses.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (10, 25)})
        for _ in range(1000):
            member.write(bytes(1 << 20))
    return file.getvalue()


def pickled() -> bytes:
    file = io.BytesIO()
    np.savez(file, poses=np.array([{"a": 1}], dtype=object))
    return file.getvalue()


def large() -> bytes:
    """An NPZ whose header says 1e9 frames."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("poses.npy", "w") as member:
        shape = (1_000_000_000, 25)
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return file.getvalue()


def deep() -> bytes:
    """A BVH of 100,000 joints, each the child of the last."""
    joints = "".join(f"JOINT j{i} {{ OFFSET 0 0 1 CHANNELS 1 Xrotation\n" for i in range(100_000))
    return f"HIERARCHY\nROOT r {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{joints}End Site {{ OFFSET 0 0 1 }}".encode()


def test_hostile_files_fail_in_their_process_while_the_service_answers(job_server):
    motion = motionenv.synthesize("walk/fpca", 1, 60, seed=5)
    cut = as_file(motion, ".npz")[:-100]
    files = {"bomb.npz": bomb(), "pickle.npz": pickled(), "large.npz": large(), "cut.npz": cut, "deep.bvh": deep(),
             "noise.c3d": b"\x02\x50" + bytes(range(256)) * 8, "cut.c3d": as_file(motion, ".c3d")[:700],
             "nan.bvh": as_file(motion, ".bvh").replace(b"0.0", b"nan"), "alone.amc": b":FULLY-SPECIFIED\n1\nroot 0\n",
             "good.npz": as_file(motion, ".npz")}  # fmt: skip
    before = psutil.Process(job_server.process.pid).memory_info().rss
    begun = time.monotonic()
    asked = job_server.http.post("/v1/jobs/inspect", files=uploads(files), data={"fps": "60"})
    assert time.monotonic() - begun < 2
    slowest = 0.0
    while job_server.http.get(asked.headers["Location"]).json()["status"] in ("queued", "running"):
        begun = time.monotonic()
        job_server.http.get("/health/live").raise_for_status()
        slowest = max(slowest, time.monotonic() - begun)
        time.sleep(0.05)
    found = {file["name"]: file for file in result(job_server, ended(job_server, asked)).json()["files"]}
    assert set(found) == set(files)
    assert found.pop("good.npz")["frames"] == 60
    assert all(file.get("problem") for file in found.values()), found
    assert slowest < 1
    assert psutil.Process(job_server.process.pid).memory_info().rss - before < 50e6
