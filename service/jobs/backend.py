"""State shared by the processes of a service: a folder of jobs, files and models, and counts of requests."""

from limits.aio.storage import MemoryStorage

from service.jobs.file_store import FileStore
from service.jobs.store import SqliteStore
from service.jobs.supervisor import Supervisor
from service.model_registry import ModelRegistry
from service.settings import Settings


class Backend:
    """Jobs in SQLite, files and models in the data folder, requests counted for each process.

    `store` and `file_store` are there while it is open.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.models = ModelRegistry(settings.data / "models")
        self.counts = MemoryStorage()

    async def open(self) -> None:
        """Start, in an event loop."""
        self.models.folder.mkdir(parents=True, exist_ok=True)
        self.file_store = FileStore(self.settings.data, self.settings.reserve)
        self.store = SqliteStore(self.settings.data / "jobs.sqlite", self.file_store.drop_ballast)
        self._supervisor = Supervisor(self.settings, self.store, self.file_store, self.models)
        self._supervisor.start()

    def wake(self) -> None:
        """Look for changed jobs at once."""
        self._supervisor.wake()

    async def close(self) -> None:
        """Stop."""
        await self._supervisor.stop()
        self.store.close()
