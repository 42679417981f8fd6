"""`python -m tests.service.cluster.light`: a worker whose jobs take a moment and no CPU; the result is the file again.

All else is that of `motionenv work`: tickets, leases, files, results.
"""

import asyncio
import shutil
import tempfile
from pathlib import Path

import structlog

from service.cluster.worker import Worker, WorkerSettings
from service.jobs.file_store import sha256
from service.jobs.store import Job, Unreachable
from service.observability import logs
from service.settings import from_command_line

_MOMENT = 0.3  # [s]


async def handed_back(job: Job) -> None:
    """Give a job's file back as its result."""
    try:
        ((_, given),) = await worker.store.inputs(job.id)
        with tempfile.TemporaryDirectory(dir=worker.settings.data) as folder:
            result = Path(folder) / "result"
            shutil.copyfile(await asyncio.to_thread(worker.file_store.fetch, given), result)
            with result.open("ab") as file:
                file.write(b"done")
            await asyncio.sleep(_MOMENT)
            sha = sha256(result)
            if await worker.store.finish(
                job, sha, result.stat().st_size, None, lambda: worker.file_store.place(result, sha)
            ):
                structlog.get_logger("motionenv.service").info("job done", job=job.id)
    except Unreachable:
        pass  # it is run again when its lease has ended


logs.configure()
worker = Worker(from_command_line(WorkerSettings), handed_back)
asyncio.run(worker.work())
