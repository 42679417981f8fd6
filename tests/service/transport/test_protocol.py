"""What the protocol does to clients that don't read, on a real port."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
import uvicorn

from service.transport import protocol

_SIZE = 12_000_000  # bytes: more than sockets hold


@pytest.mark.parametrize("parts", [1, 40])
def test_an_answer_that_nobody_reads_is_given_up(monkeypatch, parts):
    monkeypatch.setattr(protocol, "_READING_SECONDS", 0.5)

    async def look() -> None:
        async with _answering(parts) as (_, left):
            await asyncio.wait_for(left.wait(), 20)

    asyncio.run(look())


def test_an_answer_that_is_read_slowly_is_sent_whole(monkeypatch):
    """In three times the time after which who reads nothing is left."""
    monkeypatch.setattr(protocol, "_READING_SECONDS", 1.0)

    async def look() -> int:
        got = 0
        async with _answering(40) as (client, left):
            while got < _SIZE and not left.is_set():
                got += len(await asyncio.get_running_loop().sock_recv(client, 400_000))
                await asyncio.sleep(0.1)
        return got

    assert asyncio.run(look()) >= _SIZE


@asynccontextmanager
async def _answering(parts: int) -> AsyncIterator[tuple[socket.socket, asyncio.Event]]:
    """A client whom a server answers with so many parts, and whether the server has hung up."""
    left = asyncio.Event()

    async def app(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(parts):
            await send({"type": "http.response.body", "body": bytes(_SIZE // parts), "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    class Watched(protocol.GuardedHttpProtocol):
        def connection_lost(self, exc):
            left.set()
            super().connection_lost(exc)

    server = uvicorn.Server(uvicorn.Config(app, port=0, http=Watched, lifespan="off", log_level="warning"))
    serving = asyncio.create_task(server.serve())
    while not server.started:
        await asyncio.sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.setblocking(False)
        client.sendall(b"GET / HTTP/1.1\r\nhost: localhost\r\n\r\n")
        yield client, left
    server.should_exit = True
    await serving
