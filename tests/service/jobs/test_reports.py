"""Gait reports as jobs: a page that browsers show without giving it access, or its numbers."""

import csv
import io

import pytest

import motionenv
from motionenv.types import MARKERS
from tests.service.jobs.handing import as_c3d, as_file, ended, odd_map, odd_points, result, uploads


@pytest.fixture(scope="module")
def walk():
    return motionenv.synthesize("walk/fpca", 8, 60, seed=3, speed=1.2)


def reported(server, files: dict[str, bytes], **fields):
    """The result of a report on files."""
    return result(server, ended(server, server.http.post("/v1/jobs/report", files=uploads(files), data=fields)))


def test_a_report_is_a_page_without_access(job_server, walk):
    answer = reported(job_server, {"me_01.npz": as_file(walk, ".npz")})
    assert answer.headers["Content-Type"].startswith("text/html")
    assert answer.headers["Content-Disposition"] == 'inline; filename="report.html"'
    policy = answer.headers["Content-Security-Policy"]
    assert policy.startswith("sandbox")
    assert "default-src 'none'" in policy
    assert "<title>Gait report: walk</title>" in answer.text


def test_a_forgotten_report_is_told_in_words_to_who_looks_at_it(job_server, walk):
    path = reported(job_server, {"me_01.npz": as_file(walk, ".npz")}).request.url.path
    assert job_server.http.delete(path.removesuffix("/result")).status_code == 204
    looked = job_server.http.get(path, headers={"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"})
    assert (looked.status_code, looked.headers["Vary"]) == (404, "Accept")
    assert looked.headers["Content-Type"].startswith("text/html")
    assert "were forgotten" in looked.text
    assert '<a href="/">' in looked.text
    for accept in ("*/*", "application/json", "application/problem+json, text/html"):
        told = job_server.http.get(path, headers={"Accept": accept})
        assert (told.status_code, told.headers["Content-Type"]) == (404, "application/problem+json")
    odd = job_server.http.get("/<b>no</b>", headers={"Accept": "text/html"})
    assert (odd.status_code, "<b>" in odd.text) == (404, False)


def test_a_file_has_as_many_strides_wherever_they_are_told(job_server, walk):
    files = {"me_01.npz": as_file(walk, ".npz")}
    asked = job_server.http.post("/v1/jobs/inspect", files=uploads(files))
    (seen,) = result(job_server, ended(job_server, asked)).json()["files"]
    (capture,) = reported(job_server, files, format="application/json").json()["captures"]
    assert seen["strides"] == capture["sides"]
    assert sum(seen["strides"].values()) == capture["strides"] > 8


def test_the_numbers_of_a_report_come_as_json_and_csv(job_server, walk):
    content = {"me_01.c3d": as_c3d(*odd_points(walk), 60)}
    told = reported(job_server, content, map=odd_map(), format="application/json")
    assert told.headers["Content-Disposition"] == 'attachment; filename="report.json"'
    assert isinstance(told.json(), dict)
    rows = list(csv.reader(io.StringIO(reported(job_server, content, map=odd_map(), format="text/csv").text)))
    assert len(rows) > 1
    assert len(rows[0]) > 1


def test_an_age_brings_norms(job_server, walk):
    files = {"me_01.npz": as_file(walk, ".npz")}
    told = reported(job_server, files, format="application/json", age="33", sex="female").json()
    assert [(norm["name"], norm["sex"], norm["mean"]) for norm in told["norms"]] == [("speed", "female", 1.337)]
    answer = job_server.http.post("/v1/jobs/report", files=uploads(files), data={"age": "-1"})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "/age")


def test_the_static_trial_is_not_reported_on(job_server, walk):
    still = motionenv.Motion(walk.poses[:1].repeat(60, axis=0), walk.skeleton, 60)
    files = {"me 01.c3d": as_c3d(*odd_points(walk), 60), "at rest.c3d": as_c3d(*odd_points(still), 60)}
    told = reported(job_server, files, map=odd_map(MARKERS), static="at rest.c3d")
    assert "me-01" in told.text


@pytest.mark.parametrize("static", ["b.c3d", "a.txt", "a", "a.c3d", ""])
def test_a_static_trial_must_be_one_of_several_files(job_server, static):
    answer = job_server.http.post("/v1/jobs/report", files=uploads({"a.c3d": b"\x02\x50"}), data={"static": static})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "/static"


def test_other_formats_than_a_reports_are_refused(job_server):
    data = {"format": "application/pdf"}
    answer = job_server.http.post("/v1/jobs/report", files=uploads({"a.c3d": b"\x02\x50"}), data=data)
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "/format")
