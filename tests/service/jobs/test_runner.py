"""One job, from its files to its result."""

import asyncio
from pathlib import Path

import psutil
import pytest

import motionenv
from service.jobs.file_store import FileStore
from service.jobs.runner import JobRunner
from service.jobs.store import ATTEMPTS, SqliteStore
from service.model_registry import ModelRegistry
from service.settings import Settings
from tests.service.jobs.storing import Alone, Job
from tests.service.waiting import until

CONVERT = {"fps": None, "unit": None, "suffix": ".npz"}


class Bench:
    """A runner and all that it needs, in a folder."""

    def __init__(self, folder: Path, runner: asyncio.Runner):
        self.folder, self.loop = folder / "work", runner
        self.files = FileStore(folder, 0)
        self.store = Alone(SqliteStore(folder / "jobs.sqlite", lambda: False), runner)
        settings = Settings(data=folder, reserve=0, job_memory=3_000_000_000, job_seconds=60)
        self.runner = JobRunner(settings, self.store._thing, self.files, ModelRegistry(folder / "models"), self.folder)

    def claimed(self, content: bytes, kind: str = "convert", settings=CONVERT) -> Job:
        """A job that has been claimed, with a file."""
        file = self.files.receive()
        file.write(content)
        sha = file.close()
        job = Job("one", kind, settings, None, "application/x", "a.npz", 0.0)
        place = lambda: self.files.place(file.path, sha)
        self.store.add(job, [("walk.bvh", sha)], most=9, idempotency=None, place=place)
        return self.store._wait(self.store._thing.claim, "quick" if kind == "convert" else "long")

    def run(self, job: Job) -> Job:
        """The job after it was run."""
        self.loop.run(self.runner.run(job))
        assert not list(self.folder.glob("*"))
        return self.store.get(job.id)


@pytest.fixture
def bench(tmp_path, runner):
    made = Bench(tmp_path, runner)
    yield made
    made.store.close()


@pytest.fixture
def walk(tmp_path) -> bytes:
    motionenv.write(motionenv.synthesize("walk/fpca", 1, 60, seed=1), tmp_path / "walk.bvh")
    return (tmp_path / "walk.bvh").read_bytes()


def test_a_file_that_is_gone_is_an_error_of_the_service(bench, walk):
    job = bench.claimed(walk)
    for sha in bench.files.all():
        bench.files.remove(sha)
    failed = bench.run(job)
    assert (failed.status, failed.error["status"]) == ("failed", 500)


def test_a_job_that_was_cancelled_meanwhile_leaves_nothing(bench, walk):
    job = bench.claimed(walk)
    bench.store.cancel(job.id)
    before = bench.files.all()
    assert bench.run(job).status == "cancelled"
    assert bench.files.all() == before


FILM = {"request": {"seconds": 600.0, "fps": 30.0, "seed": 1, "picture": {"width": 64, "height": 64},
                    "model": "walk/fpca"}, "suffix": ".mp4"}  # fmt: skip


@pytest.mark.parametrize(("attempts", "then"), [(1, "queued"), (ATTEMPTS, "failed")])
def test_a_job_whose_process_is_killed_begins_again_until_it_is_given_up(bench, walk, attempts, then):
    job = bench.claimed(walk, "render", FILM)
    for _ in range(attempts - 1):
        bench.store.put_back(job, begun=True)
        job = bench.store.claim_next()

    async def killed() -> None:
        running = asyncio.create_task(bench.runner.run(job))
        inside = lambda: [p for p in psutil.Process().children() if bench.folder in Path(p.cwd()).parents]
        await asyncio.to_thread(until, inside)
        inside()[0].kill()
        await running

    bench.loop.run(killed())
    assert bench.store.get(job.id).status == then
