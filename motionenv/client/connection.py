"""Requests that are sent again where that is safe, and problems that become errors."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

import httpx

from motionenv.errors import MotionError, ServiceError
from motionenv.files import atomic_write

_CONNECT = 5.0  # [s]
_AGAIN = (429, 503)  # nothing has been done yet
_SHORTEST = 0.1  # [s] between two attempts


class Connection:
    """A service's address, and the key to it.

    Args:
        url: of the service, without a path of its API.
        key: None takes that of the environment variable MOTIONENV_KEY, if it is set.
        timeout: seconds that the service may be silent.
        patience: seconds, for each request, in which to ask again what gets 429 or 503, as Retry-After says; 0: never.
        retries: how often to try to connect again.

    Raises:
        MotionError: no address of HTTP.
    """

    def __init__(self, url: str, key: str | None, timeout: float, patience: float, retries: int):
        if not url.startswith(("http://", "https://")):
            raise MotionError(f"url must begin with http:// or https://, got {url!r}")
        key = os.environ.get("MOTIONENV_KEY") if key is None else key
        self.url, self.patience, self.timeout = url.rstrip("/"), patience, timeout
        self.headers = {"Authorization": f"Bearer {key}"} if key else {}
        self._http = httpx.Client(
            base_url=self.url, headers=self.headers, timeout=httpx.Timeout(timeout, connect=_CONNECT),
            transport=httpx.HTTPTransport(retries=retries),
        )  # fmt: skip

    def ask(self, method: str, path: str, **request: Any) -> httpx.Response:
        """An answer, whole.

        Args:
            method: of HTTP.
            path: of the API.
            request: see `httpx.Client.build_request`.

        Raises:
            ServiceError: a problem, or no answer.
        """
        with self.opened(method, path, **request) as response:
            response.read()
        return response

    def save(self, out: Any, method: str, path: str, **request: Any) -> None:
        """Write an answer to a file, whole or not at all, while it comes.

        Args:
            out: path of the file.
            method: of HTTP.
            path: of the API.
            request: see `httpx.Client.build_request`.

        Raises:
            ServiceError: a problem, or no whole answer.
            MotionError: the file can't be written.
        """
        with atomic_write(out) as temporary, open(temporary, "wb") as file:
            with self.opened(method, path, **request) as response:
                for chunk in response.iter_bytes():
                    file.write(chunk)

    @contextmanager
    def opened(self, method: str, path: str, **request: Any) -> Iterator[httpx.Response]:
        """An answer whose body hasn't been read.

        Args:
            method: of HTTP.
            path: of the API.
            request: see `httpx.Client.build_request`.

        Raises:
            ServiceError: a problem, or no answer.
        """
        try:
            response = self._patiently(method, path, request)
            try:
                yield response
            finally:
                response.close()
        except httpx.ConnectError as error:
            raise ServiceError(f"nothing answers at {self.url} ({error}): start it with `motionenv serve`") from None
        except httpx.TimeoutException:
            raise ServiceError(f"{self.url} was silent for {self.timeout:g} s: ask for less, or wait longer") from None
        except httpx.TransportError as error:
            raise ServiceError(f"the connection to {self.url} broke: {error}") from None

    def close(self) -> None:
        """Hang up."""
        self._http.close()

    def _patiently(self, method: str, path: str, request: dict[str, Any]) -> httpx.Response:
        """The answer that is no request to wait any more, or none that can be granted."""
        until = time.monotonic() + self.patience
        while True:
            response = self._http.send(self._http.build_request(method, path, **request), stream=True)
            if not response.is_error:
                return response
            try:
                response.read()
                problem = as_error(response)
            finally:
                response.close()
            wait = max(_SHORTEST, problem.retry_after or 0.0)
            if problem.status not in _AGAIN or problem.retry_after is None or time.monotonic() + wait > until:
                raise problem
            time.sleep(wait)


def as_error(response: httpx.Response) -> ServiceError:
    """A problem as an error.

    Args:
        response: a refusal that has been read.
    """
    try:
        told = response.json()
        detail, errors = str(told["detail"]), told.get("errors") or ()
    except (ValueError, TypeError, KeyError, AttributeError):  # a proxy's own page, or another service
        detail, errors = f"{response.status_code} {response.reason_phrase} from {response.url}", ()
    return ServiceError(
        detail, response.status_code, errors, response.headers.get("x-request-id"),
        _seconds(response.headers.get("retry-after")),
    )  # fmt: skip


def _seconds(retry_after: str | None) -> float | None:
    """Seconds that a Retry-After says, which may be a date (RFC 9110, section 10.2.3)."""
    if retry_after is None:
        return None
    if retry_after.isdigit():
        return float(retry_after)
    try:
        return max(0.0, (parsedate_to_datetime(retry_after) - datetime.now(UTC)).total_seconds())
    except (ValueError, TypeError):
        return None
