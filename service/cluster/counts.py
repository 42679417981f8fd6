"""Counts shared by all processes: requests for the rate limit, and open streams."""

import asyncio
import secrets
import time

import psycopg
from limits.aio.storage import Storage

from service.cluster.database import STREAMS, Connection, Database
from service.jobs.backend import Streams

#: [s] after which a process that isn't heard of is taken for dead, with its streams; it is heard of every `BEAT` [s].
_DEAD, BEAT = 15.0, 3.0


class SharedCounts(Storage):
    """Counters of the rate limit in the database, for `limits`."""

    STORAGE_SCHEME = None

    def __init__(self, database: Database) -> None:
        super().__init__()
        self.database = database

    @property
    def base_exceptions(self) -> type[Exception]:
        return psycopg.Error

    async def incr(self, key: str, expiry: int, amount: int = 1) -> int:
        query = (
            "INSERT INTO motionenv_counts AS c VALUES (%(key)s, %(amount)s, now() + %(expiry)s * interval '1 s') "
            "ON CONFLICT (key) DO UPDATE SET "
            "value = excluded.value + CASE WHEN c.expires > now() THEN c.value ELSE 0 END, "
            "expires = CASE WHEN c.expires > now() THEN c.expires ELSE excluded.expires END RETURNING value"
        )
        return (await self._asked(query, key=key, amount=amount, expiry=expiry) or (amount,))[0]

    async def get(self, key: str) -> int:
        query = "SELECT value FROM motionenv_counts WHERE key = %(key)s AND expires > now()"
        return (await self._asked(query, key=key) or (0,))[0]

    async def get_expiry(self, key: str) -> float:
        query = "SELECT extract(epoch FROM expires)::float8 FROM motionenv_counts WHERE key = %(key)s"
        return (await self._asked(query, key=key) or (time.time(),))[0]

    async def check(self) -> bool:
        return await self._asked("SELECT 1") == (1,)

    async def reset(self) -> int | None:
        await self._asked("TRUNCATE motionenv_counts")
        return None

    async def clear(self, key: str) -> None:
        await self._asked("DELETE FROM motionenv_counts WHERE key = %(key)s", key=key)

    async def drop_expired(self) -> None:
        """Remove counters that count no more."""
        await self._asked("DELETE FROM motionenv_counts WHERE expires < now()")

    async def _asked(self, query: str, **values: object) -> tuple | None:
        async def work(connection: Connection) -> tuple | None:
            cursor = await connection.execute(query.encode(), values)
            return await cursor.fetchone() if cursor.description else None

        return await self.database.run(work)


class SharedStreams(Streams):
    """Counts the streams of all processes, at most `most`."""

    def __init__(self, database: Database, most: int) -> None:
        self.database, self.most, self.open = database, most, 0
        self._process, self._turn = secrets.token_hex(8), asyncio.Lock()

    async def take(self) -> bool:
        async def work(connection: Connection) -> bool:
            async with connection.transaction():
                await connection.execute("SELECT pg_advisory_xact_lock(%s)", [STREAMS])
                others = await (await connection.execute(
                    "SELECT coalesce(sum(streams), 0) FROM motionenv_processes WHERE id <> %s "
                    "AND seen > now() - %s * interval '1 s'", [self._process, _DEAD],
                )).fetchone()  # fmt: skip
                if others is None or others[0] + self.open >= self.most:
                    return False
                await self._tell(connection, self.open + 1)
                return True

        async with self._turn:
            free = await self.database.run(work)
            self.open += free
        return free

    async def release(self) -> None:
        self.open -= 1  # the others learn it by the next beat

    async def beat(self) -> None:
        """Tell the others how many are open here."""
        await self.database.run(lambda connection: self._tell(connection, self.open))

    async def leave(self) -> None:
        """Tell the others that this process ends."""
        await self.database.run(
            lambda connection: connection.execute("DELETE FROM motionenv_processes WHERE id = %s", [self._process])
        )

    async def _tell(self, connection: Connection, streams: int) -> None:
        await connection.execute(
            "INSERT INTO motionenv_processes VALUES (%s, %s, now()) ON CONFLICT (id) DO UPDATE SET "
            "streams = excluded.streams, seen = excluded.seen", [self._process, streams],
        )  # fmt: skip
