"""Jobs in PostgreSQL, queued by procrastinate."""

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Iterable
from typing import Any, TypeVar

from psycopg.errors import UniqueViolation
from psycopg.types.json import Json

from service.cluster.database import FILES, QUEUE, Connection, Database
from service.jobs.store import (
    ATTEMPTS,
    COLUMNS,
    GIVEN_UP,
    LANES,
    WAITING,
    Job,
    Repeated,
    Store,
    Taken,
    Waiting,
    lane_of,
)  # fmt: skip

T = TypeVar("T")
#: The task of procrastinate that runs a job, given its id; its queues are `queue_of` the lanes.
TASK = "motionenv.run"
_NOW = "extract(epoch FROM clock_timestamp())"
_AGAIN = "status = 'queued', progress = 0, message = 'waiting', lease = NULL, leased_until = NULL, ticket = %s"


def queue_of(lane: str) -> str:
    """The name of a lane's queue."""
    return f"motionenv-{lane}"


class PostgresStore(Store):
    """Jobs in a database that many processes share; `lease` is how long a silent worker keeps its jobs [s].

    A job's row is what is true of it; procrastinate holds a ticket for each that is queued, made in the transaction
    that queues it. Every attempt has a lease of its own, and only its holder can end it. All times are the database's.
    What is done by a connection that is lost is done again, and comes to the same.
    """

    def __init__(self, database: Database, lease: float) -> None:
        self.database, self.lease = database, lease
        self._held: dict[str, str] = {}  # leases of the jobs that run in this process, by their ids

    async def add(
        self, job: Job, inputs: Iterable[tuple[str, str]], *, most: int, idempotency: str | None,
        place: Callable[[], None],
    ) -> None:  # fmt: skip
        files, lane = list(inputs), lane_of(job.kind)

        async def work(connection: Connection) -> None:
            await _lock(connection, FILES, shared=True)
            await asyncio.to_thread(place)  # before the queue is locked: it may take long
            await _lock(connection, QUEUE)
            if await _one(connection, "SELECT 1 FROM motionenv_jobs WHERE id = %s", job.id):
                return  # it was added before the connection was lost
            if await self._queued(connection, lane) >= most:
                raise Waiting
            if job.model and await _one(
                connection, "SELECT 1 FROM motionenv_jobs WHERE model = %s AND status = ANY(%s)",
                job.model, list(WAITING),
            ):  # fmt: skip
                raise Taken
            await connection.execute(
                "INSERT INTO motionenv_jobs (id, kind, lane, settings, model, media_type, filename, created, owner, "
                "idempotency, ticket) VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)",
                (job.id, job.kind, lane, Json(job.settings), job.model, job.media_type, job.filename, job.created,
                 job.owner, idempotency, await self._ticket(connection, job.id, lane)),
            )  # fmt: skip
            async with connection.cursor() as cursor:
                await cursor.executemany(
                    "INSERT INTO motionenv_inputs VALUES (%s, %s, %s, %s)",
                    [(job.id, i, name, sha) for i, (name, sha) in enumerate(files)],
                )

        try:
            await self._transaction(work)
        except UniqueViolation:
            raise Repeated from None

    async def get(self, job: str) -> Job | None:
        return await self._job("id = %s", job)

    async def same(self, idempotency: str) -> Job | None:
        return await self._job("idempotency = %s", idempotency)

    async def inputs(self, job: str) -> list[tuple[str, str]]:
        return await self._all("SELECT name, sha FROM motionenv_inputs WHERE job = %s ORDER BY place", job)

    async def page(
        self, most: int, status: str | None = None, before: int | None = None, owner: str | None = None
    ) -> list[Job]:
        found = await self._all(
            f"SELECT {COLUMNS} FROM motionenv_jobs WHERE (%s::text IS NULL OR status = %s) "
            "AND (%s::bigint IS NULL OR number < %s) AND (%s::text IS NULL OR owner = %s) "
            "ORDER BY number DESC LIMIT %s",
            status, status, before, before, owner, owner, most,
        )  # fmt: skip
        return list(map(_job, found))

    async def last(self) -> int:
        query = "SELECT CASE WHEN is_called THEN last_value ELSE 0 END FROM motionenv_jobs_number_seq"
        return (await self._all(query))[0][0]

    async def queued(self, lane: str) -> int:
        return await self.database.run(lambda connection: self._queued(connection, lane))

    async def counts(self) -> dict[str, int]:
        return dict(await self._all("SELECT status, count(*) FROM motionenv_jobs GROUP BY status"))

    async def claim(self, job: str) -> Job | None:
        """Take the lease of a queued job and return it; None if it isn't queued any more."""
        lease = secrets.token_hex(8)
        self._held[job] = lease
        found = await self._all(
            f"UPDATE motionenv_jobs SET status = 'running', attempts = attempts + 1, started = {_NOW}, progress = 0, "
            "message = 'starting', lease = %s, leased_until = now() + %s * interval '1 s' "
            f"WHERE id = %s AND (status = 'queued' OR lease = %s) RETURNING {COLUMNS}",
            lease, self.lease, job, lease,
        )  # fmt: skip
        if not found:
            del self._held[job]
        return _job(found[0]) if found else None

    def drop(self, job: Job) -> None:
        """Forget the lease of a job that doesn't run here any more."""
        self._held.pop(job.id, None)

    async def running(self) -> set[str]:
        """Renew the leases of this process; returns the ids of those that it still holds."""
        query = (
            "UPDATE motionenv_jobs SET leased_until = now() + %s * interval '1 s' "
            "WHERE status = 'running' AND lease = ANY(%s) RETURNING id"
        )
        return {row[0] for row in await self._all(query, self.lease, list(self._held.values()))}

    async def progress(self, job: Job, progress: float, message: str) -> None:
        await self._of_holder(job, "progress = %s, message = %s", progress, message)

    async def finish(self, job: Job, result: str, size: int, model: str | None, publish: Callable[[], None]) -> bool:
        async def work(connection: Connection) -> bool:
            await _lock(connection, FILES, shared=True)
            await asyncio.to_thread(publish)
            ended = await _one(
                connection,
                f"UPDATE motionenv_jobs SET status = 'done', progress = 1, message = 'done', ended = {_NOW}, "
                "result = %s, size = %s, ticket = NULL WHERE id = %s AND lease = %s AND status IN ('running', 'done') "
                "RETURNING 1",  # done: by an attempt of ours whose connection was lost
                result, size, job.id, self._held.get(job.id),
            )  # fmt: skip
            if ended and job.model:
                await connection.execute(
                    f"INSERT INTO motionenv_models VALUES (%s, %s, %s, ({_NOW} * 1e6)::bigint * 1000) "
                    "ON CONFLICT (name) DO UPDATE SET sha = excluded.sha, changed = excluded.changed",
                    (job.model, job.owner, model),
                )
            return ended is not None

        return await self._transaction(work)

    async def fail(self, job: Job, status: int, detail: str) -> bool:
        error = Json({"status": status, "detail": detail})
        return await self._of_holder(
            job, f"status = 'failed', message = %s, error = %s, ended = {_NOW}, ticket = NULL", detail, error
        )

    async def cancel(self, job: str) -> bool:
        return bool(await self._all(
            f"UPDATE motionenv_jobs SET status = 'cancelled', message = 'cancelled', ended = {_NOW}, ticket = NULL "
            "WHERE id = %s AND status = ANY(%s) RETURNING 1", job, list(WAITING),
        ))  # fmt: skip

    async def put_back(self, job: Job, *, begun: bool = False) -> None:
        lease, lane = self._held.get(job.id), lane_of(job.kind)

        async def work(connection: Connection) -> None:
            held = "SELECT 1 FROM motionenv_jobs WHERE id = %s AND status = 'running' AND lease = %s FOR UPDATE"
            if await _one(connection, held, job.id, lease):
                await connection.execute(
                    f"UPDATE motionenv_jobs SET {_AGAIN}, attempts = attempts - %s WHERE id = %s",
                    (await self._ticket(connection, job.id, lane), 0 if begun else 1, job.id),
                )

        await self._transaction(work)

    async def recover(self) -> list[str]:
        """Queue again what silent workers ran or were about to run, or give it up; returns the ids of both."""

        async def work(connection: Connection) -> list[str]:
            # Also queued jobs whose ticket is gone, or held by a worker that is: it ended between ticket and lease.
            lost = await (await connection.execute(
                "SELECT j.id, j.lane, j.status, j.attempts, j.ticket FROM motionenv_jobs j "
                "LEFT JOIN procrastinate_jobs t ON t.id = j.ticket LEFT JOIN procrastinate_workers w "
                "ON w.id = t.worker_id WHERE (j.status = 'running' AND j.leased_until < now()) OR (j.status = 'queued' "
                "AND (t.id IS NULL OR t.status NOT IN ('todo', 'doing') OR (t.status = 'doing' AND "
                "(w.id IS NULL OR w.last_heartbeat < now() - %s * interval '1 s')))) FOR UPDATE OF j SKIP LOCKED",
                [self.lease],
            )).fetchall()  # fmt: skip
            for job, lane, status, attempts, ticket in lost:
                await connection.execute("DELETE FROM procrastinate_jobs WHERE id = %s", [ticket])
                if status == "running" and attempts >= ATTEMPTS:
                    await connection.execute(
                        f"UPDATE motionenv_jobs SET status = 'failed', message = %s, error = %s, ended = {_NOW}, "
                        "lease = NULL, ticket = NULL WHERE id = %s", (GIVEN_UP["detail"], Json(GIVEN_UP), job),
                    )  # fmt: skip
                else:
                    again = await self._ticket(connection, job, lane)
                    await connection.execute(f"UPDATE motionenv_jobs SET {_AGAIN} WHERE id = %s", (again, job))
            return [row[0] for row in lost]

        return await self._transaction(work)

    async def remove(self, job: str) -> bool:
        query = "DELETE FROM motionenv_jobs WHERE id = %s AND NOT status = ANY(%s) RETURNING 1"
        return bool(await self._all(query, job, list(WAITING)))

    async def expire(self, before: float) -> int:
        return len(await self._all("DELETE FROM motionenv_jobs WHERE ended < %s RETURNING 1", before))

    async def forget(self, model: str) -> None:
        await self._all("DELETE FROM motionenv_models WHERE name = %s RETURNING 1", model)

    async def sweep(self, shas: Iterable[str], remove: Callable[[str], None]) -> None:
        asked = list(shas)

        async def work(connection: Connection) -> None:
            if await _one(connection, "SELECT 1 WHERE pg_try_advisory_xact_lock(%s)", FILES) is None:
                return  # files are being placed; what nothing refers to is found by the next sweep
            unused = await (await connection.execute(
                "SELECT sha FROM unnest(%s::text[]) AS given (sha) WHERE NOT EXISTS (SELECT 1 FROM motionenv_inputs i "
                "WHERE i.sha = given.sha) AND NOT EXISTS (SELECT 1 FROM motionenv_jobs j WHERE j.result = given.sha) "
                "AND NOT EXISTS (SELECT 1 FROM motionenv_models m WHERE m.sha = given.sha)", [asked],
            )).fetchall()  # fmt: skip
            for (sha,) in unused:
                await asyncio.to_thread(remove, sha)

        if asked:
            await self._transaction(work)

    async def _ticket(self, connection: Connection, job: str, lane: str) -> int:
        task = self.database.app.configure_task(TASK, queue=queue_of(lane), connection=connection)
        return await task.defer_async(job=job)

    async def _queued(self, connection: Connection, lane: str) -> int:
        query = "SELECT count(*) FROM motionenv_jobs WHERE status = 'queued' AND kind = ANY(%s)"
        return (await _one(connection, query, list(LANES[lane])) or (0,))[0]

    async def _of_holder(self, job: Job, change: str, *values: Any) -> bool:
        query = f"UPDATE motionenv_jobs SET {change} WHERE id = %s AND lease = %s AND status = 'running' RETURNING 1"
        return bool(await self._all(query, *values, job.id, self._held.get(job.id)))

    async def _all(self, query: str, *values: Any) -> list[Any]:
        async def work(connection: Connection) -> list[Any]:
            return await (await connection.execute(query.encode(), values)).fetchall()

        return await self.database.run(work)

    async def _job(self, where: str, value: str) -> Job | None:
        found = await self._all(f"SELECT {COLUMNS} FROM motionenv_jobs WHERE {where}", value)
        return _job(found[0]) if found else None

    async def _transaction(self, work: Callable[[Connection], Awaitable[T]]) -> T:
        async def all_or_nothing(connection: Connection) -> T:
            async with connection.transaction():
                return await work(connection)

        return await self.database.run(all_or_nothing)


async def _one(connection: Connection, query: str, *values: Any) -> Any:
    return await (await connection.execute(query.encode(), values)).fetchone()


async def _lock(connection: Connection, lock: int, shared: bool = False) -> None:
    """Wait for an advisory lock, which is held to the end of the transaction."""
    await connection.execute(f"SELECT pg_advisory_xact_lock{'_shared' if shared else ''}(%s)".encode(), [lock])


def _job(row: tuple) -> Job:
    return Job(**dict(zip(Job.__dataclass_fields__, row, strict=True)))
