"""What is counted across processes."""

import asyncio
import time

import psycopg
import pytest
from limits import RateLimitItemPerSecond
from limits.aio.strategies import FixedWindowRateLimiter

from service.cluster import counts
from service.cluster.counts import SharedCounts, SharedStreams
from service.cluster.database import Database
from tests.service.jobs.blocking import Blocking


@pytest.fixture
def connect(postgres, runner):
    """Makes connections to one database, as of processes of their own."""
    url, made = postgres.new(), []

    def connected() -> Database:
        made.append(Database(url, 3))
        runner.run(made[-1].open())
        return made[-1]

    yield connected
    for database in made:
        runner.run(database.close())


def test_a_limit_is_of_all_processes_and_begins_anew(connect, runner):
    one, two = (Blocking(FixedWindowRateLimiter(SharedCounts(connect())), runner) for _ in range(2))
    most = RateLimitItemPerSecond(5, 2)
    assert [process.hit(most, "anna") for process in (one, two) * 3] == [True] * 5 + [False]
    assert two.hit(most, "bert")
    reset, remaining = one.get_window_stats(most, "anna")
    assert (remaining, one.get_window_stats(most, "bert").remaining) == (0, 4)
    assert 0 < reset - time.time() <= 2.5
    while time.time() < reset:
        time.sleep(0.05)
    assert one.get_window_stats(most, "anna").remaining == 5
    assert one.hit(most, "anna")
    assert two.get_window_stats(most, "anna").remaining == 4


def test_many_hits_at_once_are_all_counted(connect, runner):
    storage = [SharedCounts(connect()) for _ in range(2)]

    async def hit() -> list[int]:
        return await asyncio.gather(*(storage[i % 2].incr("k", 60) for i in range(100)))

    assert sorted(runner.run(hit())) == list(range(1, 101))
    count = Blocking(storage[0], runner)
    count.clear("k")
    assert count.get("k") == 0
    assert count.check()
    count.incr("k", 60)
    count.reset()
    assert count.get("k") == 0


def test_counters_that_count_no_more_go(connect, runner):
    count = Blocking(SharedCounts(connect()), runner)
    count.incr("old", 0)
    count.incr("new", 60)
    count.drop_expired()
    with psycopg.connect(count.database.url) as connection:
        assert connection.execute("SELECT key FROM motionenv_counts").fetchall() == [("new",)]


def test_streams_of_all_processes_are_counted(connect, runner):
    one, two = (Blocking(SharedStreams(connect(), 3), runner) for _ in range(2))
    assert [process.take() for process in (one, two, one, two)] == [True, True, True, False]
    one.release()
    assert not two.take()  # it isn't told yet
    one.beat()
    assert two.take()
    assert not one.take()
    two.leave()
    assert one.take()


def test_streams_of_a_process_that_is_dead_are_not_counted(connect, runner, monkeypatch):
    dead, other = (Blocking(SharedStreams(connect(), 1), runner) for _ in range(2))
    assert dead.take()
    assert not other.take()
    monkeypatch.setattr(counts, "_DEAD", 0.2)
    time.sleep(0.3)
    assert other.take()


def test_many_that_ask_at_once_get_no_more_than_there_are(connect, runner):
    processes = [SharedStreams(connect(), 4) for _ in range(3)]

    async def ask() -> list[bool]:
        return await asyncio.gather(*(process.take() for process in processes * 4))

    assert sum(runner.run(ask())) == 4
