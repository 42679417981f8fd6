"""Connections to PostgreSQL that outlive its restarts, and the tables."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

import procrastinate
import psycopg
import structlog
from procrastinate import App, PsycopgConnector
from psycopg_pool import AsyncConnectionPool

from service.jobs.store import Full, Unreachable

T = TypeVar("T")
Connection = psycopg.AsyncConnection
_log = structlog.get_logger("motionenv.service")
_PAUSE = 0.1  # [s] before the next attempt
_CONNECT = 5  # [s] for a connection
#: Numbers of advisory locks: of the tables' making, of files that must not be swept, of queueing, of streams.
SCHEMA, FILES, QUEUE, STREAMS = (0x6D6F7469 + i for i in range(4))


class Database:
    """A pool of at most `size` connections to the database at a PostgreSQL `url`, and procrastinate upon it.

    What fails is tried again for `patience` [s]: a database that restarts is back after one or two.
    """

    def __init__(self, url: str, size: int, patience: float = 10.0) -> None:
        self.url, self.patience = url, patience
        self.pool = AsyncConnectionPool(
            url, min_size=1, max_size=size, open=False, timeout=_CONNECT, reconnect_timeout=_CONNECT,
            configure=_committing, kwargs={"connect_timeout": _CONNECT, "application_name": "motionenv"},
            check=AsyncConnectionPool.check_connection,
        )  # fmt: skip
        self.app = App(connector=PsycopgConnector())

    async def open(self) -> None:
        """Connect, and make the tables if they aren't there.

        Raises:
            Unreachable: there is no such database, or it doesn't answer.
        """
        try:
            await self.pool.open()
            await self.app.open_async(self.pool)
            await self.run(self._make_tables)
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Close all connections."""
        await self.pool.close()

    async def run(self, work: Callable[[Connection], Awaitable[T]]) -> T:
        """Return what `work` does with a connection; it begins anew when the connection is lost.

        So `work` must come to the same if it was done before without our knowing.

        Raises:
            Unreachable: the database doesn't answer.
            Full: its disk is full.
        """
        until = time.monotonic() + self.patience
        while True:
            try:
                async with self.pool.connection() as connection:
                    return await work(connection)
            except psycopg.errors.DiskFull as error:
                raise Full from error
            except (psycopg.OperationalError, psycopg.InterfaceError, procrastinate.exceptions.ConnectorException) as e:
                if time.monotonic() > until:
                    _log.error("database can't be reached", problem=str(e))
                    raise Unreachable from e
            await asyncio.sleep(_PAUSE)

    async def _make_tables(self, connection: Connection) -> None:
        async with connection.transaction():
            await connection.execute("SELECT pg_advisory_xact_lock(%s)", [SCHEMA])
            found = await (await connection.execute("SELECT to_regclass('procrastinate_jobs')")).fetchone()
            if found == (None,):
                await connection.execute(self.app.schema_manager.get_schema().encode())
            await connection.execute(Path(__file__).with_name("schema.sql").read_bytes())


async def _committing(connection: Connection) -> None:
    """Let each statement be a transaction of its own; `kwargs` can't say so, as procrastinate adds that to them."""
    await connection.set_autocommit(True)
