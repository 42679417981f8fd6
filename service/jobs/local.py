"""What server processes of one machine share: a folder, with a database of jobs in it."""

from limits.aio.storage import MemoryStorage

from service.jobs.backend import Backend
from service.jobs.file_store import FileStore
from service.jobs.sqlite import SqliteStore
from service.jobs.supervisor import Supervisor
from service.model_registry import ModelRegistry
from service.settings import Settings
from service.transport.streams import LocalStreams


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
