"""State shared by the server processes of several machines."""

import asyncio
import contextlib

import structlog

from service.cluster.counts import BEAT, SharedCounts, SharedStreams
from service.cluster.database import Database
from service.cluster.models import SharedModels
from service.cluster.objects import SharedFiles
from service.cluster.postgres import PostgresStore
from service.jobs.backend import Backend
from service.jobs.store import Unreachable
from service.settings import JobSettings, Settings

_log = structlog.get_logger("motionenv.service")
_CONNECTIONS = 16  # of a server process
_REFRESH = 1.0  # [s] after which models that others have replaced or removed are known here
_TRIM = 60.0  # [s]


def shared_files(settings: JobSettings) -> SharedFiles:
    """The files that the settings name."""
    return SharedFiles(settings.store, settings.data, settings.reserve, settings.cache)


class Cluster(Backend):
    """Jobs, models and counts in PostgreSQL, files in an object store; the jobs run in other processes."""

    def __init__(self, settings: Settings) -> None:
        url = settings.database.get_secret_value()
        self.database = Database(url, _CONNECTIONS)
        self.file_store = shared_files(settings)
        self.store = PostgresStore(self.database, settings.lease)
        self.models = SharedModels(settings.data / "models", url, self.file_store)
        self.counts = SharedCounts(self.database)
        self.streams = SharedStreams(self.database, settings.streams)

    async def open(self) -> None:
        self.models.folder.mkdir(parents=True, exist_ok=True)
        await self.database.open()
        await asyncio.to_thread(self.models.refresh)
        self._upkeep = asyncio.gather(
            _every(_REFRESH, lambda: asyncio.to_thread(self.models.refresh)),
            _every(BEAT, self.streams.beat),
            _every(_TRIM, lambda: asyncio.to_thread(self.file_store.trim)),
            _every(_TRIM, lambda: asyncio.to_thread(self.file_store.sweep_incoming)),
        )

    def wake(self) -> None:
        """The database wakes the workers."""

    async def close(self) -> None:
        self._upkeep.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._upkeep
        with contextlib.suppress(Unreachable):
            await self.streams.leave()
        self.models.close()
        await self.database.close()


async def _every(seconds: float, work) -> None:
    while True:
        try:
            await work()
        except Unreachable:
            _log.warning("database or store can't be reached")
        except Exception:  # noqa: BLE001 upkeep must survive any error
            _log.exception("upkeep failed")
        await asyncio.sleep(seconds)
