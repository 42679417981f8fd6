"""Jobs: what is known of one, and why one is refused."""

import contextlib
import errno
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

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
