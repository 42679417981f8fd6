"""How many jobs a second one worker takes from the queue and ends, without what is done in them.

    motionenv bench service.jobs --database postgresql://user@host/empty [--jobs 2000] [--slots 8] [--rounds 3]

The worker is that of `motionenv work`, with jobs that are done at once; the peer is procrastinate's own worker with a
task that does nothing, on the same database. Both run in a process of their own and fetch from a full queue; the time
is from the first job's start to the last one's end, as the process tells it.
"""

import asyncio
import multiprocessing
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks import Arguments, Skipped, needs

needs("procrastinate", "psycopg_pool")
import procrastinate
from procrastinate import App, PsycopgConnector

from service.cluster.database import Database
from service.cluster.postgres import PostgresStore
from service.cluster.worker import Worker, WorkerSettings
from service.jobs.store import Job

_EMPTY = "benchmark.nothing"


def main() -> None:
    """Print the table."""
    options = Arguments(__doc__)
    options.add_argument("--database", help="an empty database, whose tables are made and emptied")
    options.add_argument("--jobs", type=int, default=2000, quick=8)
    options.add_argument("--slots", type=int, default=8, quick=2, help="jobs that run at the same time")
    options.add_argument("--rounds", type=int, default=3, quick=1)
    asked = options.parse_args()
    if asked.database is None:
        raise Skipped("name an empty PostgreSQL database with --database")
    spent: dict[str, list[float]] = {"ours": [], "peer": []}
    for _ in range(asked.rounds):
        for name, measured in (("ours", _ours), ("peer", _peer)):
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                spent[name].append(asked.jobs / pool.apply(measured, (asked.database, asked.jobs, asked.slots)))
    ratio = statistics.median(a / b for a, b in zip(spent["ours"], spent["peer"], strict=True))
    print(f"| | jobs/s of one worker process, {asked.slots} slots |\n|-|-|")
    print(f"| motionenv work, jobs that are done at once | {statistics.median(spent['ours']):.0f} ({ratio:.2f}×) |")
    print(f"| procrastinate, a task that does nothing | {statistics.median(spent['peer']):.0f} |")


def _ours(url: str, jobs: int, slots: int) -> float:
    """Seconds that a worker takes for jobs that are done at once."""
    return asyncio.run(_worked(url, jobs, slots))


async def _worked(url: str, jobs: int, slots: int) -> float:
    await _queue(url, jobs)
    begun, left = [], [jobs]
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder:
        settings: dict[str, Any] = {"data": Path(folder), "database": url, "store": f"file://{folder}/files"}

        async def at_once(job: Job) -> None:
            begun.append(time.perf_counter())
            await worker.store.finish(job, job.id, 0, None, lambda: None)
            left[0] -= 1
            if not left[0]:
                worker.stop()

        worker = Worker(WorkerSettings(quick_processes=slots, **settings), at_once)
        await worker.work()
    return time.perf_counter() - begun[0]


async def _queue(url: str, jobs: int) -> None:
    """Fill the queue."""
    database = Database(url, 4)
    await database.open()
    await database.run(lambda c: c.execute("TRUNCATE motionenv_jobs, procrastinate_jobs CASCADE"))
    store = PostgresStore(database, 15)
    for i in range(jobs):
        job = Job(f"job-{i}", "inspect", {}, None, "application/json", "a.json", time.time())
        await store.add(job, [("walk.bvh", "sha")], most=jobs + 1, idempotency=None, place=lambda: None)
    await database.close()


def _peer(url: str, jobs: int, slots: int) -> float:
    """Seconds that procrastinate takes for tasks that do nothing."""
    return asyncio.run(_ran(url, jobs, slots))


async def _ran(url: str, jobs: int, slots: int) -> float:
    app, begun = App(connector=PsycopgConnector(conninfo=url, max_size=slots + 4)), []

    @app.task(name=_EMPTY, queue=_EMPTY)
    async def nothing() -> None:
        begun.append(time.perf_counter())

    async with app.open_async():
        await app.job_manager.batch_defer_jobs_async(
            [procrastinate.jobs.Job(id=None, queue=_EMPTY, lock=None, queueing_lock=None, task_name=_EMPTY)] * jobs
        )
        await app.run_worker_async(
            queues=[_EMPTY], concurrency=slots, wait=False, delete_jobs="always", install_signal_handlers=False
        )
    assert len(begun) == jobs
    return time.perf_counter() - begun[0]


if __name__ == "__main__":
    main()
