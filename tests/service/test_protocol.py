"""What the protocol does to clients that don't read, on a real port."""

import asyncio
import socket

import pytest
import uvicorn

from service import protocol


@pytest.mark.parametrize("parts", [1, 40])
def test_an_answer_that_nobody_reads_is_given_up(monkeypatch, parts):
    monkeypatch.setattr(protocol, "_READING_SECONDS", 0.5)
    assert asyncio.run(_left(parts, read=0))


def test_an_answer_that_is_read_slowly_is_not(monkeypatch):
    monkeypatch.setattr(protocol, "_READING_SECONDS", 0.5)
    assert not asyncio.run(_left(40, read=1_000_000))


async def _left(parts: int, read: int) -> bool:
    """Whether a server hangs up within two seconds on somebody who takes `read` bytes every 0.2 s of 20 MB."""
    left = asyncio.Event()

    async def app(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(parts):
            await send({"type": "http.response.body", "body": bytes(20_000_000 // parts), "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    class Watched(protocol.Guarded):
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
        for _ in range(10):
            await asyncio.sleep(0.2)
            if read:
                await asyncio.get_running_loop().sock_recv(client, read)
        gone = left.is_set()
    server.should_exit = True
    await serving
    return gone
