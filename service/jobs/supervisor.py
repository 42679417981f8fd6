"""Runs the jobs of one data folder: one supervisor, in the process that locks the folder."""

import asyncio
import contextlib
import fcntl
import shutil
import time
from functools import partial
from typing import IO

import structlog

from service.jobs.file_store import FileStore
from service.jobs.runner import JobRunner
from service.jobs.store import Job, SqliteStore
from service.model_registry import ModelRegistry
from service.settings import Settings

_log = structlog.get_logger("motionenv.service")
_POLL = 0.25  # [s] between checks for jobs queued or cancelled by other server processes
_LOCK = 1.0  # [s] between attempts to become the supervisor
_CLEAN = 60.0  # [s] between clean-ups
_DAY = 86_400.0


class Supervisor:
    """Starts and ends jobs."""

    def __init__(
        self, settings: Settings, store: SqliteStore, file_store: FileStore, model_registry: ModelRegistry
    ) -> None:
        self.settings, self.store, self.file_store = settings, store, file_store
        self._models = model_registry
        self._runner = JobRunner(settings, store, file_store, model_registry, settings.data / "work")
        self._tasks: dict[str, tuple[Job, str, asyncio.Task]] = {}  # running jobs by id, with their lanes
        self._most = {"quick": settings.quick_processes, "long": settings.job_processes}
        self._wake = asyncio.Event()
        self._lock: IO | None = None
        self._cleaned = 0.0

    def start(self) -> None:
        """Start, in an event loop."""
        self._main = asyncio.create_task(self._run())

    def wake(self) -> None:
        """Check for changes at once."""
        self._wake.set()

    async def stop(self) -> None:
        """Stop; running jobs are killed and queued again."""
        self._main.cancel()
        running = list(self._tasks.values())
        for _, _, task in running:
            task.cancel()
        await asyncio.gather(self._main, *(task for _, _, task in running), return_exceptions=True)
        for job, _, _ in running:
            await self.store.put_back(job)
        if self._lock is not None:
            self._lock.close()

    async def _run(self) -> None:
        """Supervise jobs forever; an exception ends one iteration only."""
        while not self._locked():
            await asyncio.sleep(_LOCK)
        recovered = False
        while True:
            try:
                if not recovered:
                    await self._recover()
                    recovered = True
                await self._update()
            except Exception:  # noqa: BLE001 the supervisor must survive any error
                _log.exception("supervising jobs failed")
                await asyncio.sleep(_LOCK)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_POLL):  # wait_for may swallow the cancellation (cpython #86296)
                    await self._wake.wait()
            self._wake.clear()

    def _locked(self) -> bool:
        if self._lock is None:
            lock = (self.settings.data / "jobs.lock").open("wb")
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                lock.close()
                return False
            self._lock = lock
        return True

    async def _recover(self) -> None:
        for job in await self.store.recover():
            _log.warning("job was interrupted", job=job)
        await asyncio.to_thread(shutil.rmtree, self._runner.folder, ignore_errors=True)
        self._runner.folder.mkdir(exist_ok=True)

    async def _update(self) -> None:
        wanted = await self.store.running()
        for running, (_, _, task) in self._tasks.items():
            if running not in wanted:
                task.cancel()
        for lane, most in self._most.items():
            while self._busy(lane) < most and (job := await self.store.claim(lane)):
                task = asyncio.create_task(self._runner.run(job))
                self._tasks[job.id] = job, lane, task
                task.add_done_callback(partial(self._ended, job.id))
        if time.monotonic() - self._cleaned > _CLEAN or not self._cleaned:
            self._cleaned = time.monotonic()
            await self.store.expire(time.time() - self.settings.job_days * _DAY)
            await self.store.sweep(self.file_store.all(), self.file_store.remove)
            self._models.remove_unlisted(await self.store.models())
            await asyncio.to_thread(self.file_store.sweep_incoming)
            await asyncio.to_thread(self.file_store.load_ballast)

    def _busy(self, lane: str) -> int:
        return sum(in_ == lane for _, in_, _ in self._tasks.values())

    def _ended(self, job: str, _: asyncio.Task) -> None:
        del self._tasks[job]
        self.wake()
