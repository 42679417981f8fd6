"""Work spread over processes: every task is done at least once, and what fails doesn't stop the others.

Tasks are whole numbers or texts, and the work on one doesn't depend on the others. What a task has to show for itself
is written by the work itself, so that it may be done twice, and nothing large passes between processes.
"""

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from typing import Any

from motionenv._core.validation import checked_whole

_ATTEMPTS = 3  # at a task, after which it has failed
_GRACE = 10.0  # [s] in which a process that is told to end cleans up


@dataclass
class Outcome:
    """Results by task, reasons of those that failed, and whether the user stopped it (Ctrl-C).

    Tasks in neither dict weren't done.
    """

    done: dict[Any, Any] = field(default_factory=dict)
    failed: dict[Any, str] = field(default_factory=dict)
    interrupted: bool = False


def run(
    work: Callable[[Any], Any], tasks: Sequence[Any], *, workers: int | None = None,
    on_done: Callable[[Any], object] | None = None,
) -> Outcome:  # fmt: skip
    """Do `work(task)` for all tasks; one that fails, or whose process dies, is tried three times; Ctrl-C ends the work.

    Args:
        work: can be pickled; may be done twice for a task.
        tasks: hashable, all different.
        workers: number of processes, None is one for each core; 1 is this process.
        on_done: called with each result.
    """
    count = os.cpu_count() or 1 if workers is None else checked_whole(workers, "workers", 1)
    outcome, waiting = Outcome(), list(tasks)
    try:
        for _ in range(_ATTEMPTS):
            outcome.failed.clear()
            for task, error, result in _attempted(work, waiting, min(count, len(waiting))):
                if error is not None:
                    outcome.failed[task] = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
                    continue
                outcome.done[task] = result
                if on_done is not None:
                    on_done(result)
            waiting = list(outcome.failed)
    except KeyboardInterrupt:
        outcome.interrupted = True
    return outcome


def _attempted(work, tasks: Sequence[Any], workers: int):
    """Each of `tasks` once it is done or has failed, with the error and the result."""
    if workers <= 1:
        for task in tasks:
            try:
                result = work(task)
            except Exception as error:  # noqa: BLE001  whatever it is, it is this task's failure and told as such
                yield task, error, None
            else:
                yield task, None, result
        return
    spawn = multiprocessing.get_context("spawn")  # a fork would copy threads' locks
    pool = ProcessPoolExecutor(workers, mp_context=spawn, initializer=_begin_worker)
    try:
        running = {pool.submit(_worked, work, task): task for task in tasks}
        for future in as_completed(running):
            problem = future.exception()
            yield running[future], problem, None if problem else future.result()
        pool.shutdown()
    except BaseException:
        _end(pool)
        raise


def _end(pool: ProcessPoolExecutor) -> None:
    """End the processes of a pool at once."""
    processes = list((getattr(pool, "_processes", None) or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(_GRACE)
        process.kill()
        process.join()


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers; end by an exception, so that they clean up."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))


def _worked(work, task):
    """Do a task in a process of our own, which ends when it was told to: the pool would take that for a result."""
    try:
        return work(task)
    except SystemExit as end:
        os._exit(end.code if isinstance(end.code, int) else 1)
