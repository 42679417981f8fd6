"""A bounded thread pool for blocking work.

A request takes a slot after its body has arrived, so that slow uploads hold none; if too many wait, it gets 503.
"""

import asyncio
import ctypes
import math
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import TypeVar

from prometheus_client import Gauge

from service.errors import busy

T = TypeVar("T")
_END = object()
_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc, which otherwise keeps what films took, 200 MB
_NEW = 0.2  # share of the last request in the mean time


class Slot:
    """The right to use one of the `free` threads, which can be released while there is nothing to compute."""

    def __init__(self, free: asyncio.Semaphore) -> None:
        self._free, self._held = free, False

    async def acquire(self) -> None:
        """Wait for a thread."""
        await self._free.acquire()
        self._held = True

    def release(self) -> None:
        """Release the thread, if it is held."""
        if self._held:
            self._held = False
            self._free.release()


class WorkerPool:
    """Threads for requests. At most `waiting` requests wait for one; the gauge counts those that hold or await one."""

    def __init__(self, threads: int, waiting: int, gauge: Gauge | None = None) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="compute")
        self._free = asyncio.Semaphore(threads)
        self._threads, self._most = threads, threads + waiting
        self._usual = 1.0  # [s] that a slot is held, a running mean
        self.held, self._gauge = 0, gauge or Gauge("held", "Slots that are held.", registry=None)

    @asynccontextmanager
    async def slot(self) -> AsyncIterator["Slot"]:
        """A thread, held for the duration of the block; 503 with the time that the queue takes if too many wait."""
        if self.held >= self._most:
            wait = math.ceil(self.held * self._usual / self._threads)
            raise busy("too many requests wait for a worker thread", wait)
        self.held += 1
        self._gauge.inc()
        slot = Slot(self._free)
        try:
            await slot.acquire()
            begun = time.monotonic()
            yield slot
            self._usual += _NEW * (time.monotonic() - begun - self._usual)
        finally:
            slot.release()
            self.held -= 1
            self._gauge.dec()

    async def run(self, work: Callable[[], T]) -> T:
        """Run `work()` in a thread and return its result; 503 if too many requests wait."""
        async with self.slot():
            return await self.step(work)

    async def step(self, work: Callable[[], T]) -> T:
        """Run `work()` in the thread of a `slot()` that the caller holds."""
        return await asyncio.get_running_loop().run_in_executor(self._pool, work)

    async def stream(self, chunks: Iterator[bytes]) -> AsyncGenerator[bytes, None]:
        """Iterate over `chunks` in the thread of a `slot()` that the caller holds, and close it in the end.

        On cancellation the current chunk isn't awaited; the iterator is closed after it, as a running one can't be.
        """
        step: Future | None = None
        try:
            while True:
                step = self._pool.submit(next, chunks, _END)
                chunk = await asyncio.wrap_future(step)
                if chunk is _END:
                    return
                yield chunk
        finally:
            if step is not None:
                step.add_done_callback(lambda _: self._pool.submit(_end, chunks))

    def close(self) -> None:
        """Finish running work and accept no more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _end(chunks: Iterator[bytes]) -> None:
    """Close an iterator, and give the memory that it took back to the system."""
    if close := getattr(chunks, "close", None):
        close()
    if _TRIM:
        _TRIM(0)
