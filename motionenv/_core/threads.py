"""Threads that share work which releases the interpreter's lock. Results never depend on how many there are."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any

from motionenv._core.validation import checked_whole

CHUNK = 500  # cycles
_PIECES = 4  # per thread: so that no thread waits long for a slower one


class Workers:
    """Shares ranges of work among threads (None: one per core), the caller's included. Survives pickling and a fork."""

    def __init__(self, threads: int | None, name: str) -> None:
        self.threads = checked_whole(os.cpu_count() or 1 if threads is None else threads, "threads", 1)
        self.name = name
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0

    def share(self, work: Callable[[int, int], object], n: int) -> None:
        """Call `work(start, stop)` for ranges that together are 0 to `n`, each once, in any order.

        `work` must not depend on how the ranges are cut. It may share work itself.
        """
        if self.threads == 1 or n < 2:
            if n:
                work(0, n)
            return
        size = -(-n // (_PIECES * self.threads))
        turns = count(0, size)  # its next() is atomic: each thread takes the next piece when it is free

        def take() -> None:
            for start in turns:
                if start >= n:
                    return
                work(start, min(start + size, n))

        others = [self._started().submit(take) for _ in range(min(self.threads, -(-n // size)) - 1)]
        take()
        for other in others:
            if not other.cancel():  # one that never began isn't needed: nothing is left, or this thread failed
                other.result()

    def _started(self) -> ThreadPoolExecutor:
        if self._pool is None or self._process != os.getpid():  # threads don't survive a fork
            self._pool, self._process = ThreadPoolExecutor(self.threads - 1, thread_name_prefix=self.name), os.getpid()
        return self._pool

    def close(self) -> None:
        """End the threads; the next `share` that needs some starts new ones."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __reduce__(self):
        return Workers, (self.threads, self.name)


#: Where one pool is enough: for calls that make something at once.
everywhere = Workers(None, "motionenv")


def in_chunks(work: Callable[[int, int], Any], k: int, least: int = CHUNK) -> list:
    """[work(start, stop) of each chunk of `k` cycles], in order, in as many threads as there are cores.

    Chunks depend on `k` and `least`, their least size, only, so that sums of them round alike on every machine.
    """
    n = max(1, min(8, k // least))
    bounds = [i * k // n for i in range(n + 1)]
    results: list = [None] * n

    def some(first: int, last: int) -> None:
        for i in range(first, last):
            results[i] = work(bounds[i], bounds[i + 1])

    everywhere.share(some, n)
    return results
