"""What only a store that many share has to: leases, and connections that break."""

import asyncio
import signal
import threading
import time

import psycopg
import pytest

from service.jobs.store import ATTEMPTS, Job
from tests.service.jobs.storing import LEASE, added, shared_store


@pytest.fixture
def url(postgres) -> str:
    return postgres.new()


@pytest.fixture
def connect(url, runner):
    """Makes stores of the same database, each as of a process of its own."""
    stores = []

    def connected():
        stores.append(shared_store(url, runner, patience=60))
        return stores[-1]

    yield connected
    for store in stores:
        store.database.close()


def test_a_model_is_recorded_with_the_job_that_made_it(connect, url):
    store = connect()
    for sha in ("first", "second"):
        added(store, model="fitted/mine", owner="anna")
        assert store.finish(store.claim_next(), f"result-{sha}", 1, sha, lambda: None)
        with psycopg.connect(url) as connection:
            (row,) = connection.execute("SELECT name, owner, sha FROM motionenv_models").fetchall()
        assert row == ("fitted/mine", "anna", sha)
    gone: list[str] = []
    store.sweep(["first", "second"], gone.append)
    store.forget("fitted/mine")
    store.sweep(["second"], gone.append)
    assert gone == ["first", "second"]


def test_the_jobs_of_a_silent_worker_are_given_to_another_which_alone_can_end_them(connect):
    silent, other = connect(), connect()
    job = added(silent, "x")
    lost = silent.claim_next()
    assert other.recover() == []
    until = time.monotonic() + 10 * LEASE
    while not (found := other.recover()):
        assert time.monotonic() < until
        time.sleep(LEASE / 10)
    assert found == [job.id]
    assert silent.running() == set()
    again = other.claim_next()
    assert (again.id, again.attempts) == (job.id, 2)
    assert not silent.finish(lost, "silent", 1, None, lambda: None)
    assert not silent.fail(lost, 500, "silent")
    silent.progress(lost, 0.9, "silent")
    silent.put_back(lost)
    assert (other.get(job.id).status, other.get(job.id).progress) == ("running", 0)
    assert other.finish(again, "other", 1, None, lambda: None)
    assert other.get(job.id).result == "other"


def test_who_renews_keeps_its_jobs(connect):
    store, other = connect(), connect()
    job = added(store, "x")
    store.claim_next()
    for _ in range(15):
        assert store.running() == {job.id}
        time.sleep(LEASE / 5)
        assert other.recover() == []


def test_jobs_that_kill_their_workers_are_given_up(connect):
    store, other = connect(), connect()
    job = added(store, "x")
    for _ in range(ATTEMPTS):
        assert store.claim_next()
        while not other.recover():
            time.sleep(LEASE / 10)
    told = store.get(job.id)
    assert (told.status, told.error["status"]) == ("failed", 500)


def test_a_ticket_that_was_lost_before_its_job_began_is_made_again(connect, url):
    store = connect()
    job = added(store, "x")
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("DELETE FROM procrastinate_jobs")
    assert store.recover() == [job.id]
    with psycopg.connect(url, autocommit=True) as connection:  # a worker took it, and ended
        connection.execute("SELECT procrastinate_fetch_job_v2(NULL, NULL)")
    assert store.recover() == [job.id]
    assert store.claim_next().id == job.id


def test_many_at_once_take_each_job_once(connect, url):
    """Threads with stores of their own, which claim as fast as they can."""
    store = connect()
    jobs = [added(store, "x").id for _ in range(60)]
    taken: list[str] = []

    def take() -> None:
        with asyncio.Runner() as runner:
            store = shared_store(url, runner, lease=60)
            while job := store.claim_next():
                taken.append(job.id)
                assert store.finish(job, "sha", 1, None, lambda: None)
            store.database.close()

    threads = [threading.Thread(target=take) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(taken) == sorted(jobs)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_restart_of_the_database_is_waited_for(connect, postgres, how):
    store = connect()
    job = added(store, "x")
    claimed = store.claim_next()
    postgres.stop(how)
    starting = threading.Timer(1, postgres.start)
    starting.start()
    assert store.get(job.id).status == "running"
    starting.join()
    assert store.finish(claimed, "sha", 1, None, lambda: None)


def test_a_connection_that_breaks_in_the_middle_adds_a_job_once(connect, url):
    store, cut = connect(), []

    def place() -> None:  # within the transaction
        if not cut:
            cut.append(True)
            with psycopg.connect(url, autocommit=True) as connection:
                connection.execute(
                    "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() "
                    "AND pid <> pg_backend_pid()"
                )

    job = Job("a", "fit", {}, None, "application/json", "a.json", time.time())
    store.add(job, [("a", "a")], most=5, idempotency=None, place=place)
    assert cut
    assert store.counts() == {"queued": 1}
    assert store.inputs("a") == [("a", "a")]
