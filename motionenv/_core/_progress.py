"""What is said on stderr while kernels compile."""

import logging
import time
from collections.abc import Callable

_REPORT = 5.0  # [s] between lines

logger = logging.getLogger(__name__)


class _Progress:
    """Says that kernels are compiled, and how far that is: at once, and then every few seconds.

    Numba compiles one kernel at a time, under a lock of its own, and those that it calls in the middle of it.
    """

    def __init__(self) -> None:
        self._depth = self._done = self._total = 0
        self._began = self._said = 0.0

    def begin(self, name: str, count: Callable[[], int]) -> None:
        """A kernel, or one that it calls, is about to be compiled; the outermost is with others `count()` kernels."""
        if self._depth == 0:
            self._total = self._done + count()
            self._began = self._began or time.monotonic()
        self._depth += 1
        self._say(name)

    def end(self) -> None:
        """The kernel begun last is compiled."""
        self._depth = max(self._depth - 1, 0)
        self._done += 1

    def _say(self, name: str) -> None:
        now = time.monotonic()
        if now - self._said < _REPORT:
            return
        self._said = now
        done, total = self._done + 1, max(self._total, self._done + 1)
        logger.warning(
            "compiling kernels, once for this version and machine: %s, %d of %d, %.0f s", name, done, total,
            now - self._began,
        )  # fmt: skip


progress = _Progress()
