"""Uploads that mean no good: refused at once, or failing in a process of their own while the service answers."""

import hashlib
import io
import socket
import threading
import time
import zipfile

import httpx
import numpy as np
import psutil
import pytest

import motionenv
from service.jobs.store import Job, Store
from service.schemas.jobs import RenderRequest
from tests.service.jobs.handing import LONG, as_file, ended, result, uploads

HALF = b"--x\r\nContent-Disposition: form-data; name=files; filename=a.bvh\r\n\r\nhalf"


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


@pytest.mark.parametrize(
    ("files", "data", "status", "says"),
    [
        ({"a.exe": b"x"}, {}, 422, "end in"),
        ({"a": b"x"}, {}, 422, "end in"),
        ({"": b"x"}, {}, 422, "end in"),
        ({"a.npz": b""}, {}, 422, "empty"),
        ({"a.npz": b"\x80\x04pickle"}, {}, 422, "ZIP"),
        ({"a.c3d": b"zzzz"}, {}, 422, "0x50"),
        ({"a.asf": b"x"}, {}, 422, "field 'files'"),
        ({}, {"fps": "30"}, 422, "field 'files'"),
        ({"a.bvh": b"x"}, {"fps": "nan"}, 422, "/fps"),
        ({"a.bvh": b"x"}, {"fps": "1e999"}, 422, "/fps"),
        ({"a.bvh": b"x"}, {"unit": "furlong"}, 422, "/unit"),
        ({"a.bvh": b"x"}, {"speed": "1"}, 422, "/speed"),
        ({"a.bvh": b"x", "A.BVH": b"y"}, {}, 422, "two files"),
        ({f"{i}.bvh": b"x" for i in range(501)}, {}, 422, "500 files"),
        ({"a.bvh": b"x"}, {"fps": "1" * 5000}, 422, "4096 bytes"),
    ],
)  # fmt: skip
def test_uploads_that_can_not_be_are_refused_at_once(job_server, files, data, status, says):
    newest = lambda: [job["id"] for job in job_server.http.get("/v1/jobs").json()["jobs"]]
    before = newest()
    answer = job_server.http.post("/v1/jobs/inspect", files=uploads(files) or {"x": (None, "1")}, data=data)
    if not files:
        answer = job_server.http.post("/v1/jobs/inspect", files={"fps": (None, "30")})
    assert (answer.status_code, says in answer.text) == (status, True), answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert newest() == before
    assert not list((job_server.data / "incoming").iterdir())


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"{}", "application/json", 415),
        (b"--x\r\n", "multipart/form-data", 400),
        (b"", "multipart/form-data; boundary=x", 400),
        (b"nonsense", "multipart/form-data; boundary=x", 400),
        (HALF, "multipart/form-data; boundary=x", 400),
        (b"--x\r\n\r\nno name\r\n--x--\r\n", "multipart/form-data; boundary=x", 422),
    ],
)  # fmt: skip
def test_bodies_that_are_no_multipart_are_refused(job_server, body, kind, status):
    answer = job_server.http.post("/v1/jobs/inspect", content=body, headers={"Content-Type": kind})
    assert answer.status_code == status, answer.text
    assert not list((job_server.data / "incoming").iterdir())


@pytest.mark.parametrize(
    "name", ["../../../evil.npz", "/etc/evil.npz", "..\\..\\evil.npz", "a\x00b.npz", "%2e%2e%2fevil.npz", "..npz",
             "é\u202e.npz", "x" * 4000 + ".npz", "con.npz", "-rf.npz", "work/../jobs.sqlite.npz"],
)  # fmt: skip
def test_names_are_never_paths(job_server, name):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=5), ".npz")
    body = b'--x\r\nContent-Disposition: form-data; name="files"; filename="%b"\r\n\r\n%b\r\n--x--\r\n'
    body %= (name.replace("\\", "\\\\").encode(), motion)
    answer = job_server.http.post(
        "/v1/jobs/inspect", content=body, headers={"Content-Type": "multipart/form-data; boundary=x"}
    )
    if answer.status_code == 400:  # a header that is no header
        return
    job = answer.json()
    assert answer.status_code == 202, answer.text
    assert all(c.isalnum() or c in "_-." for c in job["files"][0])
    assert len(job["files"][0]) < 100
    job_server.http.delete(answer.headers["Location"])
    ended(job_server, answer)
    inside = {path.name for path in job_server.data.iterdir()}
    assert inside <= {"ballast", "file_store", "incoming", "jobs.lock", "jobs.sqlite", "jobs.sqlite-shm",
    "jobs.sqlite-wal",
                      "models", "work"}  # fmt: skip


def test_models_are_not_asked_for_under_names_that_are_paths(job_server):
    for name in ("..%2f..%2fjobs", "%2e%2e", "A", "a" * 64, "-x"):
        assert job_server.http.delete(f"/v1/models/fitted/{name}").status_code in (404, 422)
    for name in ("../x", "x/y", "X", "", "a" * 64, ".hidden"):
        answer = job_server.http.post("/v1/models", files=uploads({"a.bvh": b"x"}), data={"kind": "tree", "name": name})
        assert answer.status_code == 422


def test_equal_uploads_are_kept_once_and_go_with_the_last_job(job_server):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=77), ".npz")
    jobs = [job_server.http.post("/v1/jobs/inspect", files=uploads({f"{i}.npz": motion})) for i in range(2)]
    sha = hashlib.sha256(motion).hexdigest()
    for answer in jobs:
        assert ended(job_server, answer)["status"] == "done"
        assert (job_server.data / "file_store" / sha[:2] / sha).read_bytes() == motion
        assert job_server.http.delete(answer.headers["Location"]).status_code == 204
    assert not (job_server.data / "file_store" / sha[:2] / sha).exists()


def test_the_disk_reserve_is_kept(serving, tmp_path):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=77), ".npz")
    store = Store(tmp_path / "jobs.sqlite", lambda: False)
    settings = {"request": RenderRequest(**LONG).model_dump(exclude={"format"}), "suffix": ".mp4"}
    kept = Job("kept", "render", settings, None, "video/mp4", "walk.mp4", time.time())
    store.add(kept, [], most=1, idempotency=None, place=lambda: None)
    store.close()
    with serving(tmp_path, reserve=10**15) as server:
        for answer in (
            server.http.post("/v1/jobs/inspect", files=uploads({"a.npz": motion})),
            server.http.post("/v1/jobs/render", json=LONG),
        ):
            assert (answer.status_code, "disk is full" in answer.text) == (507, True)
        assert not list((tmp_path / "incoming").iterdir())
        assert server.http.delete("/v1/jobs/kept").json()["status"] == "cancelled"
        assert server.http.delete("/v1/jobs/kept").status_code == 204


def test_unknown_models_and_too_much_are_refused(job_server):
    assert job_server.http.post("/v1/jobs/render", json={"model": "fitted/nothing"}).status_code == 404
    wide = {"picture": {"width": 4096, "height": 4096}}
    assert job_server.http.post("/v1/jobs/render", json=wide).status_code == 422
    assert job_server.http.post("/v1/jobs/render", json={"seconds": 3600, "fps": 240}).status_code == 422
    assert job_server.http.get("/v1/jobs/nothing").status_code == 404
    assert job_server.http.delete("/v1/jobs/nothing").status_code == 404
    assert job_server.http.get("/v1/jobs/nothing/result").status_code == 404
    assert job_server.http.get("/v1/jobs/nothing", params={"wait": 31}).status_code == 422


def test_a_large_upload_takes_no_memory(job_server):
    until(lambda: job_server.http.get("/v2/models/mixed/tree/ready").is_success)  # it comes late, and takes memory
    process = psutil.Process(job_server.process.pid)
    content = b"HIERARCHY\n" + b"1.0 " * 15_000_000
    job_server.http.post("/v1/jobs/inspect", files=uploads({"small.bvh": content[:2_000_000]}))
    before, most, over = process.memory_info().rss, 0, threading.Event()

    def watch() -> None:
        nonlocal most
        while not over.is_set():
            most = max(most, process.memory_info().rss)
            time.sleep(0.01)

    watching = threading.Thread(target=watch)
    watching.start()
    asked = job_server.http.post("/v1/jobs/inspect", files=uploads({"large.bvh": content}))
    over.set()
    watching.join()
    assert asked.status_code == 202
    assert most - before < 20e6
    huge = uploads({"huge.bvh": content + content[:10_000_000]})
    assert job_server.http.post("/v1/jobs/inspect", files=huge).status_code == 413
    ended(job_server, asked)


def test_who_goes_in_the_middle_of_an_upload_leaves_nothing(job_server):
    head = (
        "POST /v1/jobs/inspect HTTP/1.1\r\nHost: localhost\r\nContent-Type: multipart/form-data; boundary=x\r\n"
        "Content-Length: 9000000\r\n\r\n"
    )
    url = httpx.URL(job_server.url)
    with socket.create_connection((url.host, url.port)) as connection:
        connection.sendall(head.encode() + HALF + bytes(3_000_000))
        until(lambda: list((job_server.data / "incoming").iterdir()))
    until(lambda: not list((job_server.data / "incoming").iterdir()))
    assert not job_server.events("request failed")


def until(true) -> None:
    deadline = time.monotonic() + 10
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.02)
