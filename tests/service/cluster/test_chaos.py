"""Many jobs, while workers are killed, the database is restarted and connections are cut.

The jobs take a moment and no CPU (`tests.service.cluster.light`): two cores that begin a worker every two seconds have
none to spare, and a job's own process is killed in `test_worker` and `tests/service/jobs/test_runner.py`.
"""

import hashlib
import random
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import psycopg
import pytest

from service.cluster.objects import SharedFiles
from tests.service.cluster.many import BUCKET, servers, workers
from tests.service.jobs.handing import uploads
from tests.service.waiting import until

LEASE = 3  # [s]
LIGHT = "tests.service.cluster.light"


class Trouble:
    """Kills a worker every two seconds, restarts the database twice, and cuts connections, until it is stopped."""

    def __init__(self, running, postgres, url: str, every: float, restarts: list[float]):
        self.workers, self.postgres, self.url = running, postgres, url
        self.every, self.restarts = every, restarts
        self.told = Counter()
        self._over, self._thread = threading.Event(), threading.Thread(target=self._make)
        self._random = random.Random(1)

    @contextmanager
    def going_on(self) -> Iterator["Trouble"]:
        self._thread.start()
        try:
            yield self
        finally:
            self._over.set()
            self._thread.join()

    def _make(self) -> None:
        begun = time.monotonic()
        while not self._over.wait(self.every):
            worker = self._random.choice(self.workers)
            worker.kill()
            worker.begin()  # as systemd, or whatever runs containers, would
            self.told["kills"] += 1
            if self.restarts and time.monotonic() - begun > self.restarts[0]:
                self.postgres.restart()
                self.restarts.pop(0)
                self.told["restarts"] += 1
            elif self.told["kills"] % 3 == 0:
                self.told["cuts"] += self._cut()

    def _cut(self) -> int:
        with psycopg.connect(self.url, autocommit=True) as connection:
            return len(connection.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() "
                "AND pid <> pg_backend_pid() AND application_name = 'motionenv' ORDER BY random() LIMIT 3"
            ).fetchall())  # fmt: skip


def asked_until_answered(client: httpx.Client, method: str, path: str, **how) -> httpx.Response:
    """An answer other than that the service is away, as a client gets it that waits for some minutes."""
    begun = time.monotonic()
    while True:
        answer = client.request(method, path, **how)
        if answer.status_code != 503:
            return answer
        assert time.monotonic() - begun < 300, answer.text
        time.sleep(1)


def survived(tmp_path, postgres, s3, jobs: int, every: float, restarts: list[float]) -> dict[str, int]:
    """What became of a number of jobs."""
    url = postgres.new()
    shared = {"database": url, "store": f"{BUCKET}/{tmp_path.name}", "lease": LEASE}
    begun = time.monotonic()
    with (
        servers(tmp_path, 2, s3, job_waiting=10_000, **shared) as api,
        workers(tmp_path, 3, s3, LIGHT, quick_processes=2, **shared) as running,
    ):
        trouble = Trouble(running, postgres, url, every, restarts)
        with trouble.going_on():
            ids = [handed_in(api[i % 2].http, i) for i in range(jobs)]
            trouble.told["queued when all were handed in"] = jobs - Counter(states(api[0].http, ids))["done"]
            until(lambda: not {"queued", "running"} & set(states(api[0].http, ids)), seconds=1200)
        trouble.told["seconds"] = round(time.monotonic() - begun)
        assert len(set(ids)) == jobs
        assert Counter(states(api[1].http, ids)) == {"done": jobs}
        for i, job in enumerate(ids):
            result = asked_until_answered(api[i % 2].http, "GET", f"/v1/jobs/{job}/result")
            assert hashlib.sha256(result.content).hexdigest() == result.headers["ETag"].strip('"')
            assert result.content == b"HIERARCHY %ddone" % i
        ends = Counter(event["job"] for worker in running for event in worker.events("job done"))
        assert max(ends.values()) == 1
        trouble.told["interrupted"] = sum(len(worker.events("job was interrupted")) for worker in running)
        for job in ids:
            assert asked_until_answered(api[0].http, "DELETE", f"/v1/jobs/{job}").status_code == 204
    with pytest.MonkeyPatch.context() as patch:
        for name, value in s3.items():
            patch.setenv(name, value)
        left = SharedFiles(shared["store"], tmp_path / "left", 0, 0)
        with workers(tmp_path, 1, s3, LIGHT, **shared):  # one that begins sweeps
            until(lambda: not left.all(), seconds=60)
    return dict(trouble.told)


def handed_in(client: httpx.Client, number: int) -> str:
    """The id of a job with a file of its own."""
    body = {"files": uploads({f"walk{number}.bvh": b"HIERARCHY %d" % number}), "data": {"format": "text/csv"}}
    key = {"Idempotency-Key": f"job-{number}"}
    answer = asked_until_answered(client, "POST", "/v1/jobs/convert", headers=key, **body)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def states(client: httpx.Client, ids: list[str]) -> list[str]:
    """The status of each job."""
    found, cursor = {}, None
    while True:
        asked = {"limit": 500} | ({"before": cursor} if cursor else {})
        page = asked_until_answered(client, "GET", "/v1/jobs", params=asked).raise_for_status().json()
        found |= {job["id"]: job["status"] for job in page["jobs"]}
        cursor = page["next"]
        if cursor is None:
            return [found[job] for job in ids]


@pytest.mark.slow
def test_trouble_loses_no_job_and_doubles_none(tmp_path, postgres, s3):
    told = survived(tmp_path, postgres, s3, 40, every=2, restarts=[4])
    assert told["kills"]


@pytest.mark.benchmark
def test_five_hundred_jobs_outlive_much_trouble(tmp_path, postgres, s3, capsys):
    told = survived(tmp_path, postgres, s3, 500, every=2, restarts=[10, 30])
    assert told["restarts"] == 2
    with capsys.disabled():
        sys.stdout.write(f"\n500 jobs: {told}\n")
