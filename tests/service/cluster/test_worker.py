"""A service whose servers and workers share only a database and an object store."""

import psutil
import pytest

import motionenv
from tests.service.cluster.many import BUCKET, servers, workers
from tests.service.jobs.handing import LONG, SHORT, as_file, ended, some_walks, until_running, uploads
from tests.service.waiting import until


@pytest.mark.slow
def test_what_one_server_takes_another_gives(tmp_path, postgres, s3):
    shared = {"database": postgres.new(), "store": f"{BUCKET}/{tmp_path.name}", "lease": 3}
    with servers(tmp_path, 2, s3, **shared) as (one, two), workers(tmp_path, 1, s3, **shared) as _:
        walk = as_file(motionenv.synthesize("walk/fpca", 2, 60, seed=1), ".bvh")
        asked = one.http.post("/v1/jobs/convert", files=uploads({"a.bvh": walk}), data={"format": "model/gltf-binary"})
        assert asked.status_code == 202
        assert ended(two, asked)["status"] == "done"
        given = [server.http.get(f"{asked.headers['Location']}/result").content for server in (one, two)]
        assert given[0] == given[1]
        assert given[0].startswith(b"glTF")
        # a model that one server is told of is there at the other at once, and has the same version
        fit = {"files": uploads(some_walks()), "data": {"kind": "eigenwalkers", "name": "ours"}}
        fitting = one.http.post("/v1/models", **fit)
        assert ended(two, fitting)["status"] == "done", two.http.get(fitting.headers["Location"]).json()
        body = {"model": "fitted/ours", "seconds": 1, "seed": 1}
        answers = [server.http.post("/v1/synthesis", json=body) for server in (two, one)]
        assert [answer.status_code for answer in answers] == [200, 200]
        assert answers[0].content == answers[1].content
        assert answers[0].headers["etag"] == answers[1].headers["etag"]
        films = [server.http.post("/v1/jobs/render", json=SHORT | {"model": "fitted/ours"}) for server in (one, two)]
        assert [ended(one, film)["status"] for film in films] == ["done", "done"]
        taken = two.http.post("/v1/models", **fit)
        assert taken.status_code == 409
        assert two.http.delete("/v1/models/fitted/ours").status_code == 204
        until(lambda: one.http.post("/v1/synthesis", json=body).status_code == 404)
        assert two.http.delete(asked.headers["Location"]).status_code == 204
        assert one.http.get(asked.headers["Location"]).status_code == 404


@pytest.mark.slow
def test_what_ran_when_a_worker_was_stopped_or_killed_runs_again(tmp_path, postgres, s3):
    shared = {"database": postgres.new(), "store": f"{BUCKET}/{tmp_path.name}", "lease": 2}
    with servers(tmp_path, 1, s3, **shared) as (server,):
        with workers(tmp_path, 1, s3, **shared) as _:
            running = server.http.post("/v1/jobs/render", json=LONG)
            until_running(server, running)
        assert server.http.get(running.headers["Location"]).json()["status"] == "queued"  # it was put back
        with workers(tmp_path, 2, s3, **shared) as (first, second):
            until_running(server, running)
            busy, idle = (first, second) if _busy(first) else (second, first)
            busy.kill()
            until(lambda: _busy(idle))
            assert server.http.delete(running.headers["Location"]).json()["status"] == "cancelled"
            until(lambda: not _busy(idle))


def _busy(worker) -> bool:
    """Whether a process runs a job of this worker's."""
    return bool(psutil.Process(worker.process.pid).children())
