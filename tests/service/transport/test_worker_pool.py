"""Threads for requests: no more than there are, a bounded queue, and streams that end when nobody listens."""

import asyncio
import threading
import time

import pytest

from service.errors import Problem
from service.transport.worker_pool import WorkerPool


def test_no_more_run_at_a_time_than_there_are_threads():
    pool, running, most, lock = WorkerPool(2, 10), 0, 0, threading.Lock()
    both = threading.Barrier(2, timeout=10)

    def work() -> str:
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        both.wait()  # until the other thread is here too
        with lock:
            running -= 1
        return threading.current_thread().name

    async def all_of_them() -> list[str]:
        return await asyncio.gather(*(pool.run(work) for _ in range(8)))

    names = asyncio.run(all_of_them())
    assert most == 2
    assert len(set(names)) == 2
    assert all(name.startswith("compute") for name in names)
    assert pool.held == 0
    pool.close()


def test_a_full_pool_refuses_with_503():
    async def filled() -> tuple[int, Problem]:
        pool, free = WorkerPool(1, 2), threading.Event()
        waiting = [asyncio.create_task(pool.run(free.wait)) for _ in range(3)]
        await asyncio.sleep(0)
        held = pool.held
        with pytest.raises(Problem, match="too many requests wait") as refused:
            await pool.run(lambda: None)
        free.set()
        assert await asyncio.gather(*waiting) == [True] * 3
        assert await pool.run(lambda: "again") == "again"
        pool.close()
        return held, refused.value

    held, refused = asyncio.run(filled())
    assert held == 3
    assert (refused.status_code, refused.headers["Retry-After"]) == (503, "3")


def test_who_is_refused_is_told_how_long_the_queue_takes():
    """60 works that are before it take 30 times as long on two threads as one usually does."""

    async def told(works: int, seconds: float) -> int:
        pool, free = WorkerPool(2, 58), threading.Event()
        for _ in range(works):
            await pool.run(lambda: time.sleep(seconds))
        waiting = [asyncio.create_task(pool.run(free.wait)) for _ in range(60)]
        await asyncio.sleep(0)
        with pytest.raises(Problem) as refused:
            await pool.run(lambda: None)
        free.set()
        await asyncio.gather(*waiting)
        pool.close()
        return int(refused.value.headers["Retry-After"])

    assert 4 <= asyncio.run(told(20, 0.1)) <= 7
    assert 11 <= asyncio.run(told(12, 0.3)) <= 16


def test_a_slot_that_is_lent_is_used_by_others():
    async def lent() -> str:
        pool = WorkerPool(1, 1)
        async with pool.slot() as slot:
            slot.release()
            slot.release()  # twice is once
            other = await pool.run(lambda: "other")
            await slot.acquire()
        assert pool.held == 0
        assert await pool.run(lambda: "next") == "next"
        pool.close()
        return other

    assert asyncio.run(asyncio.wait_for(lent(), 10)) == "other"


def test_what_work_raises_reaches_who_asked_and_frees_the_thread():
    async def failing() -> None:
        pool = WorkerPool(1, 0)
        with pytest.raises(ZeroDivisionError):
            await pool.run(lambda: 1 / 0)
        assert await pool.run(lambda: 2) == 2
        pool.close()

    asyncio.run(failing())


@pytest.mark.parametrize("taken", [1, 3, 10])
def test_a_stream_gives_its_chunks_in_order_and_is_closed(taken):
    closed, made = threading.Event(), []

    def chunks():
        try:
            for i in range(10):
                made.append(i)
                yield bytes([i])
        finally:
            closed.set()

    async def some() -> list[bytes]:
        pool, got = WorkerPool(1, 0), []
        stream = pool.stream(chunks())
        async for chunk in stream:
            got.append(chunk)
            if len(got) == taken:
                break
        await stream.aclose()
        assert await asyncio.to_thread(closed.wait, 10)
        pool.close()
        return got

    assert asyncio.run(some()) == [bytes([i]) for i in range(taken)]
    assert made == list(range(taken))
