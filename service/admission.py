"""Work that takes longer than an event loop may stand still: in threads, as many as there are cores, and no pile-up.

A request reserves its place before it does any work and after its body has come, so that slow bodies hold no places
(service.problems.busy tells whoever finds none).
"""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import TypeVar

from prometheus_client import Gauge

from service.problems import busy

T = TypeVar("T")
_END = object()


class Place:
    """A thread that is held, or lent to others while there is nothing to compute.

    Args:
        free: counts the threads that nobody holds.
    """

    def __init__(self, free: asyncio.Semaphore):
        self._free, self._held = free, False

    async def take(self) -> None:
        """Wait for a thread."""
        await self._free.acquire()
        self._held = True

    def leave(self) -> None:
        """Let others have the thread, if it is held."""
        if self._held:
            self._held = False
            self._free.release()


class Workshop:
    """Threads for requests.

    Args:
        threads: that compute.
        waiting: requests that may wait for one of them.
        gauge: counts the requests that hold or await one; None counts for nobody.
        name: of the threads.
    """

    def __init__(self, threads: int, waiting: int, gauge: Gauge | None = None, name: str = "compute"):
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix=name)
        self._free = asyncio.Semaphore(threads)
        self._most = threads + waiting
        self.held, self._gauge = 0, gauge or Gauge("held", "Places that are held.", registry=None)

    @asynccontextmanager
    async def place(self) -> AsyncIterator["Place"]:
        """A thread of one's own, while the block lasts.

        Raises:
            Problem: 503, too many wait already.
        """
        if self.held >= self._most:
            raise busy("too many requests are being computed")
        self.held += 1
        self._gauge.inc()
        place = Place(self._free)
        try:
            await place.take()
            yield place
        finally:
            place.leave()
            self.held -= 1
            self._gauge.dec()

    async def run(self, work: Callable[[], T]) -> T:
        """What `work()` returns, computed in a thread.

        Raises:
            Problem: 503, too many wait already.
        """
        async with self.place():
            return await self.step(work)

    async def step(self, work: Callable[[], T]) -> T:
        """What `work()` returns, computed in the thread of a `place()` that the caller holds."""
        return await asyncio.get_running_loop().run_in_executor(self._pool, work)

    async def stream(self, chunks: Iterator[bytes]) -> AsyncGenerator[bytes, None]:
        """`chunks`, each made in the thread of a `place()` that the caller holds; closed when no more are wanted.

        Whoever is cancelled while a thread still makes a chunk doesn't wait for it: the iterator is closed after that,
        for one that runs can't be.
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
            close = getattr(chunks, "close", None)
            if close is not None and step is not None:
                step.add_done_callback(lambda _: self._pool.submit(close))

    def close(self) -> None:
        """Let running work end, and take no more."""
        self._pool.shutdown(wait=False, cancel_futures=True)
