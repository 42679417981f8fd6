"""Answers that are made in threads, part by part, until they are whole or nobody waits for them any more."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import aclosing

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from service.admission import Workshop

#: Makes the parts of an answer; may look at the event, which says that the client has gone, where a part takes long.
Making = Callable[[threading.Event], Iterator[bytes]]
_PATIENCE = 20.0  # [s] that a client may take to read what waits for it, so that slow ones hold no threads


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
            async with self.workshop.place():
                if gone.is_set():
                    return
                async with aclosing(self.workshop.stream(self.making(gone))) as parts:
                    await (self._send_whole if self.whole else self._send_parts)(parts, scope, receive, send, gone)
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

    async def _send_parts(
        self, parts: AsyncIterator[bytes], scope: Scope, receive: Receive, send: Send, gone: threading.Event
    ) -> None:
        """Send each part when it is made; a client that doesn't read is left."""
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
            try:
                async with asyncio.timeout(_PATIENCE):
                    await send({"type": "http.response.body", "body": part, "more_body": True})
            except TimeoutError:
                return
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _watch(receive: Receive, gone: threading.Event) -> None:
    """Set `gone` when the client has."""
    while (await receive())["type"] != "http.disconnect":
        pass
    gone.set()
