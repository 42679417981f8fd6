"""Where jobs are handed in and asked after: what the routes use."""

import hashlib
import secrets
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from service.catalogue import Catalogue
from service.jobs.blobs import Blobs
from service.jobs.store import WAITING, Full, Job, Store, Taken, Waiting
from service.jobs.supervisor import Supervisor
from service.jobs.uploads import Received
from service.metrics import Metrics
from service.problems import Problem, busy
from service.settings import Settings


class Desk:
    """The jobs of one data folder.

    Args:
        settings: of the service.
        catalogue: gets the models.
        metrics: count the jobs.

    Attributes:
        store: what is known of them.
        blobs: their files.
    """

    def __init__(self, settings: Settings, catalogue: Catalogue, metrics: Metrics):
        self.settings, self.catalogue, self.metrics = settings, catalogue, metrics

    def open(self) -> None:
        """Begin: from an event loop."""
        self.catalogue.folder.mkdir(parents=True, exist_ok=True)
        self.blobs = Blobs(self.settings.data, self.settings.reserve)
        self.store = Store(self.settings.data / "jobs.sqlite", self.blobs.drop_ballast)
        self.supervisor = Supervisor(self.settings, self.store, self.blobs, self.catalogue, self.metrics)
        self.supervisor.start()

    async def close(self) -> None:
        """Stop: what runs waits again."""
        await self.supervisor.stop()
        self.store.close()

    def check_open(self) -> None:
        """Refuse before a body is read what would be refused afterwards.

        Raises:
            Problem: 503, too many jobs wait; 507, the disk is full.
        """
        if self.store.count("queued") >= self.settings.job_waiting:
            raise busy(f"{self.settings.job_waiting} jobs wait already", seconds=10)
        try:
            self.blobs.check_room()
        except Full:
            raise no_room() from None

    def add(
        self, kind: str, settings: dict[str, Any], files: Sequence[Received], *, media_type: str, filename: str,
        model: str | None = None, key: str | None = None,
    ) -> Job:  # fmt: skip
        """Queue a job, or find the one that an equal request with the same key has made.

        Args:
            kind: of `service.jobs.work.KINDS`.
            settings: for it.
            files: that it works on.
            media_type: of its result.
            filename: of its result.
            model: that it fits.
            key: the client's Idempotency-Key.

        Raises:
            Problem: 409, there is a model of that name, or a job makes it; 422, the key was used for something else;
                503, too many jobs wait; 507, the disk is full.
        """
        job = Job(secrets.token_urlsafe(16), kind, settings, model, media_type, filename, time.time())
        inputs = [(file.name, file.sha) for file in files]
        unique = None if key is None else hashlib.sha256(f"{kind}\n{key}".encode()).hexdigest()
        if unique and (same := self.store.same(unique)):
            if same.settings != settings or self.store.inputs(same.id) != inputs:
                raise Problem(422, "this Idempotency-Key was used for another request", field="Idempotency-Key")
            return same
        if model is not None and self.catalogue.path(model).exists():
            raise Problem(
                409, f"there is a model {model} already: remove it first, or choose another name", field="/name"
            )
        try:
            most = self.settings.job_waiting
            self.store.add(job, inputs, most=most, idempotency=unique, place=lambda: self._place(files))
        except Full:
            self.store.sweep([sha for _, sha in inputs], self.blobs.remove)
            raise no_room() from None
        except Waiting:
            raise busy(f"{self.settings.job_waiting} jobs wait already", seconds=10) from None
        except Taken:
            raise Problem(409, f"a job is fitting {model} already: wait, cancel it, or choose another name") from None
        self.supervisor.wake()
        return job

    def _place(self, files: Sequence[Received]) -> None:
        for file in files:
            self.blobs.place(file.file.path, file.sha)

    def get(self, job: str) -> Job:
        """The job with an id.

        Raises:
            Problem: 404, there is none.
        """
        found = self.store.get(job)
        if found is None:
            raise Problem(404, "there is no such job: GET /v1/jobs lists them")
        return found

    def result(self, job: Job) -> Path:
        """The file of a result.

        Raises:
            Problem: 409, the job isn't done.
        """
        if job.result is None:
            waits = job.status in WAITING
            headers = {"Retry-After": "1"} if waits else {}
            raise Problem(409, f"there is no result: the job is {job.status}", headers=headers)
        return self.blobs.path(job.result)

    def cancel(self, job: Job) -> None:
        """End a job that waits or runs; one that has ended stays as it is."""
        self.store.end(job.id, "cancelled", "cancelled")
        self.supervisor.wake()

    def remove(self, job: Job) -> None:
        """Forget a job that has ended, with the files that only it needed."""
        shas = {sha for _, sha in self.store.inputs(job.id)} | {job.result or ""} - {""}
        self.store.remove(job.id)
        self.store.sweep(shas, self.blobs.remove)

    def remove_model(self, name: str) -> None:
        """Remove a fitted model.

        Args:
            name: "fitted/<name>".

        Raises:
            Problem: 404, there is none.
        """
        try:
            self.catalogue.path(name).unlink()
        except FileNotFoundError:
            raise Problem(404, f"there is no model {name!r}: GET /v1/models lists them") from None
        self.store.forget(name)


def no_room() -> Problem:
    """507: the disk is full."""
    return Problem(507, "the service's disk is full: remove jobs or models, or ask whoever runs it")
