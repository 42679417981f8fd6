"""Multipart bodies: what is refused, under which names files are kept, and in how little memory."""

import socket
import threading
import time
import unicodedata
from pathlib import Path

import httpx
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

import motionenv
from service.errors import Problem
from service.jobs.uploads import SUFFIXES, as_fields, safe_name
from service.schemas.jobs import FitFields
from tests.service.jobs.handing import as_file, ended, uploads
from tests.service.waiting import requests_running, until

HALF = b"--x\r\nContent-Disposition: form-data; name=files; filename=a.bvh\r\n\r\nhalf"
WHOLE = HALF.replace(b"a.bvh", b"b.bvh") + b"\r\n"


@pytest.mark.parametrize(
    ("files", "data", "status", "says"),
    [
        ({"a.exe": b"x"}, {}, 422, "end in"),
        ({"a": b"x"}, {}, 422, "end in"),
        ({"": b"x"}, {}, 422, "field 'files'"),
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
        ({f"{i}.bvh": b"x" for i in range(501)}, {}, 400, "500 files"),
        ({"a.bvh": b"x"}, {"fps": "1" * 40_000}, 400, "32768 bytes"),
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
        (WHOLE + HALF, "multipart/form-data; boundary=x", 400),
        (b"--x\r\n\r\nno name\r\n--x--\r\n", "multipart/form-data; boundary=x", 400),
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
    assert answer.status_code == 202, answer.text
    job = answer.json()
    assert all(c.isalnum() or c in "_-." for c in job["files"][0])
    assert len(job["files"][0]) < 100
    job_server.http.delete(answer.headers["Location"])
    ended(job_server, answer)
    inside = {path.name for path in job_server.data.iterdir()}
    assert inside <= {"ballast", "file_store", "incoming", "jobs.lock", "jobs.sqlite", "jobs.sqlite-shm",
    "jobs.sqlite-wal",
                      "models", "work"}  # fmt: skip


def test_a_large_upload_takes_no_memory(job_server):
    until(lambda: job_server.http.get("/v1/models/mixed/tree").json()["ready"])  # it comes late, and takes memory
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
        until(lambda: requests_running(job_server) == 1)
    until(lambda: requests_running(job_server) == 0)
    assert not list((job_server.data / "incoming").iterdir())
    assert not job_server.events("request failed")


@given(st.text(max_size=200), st.sampled_from(SUFFIXES))
def test_every_name_becomes_one_of_a_file_in_this_folder(stem, suffix):
    name = safe_name(stem + suffix.upper())
    assert len(name) <= 84
    assert len(name.encode()) <= 204
    assert all(c in "_-" or unicodedata.category(c)[0] in "LMN" for c in name[:-4])
    assert unicodedata.is_normalized("NFC", name)
    assert name.endswith(suffix)
    assert not name.startswith("-")
    assert safe_name(name) == name
    assert Path("folder", name).parent == Path("folder")


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("07_01.amc", "07_01.amc"),
        ("Ein Gänger (2).BVH", "Ein-Gänger-2.bvh"),
        ("Ein Ga\u0308nger.BVH", "Ein-Gänger.bvh"),
        ("Пётр_01.bvh", "Пётр_01.bvh"),
        ("कि_01.c3d", "कि_01.c3d"),
        ("C:\\walks\\a.c3d", "a.c3d"),
        ("../../a.npz", "a.npz"),
        ("走る.trc", "走る.trc"),
        ("😀.trc", "capture.trc"),
        ("a.b.c.npz", "a-b-c.npz"),
    ],
)
def test_people_find_their_names_again(name, kept):
    assert safe_name(name) == kept


@pytest.mark.parametrize("name", ["a.exe", "bvh", "a.bvh.zip", "", "a."])
def test_other_files_are_refused_and_the_suffixes_named(name):
    with pytest.raises(
        Problem, match=r"file names must end in one of \.amc, \.bvh, \.c3d, \.csv, \.npz, \.trc, \.tsv, \.asf"
    ) as no:
        safe_name(name)
    (error,) = no.value.errors
    assert (no.value.status_code, error["field"]) == (422, "/files")
    assert error["bound"] == {"expected": ".amc .bvh .c3d .csv .npz .trc .tsv .asf"}


@pytest.mark.parametrize(("few", "most"), [(True, 2), (False, 500)])
def test_the_document_tells_the_fields_and_how_many_files(few, most):
    (content,) = as_fields(FitFields.model_json_schema(), few)["requestBody"]["content"].values()
    told = content["schema"]
    assert set(told["properties"]) == {*FitFields.model_fields, "files"}
    assert set(told["required"]) == {"kind", "name", "files"}
    files = told["properties"]["files"]
    assert (files["minItems"], files["maxItems"], files["items"]["format"]) == (1, most, "binary")
