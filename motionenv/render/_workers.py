"""Threads that share work which releases the interpreter's lock; for all that draws many pictures."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count

from motionenv.errors import MotionError

_PIECES = 4  # per thread: so that no thread waits long for a slower one


class Workers:
    """Shares ranges of work among threads, the caller's own included. Survives pickling and a fork.

    Args:
        threads: how many work at a time.
        name: of the threads.
    """

    def __init__(self, threads: int, name: str):
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
            raise MotionError(f"threads must be a whole number from 1, got {threads!r}")
        self.threads = threads
        self.name = name
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0

    def share(self, work: Callable[[int, int], object], n: int) -> None:
        """Call `work(start, stop)` for ranges that together are 0 to `n`, each once, in any order.

        Args:
            work: what to do; must not depend on how the ranges are cut.
            n: how much there is.
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

        if self._pool is None or self._process != os.getpid():  # threads don't survive a fork
            self._pool, self._process = ThreadPoolExecutor(self.threads - 1, thread_name_prefix=self.name), os.getpid()
        others = [self._pool.submit(take) for _ in range(self.threads - 1)]
        take()
        for other in others:
            other.result()

    def close(self) -> None:
        """End the threads; the next `share` that needs some starts new ones."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __getstate__(self):
        return {"threads": self.threads, "name": self.name}

    def __setstate__(self, state):
        self.__init__(**state)  # type: ignore[misc]
