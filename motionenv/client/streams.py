"""Endless motion over a WebSocket."""

import json
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any, Self

import numpy as np

from motionenv.client.connection import Connection
from motionenv.errors import ServiceError


class Stream:
    """Poses (25) [m, rad] in real time; a context manager that closes the connection.

    Args:
        connection: to the service.
        settings: the initial ones; see `change`.

    Attributes:
        fps: frames per second.
        height: of the body [m].

    Raises:
        ServiceError: refused, or no response.
    """

    def __init__(self, connection: Connection, settings: Mapping[str, Any]) -> None:
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
            raise _refusal(self._url, error.response) from None
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
        """Change settings, blended smoothly; poses that are already on their way come first.

        Args:
            settings: those that change: model, seed, fps, deviations, speed [m/s], height [m], variation; of a tree
                temperature, activity, heading [degrees]; paused.

        Raises:
            ServiceError: invalid settings, and the motion continues unchanged; or the connection broke.
        """
        self._send(json.dumps(settings))
        while (data := self._receive()) is None:
            pass
        self.fps, self.height = data["fps"], data["height"]

    def close(self) -> None:
        """Close the connection."""
        self._stack.close()

    def _send(self, text: str) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            self._socket.send(text)
        except ConnectionClosed as error:
            raise ServiceError(f"the stream from {self._url} broke: {error}") from None

    def _receive(self) -> dict[str, Any] | None:
        """Receive a message: keep its pose, or return its settings."""
        from websockets.exceptions import ConnectionClosed

        try:
            message = self._socket.recv(timeout=self._timeout)
        except TimeoutError:
            raise ServiceError(f"the stream from {self._url} sent nothing for {self._timeout:g} s") from None
        except ConnectionClosed as error:
            raise ServiceError(f"the stream from {self._url} broke: {error}") from None
        if isinstance(message, bytes):
            self._waiting.append(np.frombuffer(message, "<f4").astype(np.float64))
            return None
        data = json.loads(message)
        if data["type"] == "problem":
            raise ServiceError(data["detail"], errors=data["errors"])
        return data


def _refusal(url: str, response: Any) -> ServiceError:
    """The error in the response to a handshake."""
    try:
        why = json.loads(response.body)["detail"]
    except (ValueError, TypeError, KeyError):
        why = "it needs a key, or has too many streams"
    wait = response.headers.get("Retry-After")
    retry_after = float(wait) if wait and wait.isdigit() else None
    return ServiceError(f"no stream from {url}: {why}", response.status_code, retry_after=retry_after)
