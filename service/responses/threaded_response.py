"""Responses whose body is produced in a worker thread, until it is complete or the client disconnects."""

import asyncio
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import aclosing

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from service.transport.worker_pool import Slot, WorkerPool

#: Produces the chunks of a body; the event is set when the client has disconnected, for chunks that take long.
Producer = Callable[[threading.Event], Iterator[bytes]]
_SLOW = 0.5  # [s] that a client may take to read what was sent before its thread is lent to others


class ThreadedResponse(Response):
    """A response whose body is produced in a worker thread while the client is connected.

    What `produce` raises before its first chunk becomes an error response. With `whole`, the body is sent at once, with
    its length, as the response that `respond` makes of it, otherwise each chunk when it is ready.
    """

    def __init__(
        self, worker_pool: WorkerPool, produce: Producer, media_type: str, headers: dict[str, str], *, whole: bool,
        respond: Callable[[bytes], Response] | None = None,
    ) -> None:  # fmt: skip
        self.worker_pool, self.produce, self.whole = worker_pool, produce, whole
        self.status_code, self.media_type, self.background = 200, media_type, None
        self.respond = respond or (lambda body: Response(body, headers=headers, media_type=media_type))
        self.given = headers  # without `body`: Starlette would add its length

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Produce and send the body; 503 if the service is overloaded."""
        gone = threading.Event()
        watching = asyncio.create_task(_watch(receive, gone))
        try:
            async with self.worker_pool.slot() as slot:
                if gone.is_set():
                    return
                async with aclosing(self.worker_pool.stream(self.produce(gone))) as parts:
                    if self.whole:
                        await self._send_whole(parts, scope, receive, send, gone)
                    else:
                        await self._send_parts(parts, slot, send, gone)
        finally:
            gone.set()
            watching.cancel()

    async def _send_whole(
        self, parts: AsyncIterator[bytes], scope: Scope, receive: Receive, send: Send, gone: threading.Event
    ) -> None:
        body = []
        async for part in parts:
            if gone.is_set():
                return
            body.append(part)
        await self.respond(b"".join(body))(scope, receive, send)

    async def _send_parts(self, parts: AsyncIterator[bytes], slot: Slot, send: Send, gone: threading.Event) -> None:
        started = False
        async for part in parts:
            if gone.is_set():
                return
            if not part:
                continue
            if not started:
                self.init_headers(self.given)
                await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
                started = True
            await _sent(send({"type": "http.response.body", "body": part, "more_body": True}), slot)
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _sent(sending: Awaitable[None], slot: Slot) -> None:
    """Wait until the chunk is sent; while a client reads slowly, lend its thread to others."""
    task = asyncio.ensure_future(sending)
    try:
        await asyncio.wait({task}, timeout=_SLOW)
        if task.done():
            return task.result()
        slot.release()
        await task
        await slot.acquire()
    finally:
        task.cancel()


async def _watch(receive: Receive, gone: threading.Event) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
    gone.set()
