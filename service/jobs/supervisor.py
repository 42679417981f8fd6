"""Starts and ends jobs and stores their results: one supervisor per data folder, in the process that locks it."""

import asyncio
import contextlib
import fcntl
import os
import shutil
import time
from functools import partial
from pathlib import Path
from typing import IO

import structlog

from motionenv.models import names
from service.errors import FULL
from service.jobs.child_process import Failed, Interrupted, run
from service.jobs.file_store import FileStore, sha256
from service.jobs.store import ATTEMPTS, Full, Job, Store, full_disk_errors
from service.model_registry import ModelRegistry
from service.observability.metrics import Metrics
from service.settings import Settings

_log = structlog.get_logger("motionenv.service")
_POLL = 0.25  # [s] between checks for jobs queued or cancelled by other server processes
_LOCK = 1.0  # [s] between attempts to become the supervisor
_CLEAN = 60.0  # [s] between clean-ups
_DAY = 86_400.0
_STATUSES = ("queued", "running", "done", "failed", "cancelled")


class Supervisor:
    """Runs jobs."""

    def __init__(
        self, settings: Settings, store: Store, file_store: FileStore, model_registry: ModelRegistry, metrics: Metrics
    ):
        self.settings, self.store, self.file_store = settings, store, file_store
        self.model_registry, self.metrics = model_registry, metrics
        self._folder = settings.data / "work"
        self._tasks: dict[str, asyncio.Task] = {}
        self._lanes: dict[str, str] = {}  # of the running jobs
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
        running = list(self._tasks.items())
        for _, task in running:
            task.cancel()
        await asyncio.gather(self._main, *(task for _, task in running), return_exceptions=True)
        for job, _ in running:
            self.store.put_back(job)
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
                await asyncio.wait_for(self._wake.wait(), _POLL)
            self._wake.clear()

    def _locked(self) -> bool:
        """Whether this process holds the lock of the data folder."""
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
        for job in self.store.recover():
            _log.warning("job was interrupted", job=job)
        await asyncio.to_thread(shutil.rmtree, self._folder, ignore_errors=True)
        self._folder.mkdir(exist_ok=True)
        for path in sorted(self.model_registry.folder.glob("*.npz")):
            name = self.model_registry.name_of(path)
            known = self.store.known(name)
            if known and await asyncio.to_thread(sha256, path) not in known:
                _log.error("model is damaged and not served any more", model=name)
                path.rename(path.with_suffix(".damaged"))

    async def _update(self) -> None:
        """Kill cancelled jobs, start queued ones, and clean up now and then."""
        wanted = self.store.running()
        for running, task in self._tasks.items():
            if running not in wanted:
                task.cancel()
        for lane, most in self._most.items():
            while list(self._lanes.values()).count(lane) < most and (job := self.store.claim(lane)):
                self._lanes[job.id] = lane
                self._tasks[job.id] = task = asyncio.create_task(self._one(job))
                task.add_done_callback(partial(self._ended, job.id))
        counts = self.store.counts()
        for status in _STATUSES:
            self.metrics.jobs.labels(status).set(counts.get(status, 0))
        if time.monotonic() - self._cleaned > _CLEAN or not self._cleaned:
            self._cleaned = time.monotonic()
            self.store.expire(time.time() - self.settings.job_days * _DAY)
            self.store.sweep(self.file_store.all(), self.file_store.remove)
            await asyncio.to_thread(self.file_store.sweep_incoming)
            await asyncio.to_thread(self.file_store.load_ballast)

    def _ended(self, job: str, _: asyncio.Task) -> None:
        del self._tasks[job], self._lanes[job]
        self.wake()

    async def _one(self, job: Job) -> None:
        folder = self._folder / f"{job.id}-{job.attempts}"
        begun = time.monotonic()
        try:
            await self._done(job, folder)
            _log.info("job done", job=job.id, kind=job.kind, seconds=round(time.monotonic() - begun, 3))
        except Full:
            self._fail(job, 507, FULL)
        except Interrupted:
            self._retry(job)
        except Failed as error:
            self._fail(job, error.status, error.detail)
        except Exception:  # noqa: BLE001 the client gets the status, the log the details
            _log.exception("job failed", job=job.id)
            self._fail(job, 500, "internal error: please report it")
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _retry(self, job: Job) -> None:
        """Queue a job again whose process was killed, as the system does when out of memory, or give it up."""
        _log.warning("job was interrupted", job=job.id)
        if job.attempts < ATTEMPTS:
            self.store.put_back(job.id, begun=True)
        else:
            self._fail(job, 500, f"the job's process was killed {ATTEMPTS} times: is the machine short of memory?")

    def _fail(self, job: Job, status: int, detail: str) -> None:
        _log.info("job failed", job=job.id, kind=job.kind, status=status, detail=detail)
        self.store.end(job.id, "failed", detail, {"status": status, "detail": detail})

    async def _done(self, job: Job, folder: Path) -> None:
        with full_disk_errors():
            (folder / "input").mkdir(parents=True)
        for name, sha in self.store.inputs(job.id):
            os.link(self.file_store.path(sha), folder / "input" / name)
        work = {"kind": job.kind, "settings": job.settings | self._model(job)}
        report = partial(self._progress, job.id)
        await run(work, folder, self.settings.job_seconds, self.settings.job_memory, report)
        result, model = folder / "result", folder / "model.npz"
        sha = await asyncio.to_thread(sha256, result)
        size = result.stat().st_size
        self.file_store.check_room()
        if job.model:
            self.store.know(job.model, await asyncio.to_thread(sha256, model))

        def publish() -> None:
            if result.exists():
                self.file_store.place(result, sha)
            if job.model and model.exists():
                os.replace(model, self.model_registry.place(job.model, job.owner))

        self.store.finish(job, sha, size, publish)

    def _model(self, job: Job) -> dict[str, str]:
        """The model of a job, as an argument for `motionenv.load`."""
        if job.kind != "render":
            return {}
        name = job.settings["request"]["model"]
        return {"model": name if name in names() else str(self.model_registry.place(name, job.owner))}

    def _progress(self, job: str, share: float, message: str) -> None:
        with contextlib.suppress(Full):  # not worth failing for
            self.store.progress(job, share, message)
