"""What every store of jobs remembers."""

import time

import pytest

from service.jobs.store import ATTEMPTS, Full, Job, Repeated, SqliteStore, Taken, Waiting
from tests.service.jobs.blocking import Blocking
from tests.service.jobs.storing import Alone, added


@pytest.fixture
def store(tmp_path, runner):
    store = Alone(SqliteStore(tmp_path / "jobs.sqlite", lambda: False), runner)
    yield store
    store.close()


def test_what_is_put_in_comes_out(store):
    job = added(store, "b", "a", key="one", owner="anna")
    found = store.get(job.id)
    assert found == job
    assert store.same("one") == job
    assert store.same("two") is store.get("no") is None
    assert store.inputs(job.id) == [("b.npz", "b"), ("a.npz", "a")]
    assert store.counts() == {"queued": 1}
    assert (store.queued("long"), store.queued("quick"), store.last()) == (1, 0, found.number)
    with pytest.raises(Repeated):
        added(store, key="one")


def test_jobs_run_in_the_order_of_their_coming_and_end_once(store):
    jobs = [added(store, "x") for _ in range(3)]
    claimed = [store.claim_next() for _ in jobs]
    assert [job.id for job in claimed] == [job.id for job in jobs]
    assert store.claim_next() is None
    assert store.running() == {job.id for job in jobs}
    store.progress(claimed[0], 0.5, "half")
    assert store.get(jobs[0].id).progress == 0.5
    assert store.finish(claimed[0], "sha", 7, lambda: None)
    assert store.fail(claimed[1], 422, "no good")
    assert store.cancel(jobs[2].id)
    done, failed, cancelled = (store.get(job.id) for job in jobs)
    assert (done.status, done.progress, done.result, done.size) == ("done", 1.0, "sha", 7)
    assert (failed.status, failed.error) == ("failed", {"status": 422, "detail": "no good"})
    assert cancelled.status == "cancelled"
    assert not store.finish(claimed[2], "sha", 1, lambda: None)
    assert not store.fail(claimed[2], 500, "late")
    assert not store.cancel(jobs[0].id)
    store.put_back(claimed[2])
    assert store.counts() == {"done": 1, "failed": 1, "cancelled": 1}
    for job in (done, failed, cancelled):
        assert job.created <= job.ended <= time.time() + 5


def test_pages_and_removal(store):
    jobs = [added(store, owner="anna" if i % 2 else "bert") for i in range(6)][::-1]
    page = store.page(3)
    assert page == jobs[:3]
    assert store.page(10, None, page[-1].number) == jobs[3:]
    assert store.page(10, None, None, "anna") == jobs[::2]
    assert store.page(10, "done") == []
    assert not store.remove(jobs[0].id)
    store.cancel(jobs[0].id)
    assert store.remove(jobs[0].id)
    assert store.get(jobs[0].id) is None
    assert store.last() == page[0].number


def test_bounds_of_the_queue(store):
    added(store, model="fitted/a")
    with pytest.raises(Taken):
        added(store, model="fitted/a")
    added(store, model="fitted/b", most=2)
    with pytest.raises(Waiting):
        added(store, most=2)
    added(store, most=1, kind="inspect")  # another lane


def test_what_can_not_be_published_or_placed_leaves_nothing(store):
    def no() -> None:
        raise OSError("no")

    job = Job("a", "fit", {}, None, "application/json", "a.json", time.time())
    with pytest.raises(OSError, match="no"):
        store.add(job, [("a", "a")], most=5, idempotency=None, place=no)
    assert store.counts() == {}
    added(store, "x")
    job = store.claim_next()
    with pytest.raises(OSError, match="no"):
        store.finish(job, "sha", 1, no)
    assert (store.get(job.id).status, store.get(job.id).result) == ("running", None)


def test_files_go_with_the_last_that_needs_them(store):
    old = added(store, "shared", "old")
    added(store, "shared")
    for _ in range(2):
        job = store.claim_next()
        store.finish(job, f"result-{job.id}", 1, lambda: None)
        time.sleep(0.05)
    assert store.expire(time.time() - 60) == 0
    assert store.expire(store.get(old.id).ended + 0.01) == 1
    gone: list[str] = []
    store.sweep(["shared", "old", f"result-{old.id}", f"result-{job.id}"], gone.append)
    assert gone == ["old", f"result-{old.id}"]


def test_a_shutdown_is_no_fault_of_the_jobs(store):
    job = added(store, "x")
    for _ in range(2 * ATTEMPTS):
        store.put_back(store.claim_next())
    assert (store.get(job.id).status, store.get(job.id).attempts) == ("queued", 0)
    store.put_back(store.claim_next(), begun=True)
    assert store.get(job.id).attempts == 1


def test_interrupted_jobs_begin_again_until_they_are_given_up(tmp_path, runner):
    store = Alone(SqliteStore(tmp_path / "jobs.sqlite", lambda: False), runner)
    job = added(store, "x")
    for i in range(ATTEMPTS):
        assert store.claim_next().attempts == i + 1
        assert store.recover() == [job.id]
    told = store.get(job.id)
    assert (told.status, told.error["status"]) == ("failed", 500)
    store.close()


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
