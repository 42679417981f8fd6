"""Stores of jobs for tests, which wait for each call."""

import secrets
import time

from service.jobs.store import Job
from tests.service.jobs.blocking import Blocking


class Alone(Blocking):
    """The store of a data folder."""

    def claim_next(self) -> Job | None:
        """The oldest job that is queued."""
        return self._wait(self._thing.claim, "long")


def added(
    store: Blocking, *inputs: str, model: str | None = None, most: int = 100, key: str | None = None, owner: str = "",
    kind: str = "fit",
) -> Job:  # fmt: skip
    job = Job(secrets.token_urlsafe(16), kind, {"a": [1.5], "é": None}, model, "application/json", "a.json",
              time.time(), owner=owner)  # fmt: skip
    store.add(job, [(f"{sha}.npz", sha) for sha in inputs], most=most, idempotency=key, place=lambda: None)
    return job
