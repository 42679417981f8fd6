"""Servers that share a database: counts, refusals while it is away, and settings that don't fit."""

import subprocess
import sys

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.service.cluster.many import BUCKET, servers
from tests.service.jobs.handing import SHORT
from tests.service.running import ROOT
from tests.service.waiting import until


def test_requests_and_streams_are_counted_by_all_servers_together(tmp_path, postgres, s3):
    shared = {"database": postgres.new(), "store": f"{BUCKET}/{tmp_path.name}", "rate": 12, "streams": 2}
    with servers(tmp_path, 2, s3, **shared) as (one, two):
        stream = lambda server: connect(f"ws{server.url[4:]}/v1/stream")
        with stream(one), stream(two), pytest.raises(InvalidStatus) as refused, stream(one):
            pass
        assert refused.value.response.status_code == 503
        assert int(refused.value.response.headers["Retry-After"]) > 0
        asked = [server.http.get("/v1/body") for server in (one, two) * 5]
        left = [int(answer.headers["ratelimit"].split("r=")[1].split(";")[0]) for answer in asked if answer.is_success]
        assert left == list(range(len(left) - 1, -1, -1))
        assert 5 <= len(left) < 10  # of twelve, the streams took some
        assert {answer.status_code for answer in asked[len(left) :]} == {429}


@pytest.mark.slow
def test_while_the_database_is_away_jobs_are_refused_and_walks_are_made(tmp_path, postgres, s3):
    shared = {"database": postgres.new(), "store": f"{BUCKET}/{tmp_path.name}"}
    with servers(tmp_path, 1, s3, **shared) as (server,):
        job = server.http.post("/v1/jobs/render", json=SHORT)
        assert job.status_code == 202
        told = server.http.get("/metrics").text
        assert 'motionenv_jobs{status="queued"} 1.0' in told
        postgres.stop()
        try:
            refused = server.http.post("/v1/jobs/render", json=SHORT)
            assert (refused.status_code, int(refused.headers["Retry-After"])) == (503, 10)
            assert "can't reach its database" in refused.json()["detail"]
            assert server.http.post("/v1/synthesis", json={"seconds": 0.5, "seed": 1}).status_code == 200
        finally:
            postgres.start()

        until(lambda: server.http.get(job.headers["Location"]).status_code == 200)


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--database", "postgresql://nobody@127.0.0.1:9/x"], "database needs store"),
        (["--store", "s3://x"], "store needs database"),
        (["--lease", "0"], "--lease: Input should be greater than or equal to 1"),
    ],
)
@pytest.mark.parametrize("module", ["service", "service.cluster"])
def test_settings_that_do_not_fit_are_told_in_a_line(module, flags, told):
    done = subprocess.run([sys.executable, "-m", module, *flags], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert told in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_worker_without_a_database_says_what_to_do(tmp_path):
    run = lambda *flags: subprocess.run(
        [sys.executable, "-m", "service.cluster", "--data", tmp_path, *flags], cwd=ROOT, capture_output=True, text=True,
        timeout=60,
    )  # fmt: skip
    done = run()
    assert (done.returncode, "set database and store" in done.stderr) == (2, True)
    away = run("--database", "postgresql://nobody@127.0.0.1:9/x", "--store", f"file://{tmp_path}/shared")
    assert away.returncode == 3
    assert "can't reach the database: is it running, and is --database right?" in away.stderr
    assert "Traceback" not in away.stderr
