"""Answers that are made in threads, part by part, until they are whole or nobody waits for them any more."""

import asyncio
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import aclosing

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from service.admission import Place, Workshop

#: Makes the parts of an answer; may look at the event, which says that the client has gone, where a part takes long.
Making = Callable[[threading.Event], Iterator[bytes]]
_PATIENCE = 0.5  # [s] that a client may take to read what has been sent, before others get its thread


class Made(Response):
    """A response whose body is made in a thread of a workshop while the client is there.

    Args:
        workshop: whose thread.
        making: makes the parts; what it raises before the first of them becomes a problem.
        media_type: of the body.
        headers: more headers.
        whole: whether to send the body at once, with its length, or each part when it is made.
    """

    def __init__(self, workshop: Workshop, making: Making, media_type: str, headers: dict[str, str], *, whole: bool):
        self.workshop, self.making, self.whole = workshop, making, whole
        self.status_code, self.media_type, self.background = 200, media_type, None
        self.given = headers  # and no `body`, of which Starlette would take the length

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Make and send the body.

        Raises:
            Problem: 503, too much is being made; or what `making` raised.
        """
        gone = threading.Event()
        watching = asyncio.create_task(_watch(receive, gone))
        try:
            async with self.workshop.place() as place:
                if gone.is_set():
                    return
                async with aclosing(self.workshop.stream(self.making(gone))) as parts:
                    if self.whole:
                        await self._send_whole(parts, scope, receive, send, gone)
                    else:
                        await self._send_parts(parts, place, send, gone)
        finally:
            gone.set()
            watching.cancel()

    async def _send_whole(
        self, parts: AsyncIterator[bytes], scope: Scope, receive: Receive, send: Send, gone: threading.Event
    ) -> None:
        """Send all parts as one body."""
        body = []
        async for part in parts:
            if gone.is_set():
                return
            body.append(part)
        await Response(b"".join(body), headers=self.given, media_type=self.media_type)(scope, receive, send)

    async def _send_parts(self, parts: AsyncIterator[bytes], place: Place, send: Send, gone: threading.Event) -> None:
        """Send each part when it is made."""
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
            await _read(send({"type": "http.response.body", "body": part, "more_body": True}), place)
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _read(sending: Awaitable[None], place: Place) -> None:
    """Wait until there is room for more; while a client reads slowly, others have its thread."""
    task = asyncio.ensure_future(sending)
    try:
        await asyncio.wait({task}, timeout=_PATIENCE)
        if task.done():
            return task.result()
        place.leave()
        await task
        await place.take()
    finally:
        task.cancel()


async def _watch(receive: Receive, gone: threading.Event) -> None:
    """Set `gone` when the client has."""
    while (await receive())["type"] != "http.disconnect":
        pass
    gone.set()
