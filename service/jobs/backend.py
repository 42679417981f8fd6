"""State shared by the processes of a service: the interface, and a folder on one machine.

`service.cluster.backend` is for several machines.
"""

from typing import Protocol

from limits.aio.storage import MemoryStorage, Storage

from service.jobs.file_store import FileStore
from service.jobs.sqlite import SqliteStore
from service.jobs.store import Store
from service.jobs.supervisor import Supervisor
from service.model_registry import ModelRegistry
from service.settings import Settings


class Streams(Protocol):
    """Counts open streams."""

    async def take(self) -> bool:
        """Count one more, unless as many as are allowed are open; returns whether it was."""

    async def release(self) -> None:
        """Count one less."""


class Backend(Protocol):
    """Jobs, files, models, and counts of requests and streams.

    `store` and `file_store` are there while it is open.
    """

    store: Store
    file_store: FileStore
    models: ModelRegistry
    counts: Storage
    streams: Streams

    async def open(self) -> None:
        """Start, in an event loop."""

    def wake(self) -> None:
        """Look for changed jobs at once."""

    async def close(self) -> None:
        """Stop."""


class LocalStreams(Streams):
    """Counts those of this process, at most `most`."""

    def __init__(self, most: int) -> None:
        self.most, self.open = most, 0

    async def take(self) -> bool:
        if self.open >= self.most:
            return False
        self.open += 1
        return True

    async def release(self) -> None:
        self.open -= 1


class Local(Backend):
    """Jobs in SQLite, files and models in the data folder, requests and streams counted for each process."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.models = ModelRegistry(settings.data / "models")
        self.counts = MemoryStorage()
        self.streams = LocalStreams(settings.streams)

    async def open(self) -> None:
        self.models.folder.mkdir(parents=True, exist_ok=True)
        self.file_store = FileStore(self.settings.data, self.settings.reserve)
        self.store = SqliteStore(self.settings.data / "jobs.sqlite", self.file_store.drop_ballast)
        self._supervisor = Supervisor(self.settings, self.store, self.file_store, self.models)
        self._supervisor.start()

    def wake(self) -> None:
        self._supervisor.wake()

    async def close(self) -> None:
        await self._supervisor.stop()
        self.store.close()
