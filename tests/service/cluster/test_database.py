"""Connections that outlive what happens to the database, and its tables."""

import asyncio
import time

import psycopg
import pytest

from service.cluster.database import Database
from service.jobs.store import Unreachable


def test_a_database_that_does_not_answer_is_told():
    begun = time.monotonic()
    with pytest.raises(Unreachable):
        asyncio.run(Database("postgresql://nobody@127.0.0.1:9/none", 2, patience=0.5).open())
    assert time.monotonic() - begun < 30


def test_the_tables_are_made_once_by_processes_that_start_together(postgres):
    url = postgres.new()

    async def opened() -> None:
        databases = [Database(url, 2) for _ in range(5)]
        await asyncio.gather(*(database.open() for database in databases))
        for database in databases:
            await database.close()

    asyncio.run(opened())
    with psycopg.connect(url) as connection:
        found = connection.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'").fetchall()
    assert {"motionenv_jobs", "motionenv_models", "procrastinate_jobs"} <= {name for (name,) in found}


def test_work_is_done_again_on_a_new_connection_when_one_breaks(postgres):
    url, tries = postgres.new(), []

    async def work(connection) -> int:
        tries.append(connection.info.backend_pid)
        if len(tries) == 1:
            with psycopg.connect(url, autocommit=True) as other:
                other.execute("SELECT pg_terminate_backend(%s)", [tries[0]])
        return (await (await connection.execute("SELECT 7")).fetchone())[0]

    async def done() -> int:
        database = Database(url, 2)
        await database.open()
        try:
            return await database.run(work)
        finally:
            await database.close()

    assert asyncio.run(done()) == 7
    assert len(set(tries)) == 2


def test_what_is_wrong_with_the_work_itself_is_not_tried_again(postgres):
    tries = []

    async def work(connection) -> None:
        tries.append(True)
        await connection.execute("SELECT nonsense")

    async def done() -> None:
        database = Database(postgres.new(), 2)
        await database.open()
        try:
            await database.run(work)
        finally:
            await database.close()

    with pytest.raises(psycopg.errors.UndefinedColumn):
        asyncio.run(done())
    assert len(tries) == 1
