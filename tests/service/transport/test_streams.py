"""Open streams are counted."""

import asyncio

from service.jobs.backend import Streams


def test_no_more_than_are_allowed_are_open():
    async def counted() -> list[bool]:
        streams = Streams(2)
        taken = [await streams.take() for _ in range(3)]
        await streams.release()
        return [*taken, await streams.take(), await streams.take()]

    assert asyncio.run(counted()) == [True, True, False, True, False]
