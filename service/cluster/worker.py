"""`motionenv work`: runs the jobs of a service of several machines."""

import asyncio
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Self

import structlog
from pydantic import model_validator
from pydantic_settings import SettingsConfigDict

from service.cluster.backend import shared_files
from service.cluster.counts import SharedCounts
from service.cluster.database import Database
from service.cluster.models import SharedModels
from service.cluster.postgres import TASK, PostgresStore, queue_of
from service.jobs.runner import JobRunner
from service.jobs.store import Job, Unreachable
from service.settings import JobSettings

_log = structlog.get_logger("motionenv.service")
_RENEWALS = 10  # of a lease in its time
_CLEAN = 60.0  # [s] between clean-ups
_AGAIN = 1.0  # [s] before a connection to the queue that was lost is made anew
_FAREWELL = 15.0  # [s] for putting jobs back at the end, if the database is there
_DAY = 86_400.0
Run = Callable[[Job], Coroutine[None, None, None]]


class WorkerSettings(JobSettings):
    """Run jobs of a service of several machines; see also `motionenv serve`.

    Each option can also be set by the environment variable MOTIONENV_SERVICE_<OPTION>.
    Example: motionenv work --database postgresql://motionenv@db/motionenv --store s3://motionenv
    """

    model_config = SettingsConfigDict(cli_prog_name="motionenv work")

    @model_validator(mode="after")
    def _has_database(self) -> Self:
        if not self.store:
            raise ValueError("set database and store, those of the servers; without them, `motionenv serve` runs jobs")
        return self


class Worker:
    """Takes jobs from the queue, runs them, and looks after those that other workers have lost.

    `run` runs a job that has been claimed; by default `JobRunner.run`.
    """

    def __init__(self, settings: WorkerSettings, run: Run | None = None) -> None:
        self.settings, url = settings, settings.database.get_secret_value()
        self._slots = ["quick"] * settings.quick_processes + ["long"] * settings.job_processes
        self.database = Database(url, size=len(self._slots) + 4)
        self.file_store = shared_files(settings)
        self.store = PostgresStore(self.database, settings.lease)
        self.models = SharedModels(settings.data / "models", url, self.file_store)
        self._counts = SharedCounts(self.database)
        self._given = run
        self._tasks: dict[str, asyncio.Task] = {}  # running jobs by id
        self._stopping = asyncio.Event()
        self._cleaned = 0.0

    async def work(self) -> None:
        """Run jobs until SIGTERM or SIGINT, or `stop`; those that run then are queued again."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, self.stop)
        self.models.folder.mkdir(parents=True, exist_ok=True)
        folders = self.settings.data / "work"
        folders.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folders) as folder:
            runner = JobRunner(self.settings, self.store, self.file_store, self.models, Path(folder))
            self._run = self._given or runner.run
            await self._until_stopped()

    async def _until_stopped(self) -> None:
        await self.database.open()
        self.database.app.task(name=TASK)(self._take)
        slots = [asyncio.create_task(self._fetch(lane)) for lane in self._slots]
        upkeep = asyncio.create_task(self._look_after())
        _log.info("worker is ready", quick=self.settings.quick_processes, long=self.settings.job_processes)
        await self._stopping.wait()
        for task in slots:  # they fetch no more, and wait for what runs
            task.cancel()
        await asyncio.sleep(0)
        for running in list(self._tasks.values()):
            running.cancel()
        _, left = await asyncio.wait(slots, timeout=_FAREWELL)
        if left:  # the leases of what they hold end by themselves
            _log.warning("worker ends without the queue's farewell", slots=len(left))
            for task in left:
                task.cancel()
        upkeep.cancel()
        await asyncio.gather(upkeep, return_exceptions=True)
        self.models.close()
        await self.database.close()

    def stop(self) -> None:
        """End `work`."""
        self._stopping.set()

    async def _fetch(self, lane: str) -> None:
        """Take tickets of a lane, one after the other; begin anew when the database was away."""
        while not self._stopping.is_set():
            try:
                await self.database.app.run_worker_async(
                    queues=[queue_of(lane)], name=lane, concurrency=1, install_signal_handlers=False,
                    delete_jobs="always", update_heartbeat_interval=self.settings.lease / 3,
                    stalled_worker_timeout=self.settings.lease,
                )  # fmt: skip
            except Exception as error:  # noqa: BLE001 whatever ends procrastinate's worker, another takes its place
                _log.warning("connection to the queue was lost", lane=lane, problem=str(error) or type(error).__name__)
            await asyncio.sleep(_AGAIN)

    async def _take(self, job: str) -> None:
        claimed = await self.store.claim(job)
        if claimed is None:
            return
        if self._stopping.is_set():  # while we asked
            await self.store.put_back(claimed)
            self.store.drop(claimed)
            return
        task = self._tasks[job] = asyncio.create_task(self._run(claimed))
        try:
            await asyncio.wait({task})
            if task.cancelled() and self._stopping.is_set():
                await self.store.put_back(claimed)
            elif not task.cancelled():
                task.result()
        finally:
            del self._tasks[job]
            self.store.drop(claimed)

    async def _look_after(self) -> None:
        while True:
            try:
                tasks = dict(self._tasks)  # those that are claimed while we ask aren't in the answer
                wanted = await self.store.running()
                for running, task in tasks.items():
                    if running not in wanted:
                        task.cancel()
                for job in await self.store.recover():
                    _log.warning("job was interrupted", job=job)
                if time.monotonic() - self._cleaned > _CLEAN or not self._cleaned:
                    self._cleaned = time.monotonic()
                    await self._clean()
            except Unreachable:
                _log.warning("database or store can't be reached")
            except Exception:  # noqa: BLE001 the worker must survive any error
                _log.exception("looking after jobs failed")
            await asyncio.sleep(self.settings.lease / _RENEWALS)

    async def _clean(self) -> None:
        await self.store.expire(time.time() - self.settings.job_days * _DAY)
        await self.store.sweep(await asyncio.to_thread(self.file_store.all), self.file_store.remove)
        await self._counts.drop_expired()
        await asyncio.to_thread(self.file_store.trim)
        await asyncio.to_thread(self.file_store.sweep_incoming)
        for folder in (self.settings.data / "work").iterdir():  # of workers that were killed
            if folder.stat().st_mtime < time.time() - _DAY:
                await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
