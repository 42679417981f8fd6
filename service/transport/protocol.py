"""uvicorn's HTTP protocol with limits for slow clients.

A header must arrive within 10 s and stay below 128 kB (otherwise 408 or 431), a body must arrive at a minimum rate, and
responses must be read. In plain uvicorn an endless header takes unlimited memory, connections that send a byte now and
then stay open forever, and unread responses stay in memory.
"""

from asyncio import TimerHandle
from typing import Any, Literal

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

_HEADER_BYTES = 128_000
_HEADER_SECONDS = 10.0
_GRACE = 10.0  # [s] over which the rate of a body is measured
_BODY_RATE = 1_000  # [bytes/s]
_READING_SECONDS = 60.0  # without progress until a client that doesn't read is disconnected
_LINGER = 1.0  # [s] in which input is discarded: closing with unread bytes would lose the response


class GuardedHttpProtocol(HttpToolsProtocol):
    """HTTP/1.1 with time-outs for slow clients; messages that arrive in one piece cost nothing."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._awaiting: Literal["header", "body"] | None = "header"
        self._header, self._body = 0, 0  # bytes that have come
        self._watch: TimerHandle | None = None
        self._refused = False
        self._reading: TimerHandle | None = None
        self._unread, self._went_on = 0, False

    def connection_made(self, transport: Any) -> None:
        """Start the timer for the first header."""
        super().connection_made(transport)
        self._keep_watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timers."""
        self._await(None)
        if self._reading is not None:
            self._reading.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Count the bytes of a header, including blank lines before it."""
        if self._refused:
            return
        if self._awaiting is None and (self.cycle is None or self.cycle.response_complete):
            self._await("header")
        self._header += len(data)
        super().data_received(data)
        if self._awaiting == "header" and self._header > _HEADER_BYTES:
            self._refuse(b"431 Request Header Fields Too Large")
        elif self._watch is None:
            self._keep_watch()

    def on_message_begin(self) -> None:
        """Start of a request."""
        super().on_message_begin()
        if self._awaiting != "header":
            self._await("header")

    def on_headers_complete(self) -> None:
        """End of a header."""
        self._await("body")
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Part of a body."""
        self._body += len(body)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """End of a request."""
        self._await(None)
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """End of a response: watch that it is read."""
        super().on_response_complete()
        self._watch_reading()
        self._went_on = True

    def pause_writing(self) -> None:
        """The write buffer is full."""
        super().pause_writing()
        self._watch_reading()

    def resume_writing(self) -> None:
        """The write buffer has room again."""
        super().resume_writing()
        self._went_on = True

    def shutdown(self) -> None:
        """Shutdown: long polls look for `closing` in their scope."""
        if self.cycle is not None:
            self.cycle.scope["closing"] = True  # type: ignore[typeddict-unknown-key]
        super().shutdown()

    def _await(self, what: Literal["header", "body"] | None) -> None:
        self._awaiting, self._header, self._body = what, 0, 0
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def _keep_watch(self) -> None:
        if self._awaiting == "header":
            self._watch = self.loop.call_later(_HEADER_SECONDS, self._refuse, b"408 Request Timeout")
        elif self._awaiting == "body":
            self._watch = self.loop.call_later(_GRACE, self._look_at_body)

    def _look_at_body(self) -> None:
        if self.cycle is not None and self.cycle.response_complete:  # nothing needs the rest
            self.transport.close()
            return
        if self._body < _BODY_RATE * _GRACE and not self.flow.read_paused:
            self._refuse(b"408 Request Timeout")
            return
        self._body = 0
        self._watch = self.loop.call_later(_GRACE, self._look_at_body)

    def _watch_reading(self) -> None:
        if self._reading is None:
            self._unread, self._went_on = self.transport.get_write_buffer_size(), False
            self._reading = self.loop.call_later(_READING_SECONDS, self._look_at_reading)

    def _look_at_reading(self) -> None:
        self._reading = None
        left = self.transport.get_write_buffer_size()
        if left and not self._went_on and left >= self._unread:
            self.transport.abort()
        elif left:
            self._watch_reading()

    def _refuse(self, status: bytes) -> None:
        """Send an error status and close the connection."""
        in_header = self._awaiting == "header"
        self._await(None)
        if self.transport.is_closing():
            return
        if in_header or self.cycle is None or not self.cycle.response_started:
            self.transport.write(b"HTTP/1.1 " + status + b"\r\nconnection: close\r\ncontent-length: 0\r\n\r\n")
        self._refused = True
        self._watch = self.loop.call_later(_LINGER, self.transport.close)
