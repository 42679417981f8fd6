"""What the processes of a service share: the interface of `service.jobs.local` and `service.cluster.backend`."""

from typing import Protocol

from limits.aio.storage import Storage

from service.jobs.file_store import FileStore
from service.jobs.store import Store
from service.model_registry import ModelRegistry
from service.transport.streams import Streams


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
