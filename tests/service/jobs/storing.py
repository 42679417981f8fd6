"""Stores of jobs for tests, which wait for each call."""

import secrets
import time

import psycopg

from service.cluster.database import Database
from service.cluster.postgres import PostgresStore
from service.jobs.store import Job
from tests.service.jobs.blocking import Blocking

LEASE = 0.5  # [s]


class Shared(Blocking):
    """A store as of a process of its own."""

    def claim_next(self) -> Job | None:
        """The oldest job that is queued, as procrastinate would hand it out."""
        with psycopg.connect(self.database.url, autocommit=True) as connection:
            query = "SELECT args ->> 'job' FROM procrastinate_fetch_job_v2(NULL, NULL)"
            (taken,) = connection.execute(query).fetchone()
        return taken and self.claim(taken)


class Alone(Blocking):
    """The store of a data folder."""

    def claim_next(self) -> Job | None:
        """The oldest job that is queued."""
        return self._wait(self._thing.claim, "long")


def shared_store(url: str, runner, lease: float = LEASE, patience: float = 10.0) -> Shared:
    """A store with connections of its own, to be closed by `store.database.close()`."""
    database = Database(url, 5, patience)
    runner.run(database.open())
    return Shared(PostgresStore(database, lease), runner)


def added(
    store: Blocking, *inputs: str, model: str | None = None, most: int = 100, key: str | None = None, owner: str = "",
    kind: str = "fit",
) -> Job:  # fmt: skip
    job = Job(secrets.token_urlsafe(16), kind, {"a": [1.5], "é": None}, model, "application/json", "a.json",
              time.time(), owner=owner)  # fmt: skip
    store.add(job, [(f"{sha}.npz", sha) for sha in inputs], most=most, idempotency=key, place=lambda: None)
    return job
