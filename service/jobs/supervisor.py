"""Starts jobs, ends them, keeps what they made. One supervisor per data folder, whichever server process locks it."""

import asyncio
import contextlib
import fcntl
import os
import shutil
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import IO

import structlog

from motionenv.models import names
from service.catalogue import Catalogue
from service.jobs.blobs import Blobs, sha256, telling_full
from service.jobs.running import Failed, Interrupted, run
from service.jobs.store import ATTEMPTS, Full, Job, Store
from service.metrics import Metrics
from service.settings import Settings

_log = structlog.get_logger("motionenv.service")
_LOOK = 0.25  # [s] between looks at what other server processes have queued or cancelled
_LOCK = 1.0  # [s] between tries to become the supervisor
_CLEAN = 60.0  # [s] between cleanings
_DAY = 86_400.0
_STATUSES = ("queued", "running", "done", "failed", "cancelled")


class Supervisor:
    """Runs jobs.

    Args:
        settings: of the service.
        store: what is known of the jobs.
        blobs: their files.
        catalogue: gets the models.
        metrics: count the jobs.
    """

    def __init__(self, settings: Settings, store: Store, blobs: Blobs, catalogue: Catalogue, metrics: Metrics):
        self.settings, self.store, self.blobs = settings, store, blobs
        self.catalogue, self.metrics = catalogue, metrics
        self._folder = settings.data / "work"
        self._tasks: dict[str, asyncio.Task] = {}
        self._wake = asyncio.Event()
        self._lock: IO | None = None
        self._cleaned = 0.0

    def start(self) -> None:
        """Begin, from an event loop."""
        self._main = asyncio.create_task(self._run())

    def wake(self) -> None:
        """Something has changed: look at once."""
        self._wake.set()

    async def stop(self) -> None:
        """Stop; what runs is killed and waits again."""
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
        """Look after jobs for ever; a defect, or a full disk, ends one look only."""
        while not self._locked():
            await asyncio.sleep(_LOCK)
        recovered = False
        while True:
            try:
                if not recovered:
                    await self._recover()
                    recovered = True
                await self._look()
            except Exception:  # noqa: BLE001 the next look must come, whatever this one met
                _log.exception("jobs can't be looked after")
                await asyncio.sleep(_LOCK)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._wake.wait(), _LOOK)
            self._wake.clear()

    def _locked(self) -> bool:
        """Whether this process is the one that runs the data folder's jobs."""
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
        """Put in order what the last supervisor left."""
        for job in self.store.recover():
            _log.warning("job was interrupted", job=job)
        await asyncio.to_thread(shutil.rmtree, self._folder, ignore_errors=True)
        self._folder.mkdir(exist_ok=True)
        for path in sorted(self.catalogue.folder.glob("*.npz")):
            name = f"fitted/{path.stem}"
            known = self.store.known(name)
            if known and await asyncio.to_thread(sha256, path) not in known:
                _log.error("model is damaged and not served any more", model=name)
                path.rename(path.with_suffix(".damaged"))

    async def _look(self) -> None:
        """Kill what was cancelled, begin what waits, clean up now and then."""
        wanted = self.store.running()
        for running, task in self._tasks.items():
            if running not in wanted:
                task.cancel()
        while len(self._tasks) < self.settings.job_processes and (job := self.store.claim()):
            self._tasks[job.id] = task = asyncio.create_task(self._one(job))
            task.add_done_callback(partial(self._ended, job.id))
        counts = self.store.counts()
        for status in _STATUSES:
            self.metrics.jobs.labels(status).set(counts.get(status, 0))
        if time.monotonic() - self._cleaned > _CLEAN or not self._cleaned:
            self._cleaned = time.monotonic()
            self.store.expire(time.time() - self.settings.job_days * _DAY)
            self.store.sweep(self.blobs.all(), self.blobs.remove)
            await asyncio.to_thread(self.blobs.sweep_incoming)
            await asyncio.to_thread(self.blobs.load_ballast)

    def _ended(self, job: str, _: asyncio.Task) -> None:
        del self._tasks[job]
        self.wake()

    async def _one(self, job: Job) -> None:
        """One job from its beginning to its end."""
        folder = self._folder / f"{job.id}-{job.attempts}"
        begun = time.monotonic()
        try:
            await self._done(job, folder)
            _log.info("job done", job=job.id, kind=job.kind, seconds=round(time.monotonic() - begun, 3))
        except Full:
            self._fail(job, 507, "the service's disk is full: remove jobs or models, or ask whoever runs it")
        except Interrupted:
            self._again(job)
        except Failed as error:
            self._fail(job, error.status, error.detail)
        except Exception:  # noqa: BLE001 whatever it is, the client is told and the log gets the rest
            _log.exception("job failed", job=job.id)
            self._fail(job, 500, "this is a defect of the service: please report it")
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _again(self, job: Job) -> None:
        """A job whose process was killed, as the system does when memory is short, waits again, or is given up."""
        _log.warning("job was interrupted", job=job.id)
        if job.attempts < ATTEMPTS:
            self.store.put_back(job.id, begun=True)
        else:
            self._fail(job, 500, f"the job's process was killed {ATTEMPTS} times: is the machine short of memory?")

    def _fail(self, job: Job, status: int, detail: str) -> None:
        _log.info("job failed", job=job.id, kind=job.kind, status=status, detail=detail)
        self.store.end(job.id, "failed", detail, {"status": status, "detail": detail})

    async def _done(self, job: Job, folder: Path) -> None:
        """Have the work done, and keep what it made.

        Raises:
            Failed: it couldn't be done.
            Full: there is no room for it.
        """
        with telling_full():
            (folder / "input").mkdir(parents=True)
        for name, sha in self.store.inputs(job.id):
            os.link(self.blobs.path(sha), folder / "input" / name)
        work = {"kind": job.kind, "settings": job.settings | self._model(job)}
        told = partial(self.store.progress, job.id)
        await run(work, folder, self.settings.job_seconds, self.settings.job_memory, partial(_tell, told))
        result, model = folder / "result", folder / "model.npz"
        sha = await asyncio.to_thread(sha256, result)
        size = result.stat().st_size
        self.blobs.check_room()
        if job.model:
            self.store.know(job.model, await asyncio.to_thread(sha256, model))

        def publish() -> None:
            if result.exists():
                self.blobs.place(result, sha)
            if job.model and model.exists():
                os.replace(model, self.catalogue.path(job.model))

        self.store.finish(job, sha, size, publish)

    def _model(self, job: Job) -> dict[str, str]:
        """The model that a job uses, as `motionenv.load` takes it."""
        if job.kind != "render":
            return {}
        name = job.settings["request"]["model"]
        return {"model": name if name in names() else str(self.catalogue.path(name))}


def _tell(told: Callable[[float, str], None], share: float, message: str) -> None:
    with contextlib.suppress(Full):  # progress is worth no disk
        told(share, message)
