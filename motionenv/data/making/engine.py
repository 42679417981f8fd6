"""Work spread over an executor: every task is done at least once, and what fails doesn't stop the others.

Tasks are whole numbers or texts, and the work on one doesn't depend on the others. What a task has to show for itself
is written by the work itself, so that it may be done twice, and nothing large passes through the executor.
"""

import multiprocessing
import os
import signal
import sys
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from typing import Any

from motionenv._core.validation import checked_whole

_ATTEMPTS = 3  # at a task, after which it has failed
_EACH = 2  # tasks per worker that wait or run
_GRACE = 10.0  # [s] in which a process that is told to end cleans up
_UNKNOWN = 64  # tasks given at a time to an executor that doesn't say how many workers it has


@dataclass
class Outcome:
    """Results by task, reasons of those that failed, and whether the user stopped it (Ctrl-C).

    Tasks in neither dict weren't done.
    """

    done: dict[Any, Any] = field(default_factory=dict)
    failed: dict[Any, str] = field(default_factory=dict)
    interrupted: bool = False


def run(
    work: Callable[[Any], Any], tasks: Sequence[Any], *, executor: Executor | None = None, workers: int | None = None,
    patience: float = 3600.0, on_done: Callable[[Any], object] | None = None,
) -> Outcome:  # fmt: skip
    """Do `work(task)` for all tasks; one that fails is tried three times, and Ctrl-C ends the work.

    Args:
        work: can be pickled, unless the executor has threads; may be done twice for a task.
        tasks: hashable, all different.
        executor: None starts `workers` processes, or works in this one if that is 1.
        workers: number of processes; None is one for each core.
        patience: seconds without any finished task after which the executor is given up, and what it holds has failed.
        on_done: called with each result.
    """
    count = os.cpu_count() or 1 if workers is None else checked_whole(workers, "workers", 1)
    hands = _Given(executor) if executor is not None else _Own(min(count, max(1, len(tasks))))
    outcome = Outcome()
    try:
        _drive(hands, work, deque(tasks), patience, outcome, on_done)
    except KeyboardInterrupt:
        outcome.interrupted = True
    finally:
        hands.end(at_once=outcome.interrupted or bool(outcome.failed))
    return outcome


def _drive(hands, work, waiting: deque, patience: float, outcome: Outcome, on_done) -> None:
    """Keep the hands busy until nothing waits or runs."""
    tries: Counter = Counter()
    running: dict[Future, Any] = {}
    while waiting or running:
        while waiting and len(running) < hands.room:
            task = waiting.popleft()
            tries[task] += 1
            running[hands.submit(work, task)] = task
        ended = [future for future in running if future.done()]  # `wait` doesn't see futures that were only cancelled
        ended = ended or list(wait(running, patience, FIRST_COMPLETED).done)
        if not ended:
            outcome.failed |= dict.fromkeys(running.values(), f"no answer within {patience:g} s")
            outcome.failed |= dict.fromkeys(waiting, "not begun: the executor doesn't answer")
            return
        for future in ended:
            task = running.pop(future)
            error = _error_of(future)
            if error is None:
                outcome.done[task] = future.result()
                if on_done is not None:
                    on_done(outcome.done[task])
            elif tries[task] < _ATTEMPTS:
                waiting.append(task)
            else:
                outcome.failed[task] = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        hands.mend()


def _error_of(future: Future) -> BaseException | None:
    if future.cancelled():
        return RuntimeError("the executor cancelled it")
    return future.exception()


class _Given:
    """An executor that the caller gave, and will end."""

    def __init__(self, executor: Executor):
        self._executor = executor
        self.room = _EACH * getattr(executor, "_max_workers", _UNKNOWN // _EACH)
        self._given: list[Future] = []

    def submit(self, work, task) -> Future:
        try:
            future = self._executor.submit(work, task)
        except Exception as error:  # noqa: BLE001  an executor may raise anything, and the task has then failed
            future = Future()
            future.set_exception(error)
        self._given = [*(one for one in self._given if not one.done()), future]
        return future

    def mend(self) -> None:
        """Nothing: only its owner can mend it."""

    def end(self, at_once: bool) -> None:
        for future in self._given:
            future.cancel()


class _Own:
    """Processes of our own, replaced when one dies; a single one is this process."""

    def __init__(self, workers: int):
        self._workers = workers
        self.room = 1 if workers == 1 else workers + 1
        self._pool: ProcessPoolExecutor | None = None
        self._broken = False

    def submit(self, work, task) -> Future:
        """The future of a task."""
        if self._workers == 1:
            return _done_here(work, task)
        if self._pool is None:
            spawn = multiprocessing.get_context("spawn")  # a fork would copy threads' locks
            self._pool = ProcessPoolExecutor(self._workers, mp_context=spawn, initializer=_begin_worker)
        try:
            return self._pool.submit(_worked, work, task)
        except BrokenExecutor as error:
            self._broken = True
            future: Future = Future()
            future.set_exception(error)
            return future

    def mend(self) -> None:
        """Replace processes of which one died."""
        if self._broken or (self._pool is not None and getattr(self._pool, "_broken", False)):
            self.end(at_once=True)
            self._broken = False

    def end(self, at_once: bool) -> None:
        """End the processes, `at_once` or after what they do."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        processes = list((getattr(pool, "_processes", None) or {}).values())
        pool.shutdown(wait=not at_once, cancel_futures=True)
        if at_once:
            for process in processes:
                process.terminate()
            for process in processes:
                process.join(_GRACE)
                process.kill()
                process.join()


def _done_here(work, task) -> Future:
    """The future of a task, done by this process."""
    future: Future = Future()
    try:
        future.set_result(work(task))
    except Exception as error:  # noqa: BLE001  whatever it is, it is this task's failure and told as such
        future.set_exception(error)
    return future


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
