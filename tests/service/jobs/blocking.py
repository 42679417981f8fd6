"""What is awaited, called from tests that wait for each call anyway."""

import asyncio
import inspect
from functools import partial
from typing import Any


class Blocking:
    """An object whose coroutines are run to their end by an event loop that stays the same."""

    def __init__(self, thing: Any, runner: asyncio.Runner):
        self._thing, self._runner = thing, runner

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._thing, name)
        if name in ("store", "backend", "database"):
            return Blocking(found, self._runner)
        return partial(self._wait, found) if inspect.iscoroutinefunction(found) else found

    def _wait(self, coroutine: Any, *values: Any, **named: Any) -> Any:
        async def called() -> Any:
            return await coroutine(*values, **named)

        return self._runner.run(called())
