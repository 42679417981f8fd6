"""Jobs in SQLite, in WAL mode, which loses nothing when processes are killed."""

import contextlib
import errno
import json
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
_TIMEOUT = 10.0  # [s] for other processes' transactions, which take milliseconds
#: Attempts to run a job that is interrupted by the end of the process that runs it.
ATTEMPTS = 5
_LATEST = 20  # jobs that tell how long one takes
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

    @property
    def listed(self) -> bool:
        """Whether lists show the job, and the model that it makes."""
        return self.settings.get("listed", True)


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


class SqliteStore:
    """Jobs on disk. Calls take well under a millisecond, don't wait for others, and are made from one thread.

    Commits survive the end of any process but not a power failure, which would need a disk sync for each. On a full
    disk, `make_room` frees some space and returns whether it did. What a runner says of a job that was cancelled
    changes nothing; only the process that locks the data folder runs jobs.
    """

    def __init__(self, path: Path, make_room: Callable[[], bool]) -> None:
        self._make_room = make_room
        self._db = self._urgent(lambda: _opened(path))

    def close(self) -> None:
        """Close the database."""
        self._db.close()

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
        with full_disk_errors(), self._transaction():
            if idempotency and self._one("SELECT 1 FROM jobs WHERE idempotency = ?", idempotency):
                raise Repeated
            if self._queued(lane_of(job.kind)) >= most:
                raise Waiting
            if job.model and self._one("SELECT 1 FROM jobs WHERE model = ? AND status IN (?, ?)", job.model, *WAITING):
                raise Taken
            place()
            self._db.execute(
                "INSERT INTO jobs (id, kind, settings, model, media_type, filename, created, owner, idempotency) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (job.id, job.kind, json.dumps(job.settings), job.model, job.media_type, job.filename, job.created,
                 job.owner, idempotency),
            )  # fmt: skip
            self._db.executemany("INSERT INTO inputs VALUES (?, ?, ?)", [(job.id, *given) for given in inputs])

    async def get(self, job: str) -> Job | None:
        """The job with an id."""
        return self._job("WHERE id = ?", job)

    async def same(self, idempotency: str) -> Job | None:
        """The job of an earlier request with the same id."""
        return self._job("WHERE idempotency = ?", idempotency)

    async def inputs(self, job: str) -> list[tuple[str, str]]:
        """Name and SHA-256 of a job's files, in order of upload."""
        return self._db.execute("SELECT name, sha FROM inputs WHERE job = ? ORDER BY rowid", (job,)).fetchall()

    async def page(
        self, most: int, status: str | None = None, before: int | None = None, owner: str | None = None
    ) -> list[Job]:
        """At most `most` listed jobs, newest first: with a status, with a number less than `before`, of an owner."""
        query = (
            f"SELECT {COLUMNS} FROM jobs WHERE (?1 IS NULL OR status = ?1) AND (?2 IS NULL OR number < ?2) "
            "AND (?3 IS NULL OR owner = ?3) AND json_extract(settings, '$.listed') IS NOT 0 "
            "ORDER BY number DESC LIMIT ?4"
        )
        return [_job(row) for row in self._db.execute(query, (status, before, owner, most))]

    async def last(self) -> int:
        """The number of the job that came last, whether it is still there or not."""
        return (self._one("SELECT seq FROM sqlite_sequence WHERE name = 'jobs'") or (0,))[0]

    async def queued(self, lane: str) -> int:
        """Number of queued jobs in a lane."""
        return self._queued(lane)

    def _queued(self, lane: str) -> int:
        kinds, marks = _kinds(lane)
        return self._one(f"SELECT count(*) FROM jobs WHERE status = 'queued' AND kind IN ({marks})", *kinds)[0]

    async def models(self) -> set[str]:
        """Names of the models that jobs made or make."""
        return {row[0] for row in self._db.execute("SELECT model FROM jobs WHERE model IS NOT NULL")}

    async def usual(self, lane: str) -> float:
        """Mean duration [s] of the latest jobs of a lane that were done; 10 before there are any."""
        kinds, marks = _kinds(lane)
        query = (
            f"SELECT ended - started AS t FROM jobs WHERE status = 'done' AND kind IN ({marks}) ORDER BY number DESC"
        )
        return self._one(f"SELECT avg(t) FROM ({query} LIMIT {_LATEST})", *kinds)[0] or 10.0

    async def counts(self) -> dict[str, int]:
        """Number of jobs by status."""
        return dict(self._db.execute("SELECT status, count(*) FROM jobs GROUP BY status"))

    async def claim(self, lane: str) -> Job | None:
        """Mark the oldest queued job of a lane as running and return it; None if there is none."""
        kinds, marks = _kinds(lane)
        row = self._write(
            "UPDATE jobs SET status = 'running', attempts = attempts + 1, started = ?, progress = 0, "
            "message = 'starting' "
            f"WHERE number = (SELECT min(number) FROM jobs WHERE status = 'queued' AND kind IN ({marks})) "
            f"RETURNING {COLUMNS}",
            time.time(), *kinds,
        )  # fmt: skip
        return _job(row[0]) if row else None

    async def running(self) -> set[str]:
        """Ids of the jobs that this process has claimed and should go on with."""
        return {row[0] for row in self._db.execute("SELECT id FROM jobs WHERE status = 'running'")}

    async def progress(self, job: Job, progress: float, message: str) -> None:
        """Update the progress of a running job."""
        with full_disk_errors():
            self._db.execute(
                "UPDATE jobs SET progress = ?, message = ? WHERE id = ? AND status = 'running'",
                (progress, message, job.id),
            )

    async def finish(self, job: Job, result: str, size: int, publish: Callable[[], None]) -> bool:
        """Mark a running job as done, with the SHA-256 of its result and its size; False if it doesn't run any more.

        `publish` moves its result, and the model that it made, into place within the transaction.
        """

        def work() -> bool:
            with self._transaction():
                found = self._db.execute(
                    "UPDATE jobs SET status = 'done', progress = 1, message = 'done', ended = ?, result = ?, size = ? "
                    "WHERE id = ? AND status = 'running'",
                    (time.time(), result, size, job.id),
                )
                if found.rowcount:
                    publish()
                return bool(found.rowcount)

        return self._urgent(work)

    async def fail(self, job: Job, status: int, detail: str) -> bool:
        """Mark a running job as failed, with what its client is told; False if it doesn't run any more."""
        error = json.dumps({"status": status, "detail": detail})
        query = (
            "UPDATE jobs SET status = 'failed', message = ?, error = ?, ended = ? "
            "WHERE id = ? AND status = 'running' RETURNING 1"
        )
        return bool(self._write(query, detail, error, time.time(), job.id))

    async def cancel(self, job: str) -> bool:
        """Cancel a queued or running job; False if it had ended before."""
        query = (
            "UPDATE jobs SET status = 'cancelled', message = 'cancelled', ended = ? "
            "WHERE id = ? AND status IN (?, ?) RETURNING 1"
        )
        return bool(self._write(query, time.time(), job, *WAITING))

    async def put_back(self, job: Job, *, begun: bool = False) -> None:
        """Queue a running job again; `begun` says whether this counts as an attempt."""
        self._write(
            "UPDATE jobs SET status = 'queued', progress = 0, message = 'waiting', attempts = attempts - ? "
            "WHERE id = ? AND status = 'running'",
            0 if begun else 1,
            job.id,
        )

    async def recover(self) -> list[str]:
        """Queue jobs again whose runner was killed, or give them up; returns the ids of both."""
        given_up = self._write(
            "UPDATE jobs SET status = 'failed', message = ?, error = ?, ended = ? "
            "WHERE status = 'running' AND attempts >= ? RETURNING id",
            GIVEN_UP["detail"], json.dumps(GIVEN_UP), time.time(), ATTEMPTS,
        )  # fmt: skip
        again = self._write(
            "UPDATE jobs SET status = 'queued', progress = 0, message = 'waiting' WHERE status = 'running' RETURNING id"
        )
        return [row[0] for row in [*given_up, *again]]

    async def remove(self, job: str) -> bool:
        """Remove a job that has ended, without a trace in the database's files; False if there is none."""
        removed = self._write("DELETE FROM jobs WHERE id = ? AND status NOT IN (?, ?) RETURNING 1", job, *WAITING)
        self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return bool(removed)

    async def expire(self, before: float) -> int:
        """Remove the jobs that ended before a Unix time [s]; returns their number."""
        return len(self._write("DELETE FROM jobs WHERE ended < ? RETURNING 1", before))

    async def sweep(self, shas: Iterable[str], remove: Callable[[str], None]) -> None:
        """Remove those of the files that nothing refers to, within a transaction."""

        def work() -> None:
            with self._transaction():
                for sha in shas:
                    used = "SELECT 1 WHERE EXISTS (SELECT 1 FROM inputs WHERE sha = ?1) OR EXISTS " \
                           "(SELECT 1 FROM jobs WHERE result = ?1)"  # fmt: skip
                    if self._one(used, sha) is None:
                        remove(sha)

        self._urgent(work)

    def _one(self, query: str, *values: Any) -> Any:
        return self._db.execute(query, values).fetchone()

    def _job(self, where: str, value: str) -> Job | None:
        row = self._one(f"SELECT {COLUMNS} FROM jobs {where}", value)
        return None if row is None else _job(row)

    def _write(self, query: str, *values: Any) -> list[Any]:
        return self._urgent(lambda: self._db.execute(query, values).fetchall())

    def _urgent(self, work: Callable[[], T]) -> T:
        """Return `work()`; on a full disk, try again after freeing some space."""
        try:
            with full_disk_errors():
                return work()
        except Full:
            if not self._make_room():
                raise
        with full_disk_errors():
            return work()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise


def _kinds(lane: str) -> tuple[tuple[str, ...], str]:
    return LANES[lane], ", ".join("?" * len(LANES[lane]))


def _opened(path: Path) -> sqlite3.Connection:
    """Connect; retries while another process creates the database."""
    until = time.monotonic() + _TIMEOUT
    while True:
        try:
            return _connected(path)
        except sqlite3.OperationalError as error:  # switching to WAL ignores the time-out
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:
                raise
            time.sleep(0.05)


def _connected(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, timeout=_TIMEOUT, isolation_level=None, check_same_thread=False)
    db.execute("PRAGMA journal_mode = WAL")
    db.execute("PRAGMA synchronous = NORMAL")
    db.execute("PRAGMA foreign_keys = ON")
    db.execute("PRAGMA secure_delete = ON")  # what is removed leaves no trace in free pages
    db.executescript(Path(__file__).with_name("schema.sql").read_text())
    if "owner" not in {row[1] for row in db.execute("PRAGMA table_info(jobs)")}:  # made before there were owners
        with contextlib.suppress(sqlite3.OperationalError):  # another process has just added it
            db.execute("ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT ''")
    return db


def _job(row: tuple) -> Job:
    job = dict(zip(Job.__dataclass_fields__, row, strict=True))
    job["settings"] = json.loads(job["settings"])
    job["error"] = job["error"] and json.loads(job["error"])
    return Job(**job)
