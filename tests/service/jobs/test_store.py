"""What SQLite remembers of jobs, and the files beside it."""

import secrets
import time

import pytest

from service.jobs.store import ATTEMPTS, Full, Job, Store, Taken, Waiting


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "jobs.sqlite", lambda: False)
    yield store
    store.close()


def added(store: Store, *inputs: str, model: str | None = None, most: int = 100) -> Job:
    job = Job(secrets.token_urlsafe(16), "fit", {"a": [1.5]}, model, "application/json", "a.json", time.time())
    store.add(job, [(f"{sha}.npz", sha) for sha in inputs], most=most, idempotency=None, place=lambda: None)
    return job


def test_jobs_are_done_in_the_order_of_their_coming(store):
    jobs = [added(store, "x") for _ in range(3)]
    assert store.get(jobs[0].id) == jobs[0]
    assert [store.claim("long").id for _ in jobs] == [job.id for job in jobs]
    assert store.claim("long") is None
    assert store.running() == {job.id for job in jobs}


def test_the_end_of_a_job_is_final(store):
    job = added(store, "x")
    store.claim("long")
    assert store.end(job.id, "cancelled", "cancelled")
    assert not store.finish(job, "sha", 1, lambda: pytest.fail("published"))
    assert not store.end(job.id, "failed", "no")
    store.put_back(job.id)
    assert store.get(job.id).status == "cancelled"


def test_what_is_published_fails_as_a_whole(store):
    job = added(store, "x")
    store.claim("long")

    def publish() -> None:
        raise OSError("no")

    with pytest.raises(OSError, match="no"):
        store.finish(job, "sha", 1, publish)
    assert (store.get(job.id).status, store.get(job.id).result) == ("running", None)


def test_bounds_of_the_queue(store):
    added(store, model="fitted/a")
    with pytest.raises(Taken):
        added(store, model="fitted/a")
    added(store, model="fitted/b", most=2)
    with pytest.raises(Waiting):
        added(store, most=2)


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
        store.put_back(other.id)
    assert (store.get(other.id).status, store.get(other.id).attempts) == ("queued", 0)


def test_old_jobs_expire_and_files_go_with_the_last_that_needs_them(store):
    old, new = added(store, "shared", "old"), added(store, "shared")
    for job in (old, new):
        store.claim("long")
        store.finish(job, f"result-{job.id}", 1, lambda: None)
    now = time.time()
    assert store.expire(now - 60) == 0
    store._db.execute("UPDATE jobs SET ended = ? WHERE id = ?", (now - 100, old.id))
    assert store.expire(now - 60) == 1
    gone: list[str] = []
    store.sweep(["shared", "old", f"result-{old.id}", f"result-{new.id}"], gone.append)
    assert gone == ["old", f"result-{old.id}"]


def test_a_full_disk_refuses_new_jobs_and_lets_old_ones_end(tmp_path):
    """SQLite is told that its file may grow no more: the error is the one of a full disk."""
    made_room = []

    def make_room() -> bool:
        made_room.append(True)
        store._db.execute("PRAGMA max_page_count = 100000")
        return True

    store = Store(tmp_path / "jobs.sqlite", make_room)
    jobs = [added(store, "x") for _ in range(20)]
    store._db.execute("PRAGMA max_page_count = 1")
    with pytest.raises(Full):
        list(map(lambda _: added(store, "x" * 500), range(10_000)))
    assert not made_room
    before = store.counts()
    for job in jobs:
        assert store.end(job.id, "failed", "why " * 2000)
    assert made_room
    assert store.counts() == {"failed": 20, **({"queued": before["queued"] - 20} if before["queued"] > 20 else {})}
    store.close()
