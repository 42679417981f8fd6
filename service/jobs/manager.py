"""The interface between routes and jobs."""

import asyncio
import base64
import hashlib
import math
import secrets
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from service.errors import Problem, busy
from service.jobs.backend import Backend
from service.jobs.file_store import FileStore
from service.jobs.store import WAITING, Full, Job, Repeated, SqliteStore, Taken, Waiting, lane_of
from service.jobs.uploads import Received
from service.settings import Settings
from service.transport.access import Access


class JobManager:
    """The jobs of a service: their records are in the backend's `store`, their files in its `file_store`."""

    def __init__(self, settings: Settings, backend: Backend) -> None:
        self.settings, self.backend, self.model_registry = settings, backend, backend.models

    @property
    def store(self) -> SqliteStore:
        """Records of the jobs."""
        return self.backend.store

    @property
    def file_store(self) -> FileStore:
        """The files of the jobs."""
        return self.backend.file_store

    async def check_open(self, kind: str) -> None:
        """Refuse jobs of a kind before their body is read, if they would be refused afterwards.

        Raises:
            Problem: 503, too many jobs are queued.
            Full: the disk is full.
        """
        if await self.store.queued(lane_of(kind)) >= self.settings.job_waiting:
            raise await self._full_queue(kind)
        self.file_store.check_room()

    async def add(
        self, kind: str, settings: dict[str, Any], files: Sequence[Received], access: Access, *, media_type: str,
        filename: str, model: str | None = None, key: str | None = None,
    ) -> Job:  # fmt: skip
        """Queue a job, or find the one of an equal request with the same `key`, the client's Idempotency-Key.

        Media type and filename are those of its result, `model` is the name of the model that it makes.

        Raises:
            Problem: 409, the model exists or is being made; 422, the key was used for another request; 503, too many
                jobs are queued.
            Full: the disk is full.
        """
        job = Job(
            secrets.token_urlsafe(16), kind, settings, model, media_type, filename, time.time(), owner=access.owner
        )
        inputs = [(file.name, file.sha) for file in files]
        unique = None if key is None else hashlib.sha256(f"{access.owner}\n{kind}\n{key}".encode()).hexdigest()
        if unique and (same := await self._repeated(unique, settings, inputs)):
            return same
        if model is not None:
            await self._check_model(model, access, settings["replace"])
        try:
            most = self.settings.job_waiting
            await self.store.add(job, inputs, most=most, idempotency=unique, place=lambda: self._place(files))
        except Full:
            await self.store.sweep([sha for _, sha in inputs], self.file_store.remove)
            raise
        except Repeated:
            same = await self._repeated(unique or "", settings, inputs)
            if same is None:
                raise busy("a request with the same Idempotency-Key has just been removed") from None
            return same
        except Waiting:
            raise await self._full_queue(kind) from None
        except Taken:
            raise Problem(409, f"a job is making {model} already: wait, cancel it, or choose another name") from None
        self.backend.wake()
        return job

    async def _repeated(self, unique: str, settings: dict[str, Any], inputs: list[tuple[str, str]]) -> Job | None:
        """The job of an equal request before; 422 if that was another request."""
        same = await self.store.same(unique)
        if same and (same.settings != settings or await self.store.inputs(same.id) != inputs):
            raise Problem(422, "this Idempotency-Key was used for another request", field="Idempotency-Key")
        return same

    async def _full_queue(self, kind: str) -> Problem:
        """503, until one more job has usually been done."""
        lane, settings = lane_of(kind), self.settings
        processes = settings.quick_processes if lane == "quick" else settings.job_processes
        wait = math.ceil(await self.store.usual(lane) / processes)
        return busy(f"{settings.job_waiting} jobs are queued already", max(1, wait))

    async def _check_model(self, name: str, access: Access, replace: bool) -> None:
        path = self.model_registry.find_path(name)
        if path is None:
            return
        if not access.to(self.model_registry.owner_of(path)):
            raise Problem(409, f"the name {name} is taken: choose another", field="/name")
        if not replace:
            told = f"model {name} exists already: set replace, remove it first, or choose another name"
            raise Problem(409, told, field="/name")

    def _place(self, files: Sequence[Received]) -> None:
        for file in files:
            self.file_store.place(file.file.path, file.sha)

    async def get(self, job: str, access: Access) -> Job:
        """The job with an id; 404 if there is none."""
        found = await self.store.get(job)
        if found is None or not access.to(found.owner):
            raise Problem(404, "this job and its result were forgotten, or never were: GET /v1/jobs lists others")
        return found

    async def page(
        self, access: Access, most: int, status: str | None, cursor: str | None
    ) -> tuple[list[Job], str | None]:
        """At most `most` jobs, newest first, and the cursor of the next ones; 400 if `cursor` isn't one.

        A cursor is the number of a job, which keeps its place when the job is removed.
        """
        before = None if cursor is None else await self._number(cursor)
        found = await self.store.page(most + 1, status, before, None if access.everything else access.owner)
        return found[:most], _cursor(found[most - 1].number) if len(found) > most else None

    async def _number(self, cursor: str) -> int:
        try:
            number = int.from_bytes(base64.b64decode(cursor, altchars=b"-_", validate=True))
        except ValueError:
            number = 0
        if not (1 <= number <= await self.store.last() and _cursor(number) == cursor):
            raise Problem(400, "before must be the `next` of an earlier page", field="before")
        return number

    async def result(self, job: Job) -> Path:
        """The file of a result; 409 if the job isn't done, 404 if it was removed meanwhile."""
        if job.result is None:
            headers = {"Retry-After": "1"} if job.status in WAITING else {}
            raise Problem(409, f"the job is {job.status} and has no result", headers=headers)
        try:
            return await asyncio.to_thread(self.file_store.fetch, job.result)
        except FileNotFoundError:
            raise Problem(404, "the job was removed") from None

    async def cancel(self, job: Job) -> None:
        """Cancel a queued or running job; does nothing to others."""
        await self.store.cancel(job.id)
        self.backend.wake()

    async def remove(self, job: Job) -> None:
        """Remove a job that has ended, with files that no other job uses and an unlisted model."""
        shas = {sha for _, sha in await self.store.inputs(job.id)} | {job.result or ""} - {""}
        await self.store.remove(job.id)
        await self.store.sweep(shas, self.file_store.remove)
        self.model_registry.remove_unlisted(await self.store.models())

    async def remove_model(self, name: str, access: Access) -> None:
        """Remove the fitted model "fitted/<name>"; 404 if there is none."""
        path = await asyncio.to_thread(self.model_registry.find_path, name)
        if path is None or not access.to(self.model_registry.owner_of(path)):
            raise self.model_registry.missing(name, access)
        path.unlink(missing_ok=True)


def _cursor(number: int) -> str:
    return base64.urlsafe_b64encode(number.to_bytes(6)).decode()
