"""Motion without end over a WebSocket."""

import json
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any, Self

import numpy as np

from motionenv.client.connection import Connection
from motionenv.errors import ServiceError


class Stream:
    """Poses that come at the motion's pace; a context manager that hangs up.

    Args:
        connection: to the service.
        settings: to begin with.

    Attributes:
        fps: frames per second.
        height: of the body [m].

    Raises:
        ServiceError: refused, or no answer.
    """

    def __init__(self, connection: Connection, settings: Mapping[str, Any]):
        from websockets.exceptions import InvalidStatus, WebSocketException
        from websockets.sync.client import connect

        self._url, self._timeout = connection.url, connection.timeout
        self._waiting: deque[np.ndarray] = deque()
        self._stack = ExitStack()
        try:
            self._socket = self._stack.enter_context(connect(
                f"ws{self._url.removeprefix('http')}/v1/stream", additional_headers=connection.headers,
                open_timeout=self._timeout, close_timeout=1.0,
            ))  # fmt: skip
        except InvalidStatus as error:
            status = error.response.status_code
            raise ServiceError(f"no stream from {self._url}: it wants a key, or has too many streams", status) from None
        except (OSError, WebSocketException) as error:
            raise ServiceError(f"no stream from {self._url} ({error}): start it with `motionenv serve`") from None
        try:
            self.change(**settings)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[np.ndarray]:
        return self

    def __next__(self) -> np.ndarray:
        while not self._waiting:
            self._receive()
        return self._waiting.popleft()

    def change(self, **settings: Any) -> None:
        """Go on with other settings, joined smoothly; poses that are under way come first.

        Args:
            settings: those that change: model, seed, fps, deviations, speed [m/s], height [m], variation; of a tree
                temperature, activity, heading [degrees]; paused, in which time no poses come.

        Raises:
            ServiceError: they are wrong, and the motion goes on as it was; or the connection broke.
        """
        self._say(json.dumps(settings))
        while (told := self._receive()) is None:
            pass
        self.fps, self.height = told["fps"], told["height"]

    def close(self) -> None:
        """Hang up."""
        self._stack.close()

    def _say(self, text: str) -> None:
        """Send a message."""
        from websockets.exceptions import ConnectionClosed

        try:
            self._socket.send(text)
        except ConnectionClosed as error:
            raise ServiceError(f"the stream from {self._url} broke: {error}") from None

    def _receive(self) -> dict[str, Any] | None:
        """Keep the next message's pose, or give its settings.

        Raises:
            ServiceError: the message is a problem, or none came.
        """
        from websockets.exceptions import ConnectionClosed

        try:
            message = self._socket.recv(timeout=self._timeout)
        except TimeoutError:
            raise ServiceError(f"the stream from {self._url} was silent for {self._timeout:g} s") from None
        except ConnectionClosed as error:
            raise ServiceError(f"the stream from {self._url} broke: {error}") from None
        if isinstance(message, bytes):
            self._waiting.append(np.frombuffer(message, "<f4").astype(np.float64))
            return None
        told = json.loads(message)
        if told["type"] == "problem":
            raise ServiceError(told["detail"], errors=told["errors"])
        return told
