"""Runs one job: gets its files, starts its process, and stores what came of it."""

import asyncio
import contextlib
import os
import shutil
import time
from functools import partial
from pathlib import Path

import structlog

from motionenv.models import names
from service.errors import FULL
from service.jobs.child_process import Failed, Interrupted, run
from service.jobs.file_store import FileStore, sha256
from service.jobs.store import ATTEMPTS, Full, Job, SqliteStore, full_disk_errors
from service.model_registry import ModelRegistry
from service.settings import Settings

_log = structlog.get_logger("motionenv.service")


class JobRunner:
    """Runs jobs of a `store`, each in a folder of its own within `folder`."""

    def __init__(
        self, settings: Settings, store: SqliteStore, file_store: FileStore, model_registry: ModelRegistry, folder: Path
    ) -> None:
        self.settings, self.store, self.file_store = settings, store, file_store
        self.model_registry, self.folder = model_registry, folder

    async def run(self, job: Job) -> None:
        """Run a job that has been claimed; when cancelled, its process is killed and the job left as it is."""
        folder = self.folder / f"{job.id}-{job.attempts}"
        begun = time.monotonic()
        try:
            done = await self._done(job, folder)
            what = "job done" if done else "job was cancelled"
            _log.info(what, job=job.id, kind=job.kind, seconds=round(time.monotonic() - begun, 3))
        except Full:
            await self._fail(job, 507, FULL)
        except Interrupted:
            await self._retry(job)
        except Failed as error:
            await self._fail(job, error.status, error.detail)
        except Exception:  # noqa: BLE001 the client gets the status, the log the details
            _log.exception("job failed", job=job.id)
            await self._fail(job, 500, "internal error: please report it")
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    async def _retry(self, job: Job) -> None:
        """Queue a job again whose process was killed, as the system does when out of memory, or give it up."""
        _log.warning("job was interrupted", job=job.id)
        if job.attempts < ATTEMPTS:
            await self.store.put_back(job, begun=True)
        else:
            await self._fail(
                job, 500, f"the job's process was killed {ATTEMPTS} times: is the machine short of memory?"
            )

    async def _fail(self, job: Job, status: int, detail: str) -> None:
        _log.info("job failed", job=job.id, kind=job.kind, status=status, detail=detail)
        await self.store.fail(job, status, detail)

    async def _done(self, job: Job, folder: Path) -> bool:
        """Run a job and publish its result, unless it was cancelled or given to another meanwhile."""
        with full_disk_errors():
            (folder / "input").mkdir(parents=True)
        for name, sha in await self.store.inputs(job.id):
            os.link(await asyncio.to_thread(self.file_store.fetch, sha), folder / "input" / name)
        work = {"kind": job.kind, "settings": job.settings | await self._model(job)}
        report = partial(self._progress, job)
        await run(work, folder, self.settings.job_seconds, self.settings.job_memory, report)
        result, model = folder / "result", folder / "model.npz"
        sha = await asyncio.to_thread(sha256, result)
        size = result.stat().st_size
        self.file_store.check_room()
        if job.model:
            await asyncio.to_thread(sha256, model)  # syncs it to disk

        def publish() -> None:
            self.file_store.place(result, sha)
            if job.model:
                self.model_registry.publish(model, job.model, job.owner, job.listed)

        return await self.store.finish(job, sha, size, publish)

    async def _model(self, job: Job) -> dict[str, str]:
        if job.kind != "render":
            return {}
        name = job.settings["request"]["model"]
        if name in names():
            return {"model": name}
        return {"model": str(await asyncio.to_thread(self.model_registry.place, name, job.owner))}

    async def _progress(self, job: Job, share: float, message: str) -> None:
        with contextlib.suppress(Full):  # not worth failing for
            await self.store.progress(job, share, message)
