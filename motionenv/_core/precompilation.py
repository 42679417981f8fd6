"""Compile the kernels that a task needs in several processes, before the task calls them.

`kernels.json` names each task's kernels, the types of their arguments and the seconds that each takes to compile, as
recorded by `python -m benchmarks.startup --record`. Processes share them by the kernels' locks: each takes the longest
that nobody has taken. The process of the task takes part whenever it would wait. Numba compiles in Python, one kernel
at a time in a process.
"""

import atexit
import json
import logging
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from motionenv._core import compilation
from motionenv.errors import MotionError

_POLL = 0.2  # [s] between looks at what is compiled


class Recorded(NamedTuple):
    """A kernel (`module:name`), the types of its arguments (see `decoded`), its CPU time [s], and tasks."""

    kernel: str
    types: list
    seconds: float
    tasks: list[str]

    def load(self) -> tuple[Any, tuple]:
        """The kernel and its arguments' types, as numba has them."""
        module, name = self.kernel.split(":")
        return getattr(import_module(module), name), tuple(map(decoded, self.types))

    def is_compiled(self) -> bool:
        kernel, types = self.load()
        return kernel.is_compiled(types)

    def compile(self) -> None:
        kernel, types = self.load()
        kernel.compile(types)


def decoded(code: Any) -> Any:
    """A numba type as JSON has it.

    It is a name; ["array", type, dimensions, layout, writable]; ["record", [field, dtype] ...]; or [tuple's class or
    "", types ...].
    """
    from numba import from_dtype, types

    if isinstance(code, str):
        return types.boolean if code == "bool" else getattr(types, code)
    kind, *parts = code
    if kind == "array":
        return types.Array(decoded(parts[0]), parts[1], parts[2], readonly=not parts[3])
    if kind == "record":
        return from_dtype(np.dtype(list(map(tuple, parts))))
    module, _, name = kind.partition(":")
    made = getattr(import_module(module), name) if name else None
    return types.BaseTuple.from_types(tuple(map(decoded, parts)), made)


@cache
def _record() -> list[Recorded]:
    rows = json.loads(Path(__file__).with_name("kernels.json").read_text(encoding="utf-8"))
    return sorted((Recorded(*row) for row in rows), key=lambda each: -each.seconds)


def recorded(tasks: Collection[str]) -> list[Recorded]:
    """The kernels of `tasks`, in the order in which to compile them: the longest first."""
    return [each for each in _record() if not set(tasks).isdisjoint(each.tasks)]


def recorded_tasks() -> list[str]:
    """The names of all tasks."""
    return sorted({task for each in _record() for task in each.tasks})


@cache
def precompile(task: str) -> None:
    """Start compiling what the kernels of `task` lack, in other processes, and return at once.

    It does nothing if that would save no time, if kernels can't be kept, and in processes of `multiprocessing`, whose
    parents have shared the cores among them.
    """
    if cores() < 2 or multiprocessing.parent_process() or not sys.executable or getattr(sys, "frozen", False):
        return
    if not _can_keep():
        return
    if any(helper.poll() is None for helper in compilation.helpers):  # of a larger task, which this is part of
        return
    kernels = recorded([task])
    lacking = [each for each in kernels if not each.is_compiled()]
    seconds = [each.seconds for each in lacking]
    processes = min(cores(), math.ceil(sum(seconds) / max(seconds, default=1.0)))
    if processes < 2:
        return
    compilation.announce(f"{len(lacking)} of {len(kernels)} kernels on {processes} cores")
    compilation.waiting[:0] = [each.load() for each in reversed(lacking)]
    compilation.helpers += [_helper([task]) for _ in range(processes - 1)]


def compile_tasks(tasks: Sequence[str], processes: int, on_progress: Callable[[int, int], object]) -> int:
    """Compile the kernels of `tasks`, and return how many there are.

    `on_progress` is called with the number of those that are compiled, and that of all.

    Raises:
        MotionError: they can't be kept.
    """
    if not _can_keep():
        folder = compilation.cache_folder()
        raise MotionError(f"can't write {folder}: set NUMBA_CACHE_DIR to a folder that can be written")
    kernels = recorded(tasks)
    lacking = [each for each in kernels if not each.is_compiled()]
    started = [_helper(tasks) for _ in range(min(processes, len(lacking)))]
    compilation.helpers += started
    while lacking:
        on_progress(len(kernels) - len(lacking), len(kernels))
        if all(helper.poll() is not None for helper in started):
            lacking[0].compile()
        time.sleep(_POLL)
        lacking = [each for each in lacking if not each.is_compiled()]
    on_progress(len(kernels), len(kernels))
    return len(kernels)


def cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _can_keep() -> bool:
    """Whether kernels are compiled, and can be written to the cache (numba keeps none that isn't optimised)."""
    folder = compilation.cache_folder()
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    settings: Any = compilation.config
    return not settings.DISABLE_JIT and settings.OPT > 0 and os.access(folder, os.W_OK)


def _helper(tasks: Sequence[str]) -> subprocess.Popen:
    """A process that compiles kernels of `tasks`. It runs none of the caller's code, and ends with this process."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))}
    command = [sys.executable, "-P", "-m", __name__, *tasks]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, env=environment)


@atexit.register
def _end_helpers() -> None:
    for helper in compilation.helpers:
        if helper.stdin:
            helper.stdin.close()
        helper.wait()


def _end_with_parent() -> None:
    """End when the other end of the pipe closes, as it does however that process ends."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(0)


def main() -> None:
    """Compile kernels of the tasks that the arguments name."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compilation.logger.setLevel(logging.ERROR)  # the parent says what is compiled
    for each in recorded(sys.argv[1:]):
        if not each.is_compiled():
            kernel, types = each.load()
            kernel.compile_unless_taken(types)


if __name__ == "__main__":
    main()
