"""`/v1/jobs`: listing, waiting, cancelling and removing."""

import io
import json
import time

import av
import pytest
from PIL import Image

import motionenv
from tests.service.jobs.handing import LONG, SHORT, as_file, ended, processes, result, until_running, uploads
from tests.service.waiting import until


def test_a_running_job_is_cancelled_and_its_process_killed(job_server):
    asked = job_server.http.post("/v1/jobs/render", json=LONG)
    until_running(job_server, asked)
    where = asked.headers["Location"]
    assert job_server.http.get(f"{where}/result").status_code == 409
    cancelled = job_server.http.delete(where)
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    until(lambda: not processes(job_server))
    until(lambda: not list((job_server.data / "work").iterdir()))
    assert job_server.http.delete(where).status_code == 204
    assert job_server.http.get(where).status_code == 404


def test_what_is_cancelled_is_kept_and_what_has_ended_is_not_cancelled(job_server):
    body = {"seconds": 0.2, "seed": 1, "picture": {"width": 32, "height": 32}}
    done, running, waiting = (job_server.http.post("/v1/jobs/render", json=asked) for asked in (body, LONG, LONG))
    until_running(job_server, running)
    for answer in (waiting, running, running):
        cancelled = job_server.http.post(f"{answer.headers['Location']}/cancel")
        assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    assert job_server.http.get(running.headers["Location"]).json() == cancelled.json()
    late = job_server.http.post(f"{done.headers['Location']}/cancel")
    assert (late.status_code, "is done" in late.json()["detail"]) == (409, True)
    assert result(job_server, ended(job_server, done)).content[4:8] == b"ftyp"
    assert job_server.http.post("/v1/jobs/nothing/cancel").status_code == 404


def test_a_full_queue_is_said_and_waiting_jobs_are_listed(job_server):
    running = job_server.http.post("/v1/jobs/render", json=LONG)
    until_running(job_server, running)
    waiting = [job_server.http.post("/v1/jobs/render", json=LONG) for _ in range(3)]
    refused = job_server.http.post("/v1/jobs/render", json=LONG)
    assert (refused.status_code, int(refused.headers["Retry-After"]) >= 1) == (503, True)
    walk = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=5), ".npz")
    quick = job_server.http.post("/v1/jobs/inspect", files=uploads({"a.npz": walk}))
    assert ended(job_server, quick)["status"] == "done"  # it doesn't wait behind films
    ids = [answer.json()["id"] for answer in waiting]
    listed = job_server.http.get("/v1/jobs", params={"status": "queued"}).json()
    assert [job["id"] for job in listed["jobs"]] == ids[::-1]
    first = job_server.http.get("/v1/jobs", params={"status": "queued", "limit": 2}).json()
    second = job_server.http.get("/v1/jobs", params={"status": "queued", "limit": 2, "before": first["next"]}).json()
    assert [job["id"] for job in first["jobs"] + second["jobs"]] == ids[::-1]
    assert second["next"] is None
    until(lambda: 'motionenv_jobs{status="queued"} 3.0' in job_server.http.get("/metrics").text)
    for answer in [*waiting, running]:
        assert job_server.http.delete(answer.headers["Location"]).json()["status"] == "cancelled"


def test_unknown_models_and_too_much_are_refused(job_server):
    assert job_server.http.post("/v1/jobs/render", json={"model": "fitted/nothing"}).status_code == 404
    wide = {"picture": {"width": 4096, "height": 4096}}
    assert job_server.http.post("/v1/jobs/render", json=wide).status_code == 422
    assert job_server.http.post("/v1/jobs/render", json={"seconds": 3600, "fps": 240}).status_code == 422
    assert job_server.http.get("/v1/jobs/nothing").status_code == 404
    assert job_server.http.delete("/v1/jobs/nothing").status_code == 404
    assert job_server.http.get("/v1/jobs/nothing/result").status_code == 404
    assert job_server.http.get("/v1/jobs/nothing", params={"wait": 31}).status_code == 422


def test_models_are_not_asked_for_under_names_that_are_paths(job_server):
    for name in ("..%2f..%2fjobs", "%2e%2e", "A", "a" * 64, "-x"):
        assert job_server.http.delete(f"/v1/models/fitted/{name}").status_code in (404, 422)
    for name in ("../x", "x/y", "X", "", "a" * 64, ".hidden"):
        answer = job_server.http.post("/v1/models", files=uploads({"a.bvh": b"x"}), data={"kind": "tree", "name": name})
        assert answer.status_code == 422


@pytest.mark.slow
@pytest.mark.parametrize("media_type", ["image/gif", "image/webp"])
def test_a_film_that_takes_long_becomes_a_job_by_itself(job_server, media_type):
    asked = SHORT | {"seconds": 16, "fps": 10, "picture": {"width": 800, "height": 640}}  # 82 million pixels
    queued = job_server.http.post("/v1/synthesis", json=asked, headers={"Accept": media_type})
    assert (queued.status_code, queued.json()["kind"], queued.json()["media_type"]) == (202, "render", media_type)
    assert queued.headers["location"] == f"/v1/jobs/{queued.json()['id']}"
    film = result(job_server, ended(job_server, queued, 300))
    assert film.headers["content-type"] == media_type
    image = Image.open(io.BytesIO(film.content))
    assert (image.size, image.n_frames) == ((800, 640), 160)
    text = {"format": media_type, **{name: json.dumps(value) for name, value in asked.items()}}
    (error,) = job_server.http.get("/v1/synthesis", params=text).json()["errors"]
    assert error == {"field": "/seconds", "problem": error["problem"], "bound": {"le": 14.4}}  # 144 frames


@pytest.mark.slow
def test_a_film_that_streams_may_take_longer_than_a_request_may(serving, tmp_path):
    asked = SHORT | {"seconds": 30, "fps": 30, "picture": {"width": 320, "height": 240}}
    post = lambda server, what: server.http.post(
        "/v1/synthesis", json=what, headers={"Accept": "video/mp4"}, timeout=180
    )
    with serving(tmp_path, request_seconds=3) as server:
        until(lambda: post(server, SHORT).status_code == 200)  # compiled by now
        begun = time.monotonic()
        film = post(server, asked)
        assert time.monotonic() - begun > 3
    with av.open(io.BytesIO(film.content)) as container:
        assert sum(1 for _ in container.decode(video=0)) == 900
