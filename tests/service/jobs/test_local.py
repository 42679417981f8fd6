"""What server processes of one machine share."""

import asyncio
from pathlib import Path

import pytest

from service.jobs.backend import Backend
from service.settings import Settings
from tests.service.jobs.blocking import Blocking
from tests.service.jobs.storing import added


def test_two_processes_on_one_folder_see_the_same_jobs(tmp_path: Path):
    settings = Settings(data=tmp_path / "new", reserve=0)
    with asyncio.Runner() as runner:
        one, two = (Blocking(Backend(settings), runner) for _ in range(2))
        for process in (one, two):
            process.open()
        job = added(one.store, "x")
        one.wake()
        assert two.store.get(job.id).id == job.id
        assert one.models.folder.is_dir()
        for process in (one, two):
            process.close()
        assert sum(runner.run(_left(settings)).values()) == 1


@pytest.mark.parametrize("turns", range(5))
def test_it_ends_whenever_it_was_woken(tmp_path: Path, turns: int):
    """Also if what it waits for comes in the same turn of the event loop as its end."""

    async def woken_and_closed() -> None:
        local = Backend(Settings(data=tmp_path, reserve=0))
        await local.open()
        await asyncio.sleep(0.4)  # it has looked for jobs, and waits for more
        local.wake()
        for _ in range(turns):
            await asyncio.sleep(0)
        async with asyncio.timeout(20):
            await local.close()

    asyncio.run(woken_and_closed())


async def _left(settings: Settings) -> dict[str, int]:
    """What the next process finds."""
    later = Backend(settings)
    await later.open()
    try:
        return await later.store.counts()
    finally:
        await later.close()
