"""Records of jobs: the interface, which `service.jobs.sqlite` and `service.cluster.postgres` implement."""

import contextlib
import errno
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

#: Attempts to run a job that is interrupted by the end of the process that runs it.
ATTEMPTS = 5
#: Error of a job that is given up after them.
GIVEN_UP = {"status": 500, "detail": f"the service ended {ATTEMPTS} times while this job ran: submit it again"}
WAITING = ("queued", "running")
#: Kinds of jobs that wait for each other: an inspection of a second doesn't wait behind a film.
LANES: dict[str, tuple[str, ...]] = {
    "quick": ("inspect", "points", "convert", "report", "import"),
    "long": ("fit", "render"),
}


class Full(Exception):
    """The disk is full."""


class Waiting(Exception):
    """Too many jobs are queued."""


class Taken(Exception):
    """Another job fits a model of that name."""


class Repeated(Exception):
    """An equal request came at the same time: its job is there."""


class Unreachable(Exception):
    """The database or the store of files doesn't answer; nothing is known of what was asked."""


@dataclass(frozen=True)
class Job:
    """A job."""

    id: str  # unguessable
    kind: str  # of `service.jobs.tasks.KINDS`
    settings: dict[str, Any]  # of the request
    model: str | None  # name of the model that it fits
    media_type: str  # of the result
    filename: str  # under which to save the result
    created: float  # Unix time [s]
    status: str = "queued"  # or "running", "done", "failed", "cancelled"
    progress: float = 0.0  # to 1
    message: str = "waiting"  # current step
    attempts: int = 0  # number of starts
    started: float | None = None  # Unix time [s]
    ended: float | None = None  # Unix time [s]
    error: dict[str, Any] | None = None  # status and detail, if it failed
    result: str | None = None  # SHA-256 of the result
    size: int | None = None  # of the result [bytes]
    owner: str = ""  # whose key made it; empty without keys
    number: int = field(default=0, compare=False)  # in the order of their coming, given by the database


#: Columns of a job, in the order of its fields.
COLUMNS = ", ".join(Job.__dataclass_fields__)


class Store(Protocol):
    """Jobs, their files' names and digests, and which models they made.

    What a runner says of a job (`progress`, `finish`, `fail`, `put_back`) counts only while that attempt of it runs:
    after a job was cancelled, or given to another runner, it changes nothing. All but `place`, `publish` and `remove`,
    which block, are awaited. Any method may raise `Unreachable`; those that write may raise `Full`.
    """

    async def add(
        self, job: Job, inputs: Iterable[tuple[str, str]], *, most: int, idempotency: str | None,
        place: Callable[[], None],
    ) -> None:  # fmt: skip
        """Queue a job with its files (name, SHA-256); `place` moves them into the file store within the transaction.

        Raises:
            Full: the disk is full.
            Repeated: there is a job with the same `idempotency`.
            Taken: another job fits a model of that name.
            Waiting: `most` jobs of its lane are queued.
        """

    async def get(self, job: str) -> Job | None:
        """The job with an id."""

    async def same(self, idempotency: str) -> Job | None:
        """The job of an earlier request with the same id."""

    async def inputs(self, job: str) -> list[tuple[str, str]]:
        """Name and SHA-256 of a job's files, in order of upload."""

    async def page(
        self, most: int, status: str | None = None, before: int | None = None, owner: str | None = None
    ) -> list[Job]:
        """At most `most` jobs, newest first: those with a status, with a number less than `before`, of an owner."""

    async def last(self) -> int:
        """The number of the job that came last, whether it is still there or not."""

    async def queued(self, lane: str) -> int:
        """Number of queued jobs in a lane."""

    async def counts(self) -> dict[str, int]:
        """Number of jobs by status."""

    async def running(self) -> set[str]:
        """Ids of the jobs that this process has claimed and should go on with."""

    async def progress(self, job: Job, progress: float, message: str) -> None:
        """Update the progress of a running job."""

    async def finish(self, job: Job, result: str, size: int, model: str | None, publish: Callable[[], None]) -> bool:
        """Mark a running job as done, with the SHA-256 of its result and its size; False if it doesn't run any more.

        `model` is the SHA-256 of the model that it made. `publish` moves result and model into place, within the
        transaction.
        """

    async def fail(self, job: Job, status: int, detail: str) -> bool:
        """Mark a running job as failed, with what its client is told; False if it doesn't run any more."""

    async def cancel(self, job: str) -> bool:
        """Cancel a queued or running job; False if it had ended before."""

    async def put_back(self, job: Job, *, begun: bool = False) -> None:
        """Queue a running job again; `begun` says whether this counts as an attempt."""

    async def recover(self) -> list[str]:
        """Queue jobs again whose runner was killed, or give them up; returns the ids of both."""

    async def remove(self, job: str) -> bool:
        """Remove a job that has ended; False if there is none."""

    async def expire(self, before: float) -> int:
        """Remove the jobs that ended before a Unix time [s]; returns their number."""

    async def forget(self, model: str) -> None:
        """Remove the record of a model."""

    async def sweep(self, shas: Iterable[str], remove: Callable[[str], None]) -> None:
        """Remove those of the files that nothing refers to, within a transaction."""


def lane_of(kind: str) -> str:
    """The lane of a kind of job."""
    return next(lane for lane, kinds in LANES.items() if kind in kinds)


@contextlib.contextmanager
def full_disk_errors() -> Iterator[None]:
    """Convert the errors of a full disk, the system's and SQLite's, to `Full`."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise Full from error
        raise
    except sqlite3.OperationalError as error:
        kind = (error.sqlite_errorcode or 0) & 0xFF
        if kind in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN):
            raise Full from error
        raise
