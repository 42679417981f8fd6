"""What SQLite remembers of jobs, and the files beside it."""

import time

import pytest

from service.jobs.sqlite import SqliteStore
from service.jobs.store import ATTEMPTS, Full
from tests.service.jobs.blocking import Blocking
from tests.service.jobs.storing import added


@pytest.fixture
def store(tmp_path, runner):
    store = Blocking(SqliteStore(tmp_path / "jobs.sqlite", lambda: False), runner)
    yield store
    store.close()


def test_interrupted_jobs_begin_again_until_they_are_given_up(store):
    job = added(store, "x")
    for i in range(ATTEMPTS):
        assert store.claim("long").attempts == i + 1
        assert store.recover() == [job.id]
    told = store.get(job.id)
    assert (told.status, told.error["status"]) == ("failed", 500)
    other = added(store, "x")
    for _ in range(2 * ATTEMPTS):  # a shutdown is no fault of the job's
        store.claim("long")
        store.put_back(other)
    assert (store.get(other.id).status, store.get(other.id).attempts) == ("queued", 0)


def test_old_jobs_expire_and_files_go_with_the_last_that_needs_them(store):
    old, new = added(store, "shared", "old"), added(store, "shared")
    for job in (old, new):
        store.claim("long")
        store.finish(job, f"result-{job.id}", 1, None, lambda: None)
    now = time.time()
    assert store.expire(now - 60) == 0
    store._db.execute("UPDATE jobs SET ended = ? WHERE id = ?", (now - 100, old.id))
    assert store.expire(now - 60) == 1
    gone: list[str] = []
    store.sweep(["shared", "old", f"result-{old.id}", f"result-{new.id}"], gone.append)
    assert gone == ["old", f"result-{old.id}"]


def test_a_full_disk_refuses_new_jobs_and_lets_old_ones_end(tmp_path, runner):
    """SQLite is told that its file may grow no more: the error is the one of a full disk."""
    made_room = []

    def make_room() -> bool:
        made_room.append(True)
        store._db.execute("PRAGMA max_page_count = 100000")
        return True

    store = Blocking(SqliteStore(tmp_path / "jobs.sqlite", make_room), runner)
    jobs = [added(store, "x") for _ in range(20)]
    store._db.execute("PRAGMA max_page_count = 1")
    with pytest.raises(Full):
        list(map(lambda _: added(store, "x" * 500), range(10_000)))
    assert not made_room
    before = store.counts()
    for _ in jobs:
        store.claim("long")
    for job in jobs:
        assert store.fail(job, 422, "why " * 2000)
    assert made_room
    assert store.counts() == {"failed": 20, **({"queued": before["queued"] - 20} if before["queued"] > 20 else {})}
    store.close()
