"""How many streams are open."""

from typing import Protocol


class Streams(Protocol):
    """Counts open streams."""

    async def take(self) -> bool:
        """Count one more, unless as many as are allowed are open; returns whether it was."""

    async def release(self) -> None:
        """Count one less."""


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
