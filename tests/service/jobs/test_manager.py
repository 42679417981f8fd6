"""What lies between requests and jobs: refusals before any work, and jobs found again."""

import time

import motionenv
from service.jobs.store import Job, Store
from service.schemas.jobs import RenderRequest
from tests.service.jobs.handing import LONG, as_file, ended, uploads


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


def test_the_same_key_gives_the_same_job(job_server):
    body = {"seconds": 0.2, "seed": 1, "picture": {"width": 32, "height": 32}}
    headers = {"Idempotency-Key": "one"}
    first = job_server.http.post("/v1/jobs/render", json=body, headers=headers)
    second = job_server.http.post("/v1/jobs/render", json=body, headers=headers)
    assert first.json()["id"] == second.json()["id"]
    other = job_server.http.post("/v1/jobs/render", json=body | {"seed": 2}, headers=headers)
    assert other.status_code == 422
    assert ended(job_server, first)["status"] == "done"
