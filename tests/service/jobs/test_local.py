"""What server processes of one machine share."""

import asyncio
from pathlib import Path

from service.jobs.local import Local
from service.settings import Settings
from tests.service.jobs.blocking import Blocking
from tests.service.jobs.storing import added


def test_two_processes_on_one_folder_see_the_same_jobs(tmp_path: Path):
    settings = Settings(data=tmp_path / "new", reserve=0)
    with asyncio.Runner() as runner:
        one, two = (Blocking(Local(settings), runner) for _ in range(2))
        for process in (one, two):
            process.open()
        job = added(one.store, "x")
        one.wake()
        assert two.store.get(job.id).id == job.id
        assert one.models.folder.is_dir()
        for process in (one, two):
            process.close()
        assert sum(runner.run(_left(settings)).values()) == 1


async def _left(settings: Settings) -> dict[str, int]:
    """What the next process finds."""
    later = Local(settings)
    await later.open()
    try:
        return await later.store.counts()
    finally:
        await later.close()
