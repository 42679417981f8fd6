"""Requests with retries where those are safe, and error responses as `ServiceError`."""

import os
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

import httpx

from motionenv._core.files import atomic_write
from motionenv.errors import ExtrapolationWarning, MotionError, ServiceError

_CONNECT = 5.0  # [s]
_RETRIED = (429, 503)  # refused before anything was done
_MIN_WAIT = 0.1  # [s] between two attempts


class Connection:
    """A service's address, and the key to it; arguments as of `Client`, whose `url` has no path of its API.

    Raises:
        MotionError: url isn't an HTTP address.
    """

    def __init__(self, url: str, key: str | None, timeout: float, patience: float, retries: int) -> None:
        if not url.startswith(("http://", "https://")):
            raise MotionError(f"url must begin with http:// or https://, got {url!r}")
        key = os.environ.get("MOTIONENV_KEY") if key is None else key
        self.url, self.patience, self.timeout = url.rstrip("/"), patience, timeout
        self.headers = {"Authorization": f"Bearer {key}"} if key else {}
        self._http = httpx.Client(
            base_url=self.url, headers=self.headers, timeout=httpx.Timeout(timeout, connect=_CONNECT),
            transport=httpx.HTTPTransport(retries=retries),
        )  # fmt: skip

    def request(self, method: str, path: str, **options: Any) -> httpx.Response:
        """The response to a request, read; arguments and errors as of `stream`."""
        with self.stream(method, path, **options) as response:
            response.read()
        return response

    def save(self, out: Any, method: str, path: str, **options: Any) -> None:
        """Write a response to the file `out` as it arrives, whole or not at all; other arguments as of `stream`.

        Raises:
            ServiceError: an error response, or an incomplete one.
            MotionError: the file can't be written.
        """
        with atomic_write(out) as temporary, open(temporary, "wb") as file:
            with self.stream(method, path, **options) as response:
                for chunk in response.iter_bytes():
                    file.write(chunk)

    @contextmanager
    def stream(self, method: str, path: str, **options: Any) -> Iterator[httpx.Response]:
        """Send a request; the body of the response is still to be read. For options see `httpx.Client.build_request`.

        Raises:
            ServiceError: an error response, or none.
        """
        try:
            response = self._with_retries(method, path, options)
            try:
                yield response
            finally:
                response.close()
        except httpx.ConnectError as error:
            raise ServiceError(f"nothing answers at {self.url} ({error}): start it with `motionenv serve`") from None
        except httpx.TimeoutException:
            raise ServiceError(
                f"{self.url} sent nothing for {self.timeout:g} s: request less, or raise timeout"
            ) from None
        except httpx.TransportError as error:
            raise ServiceError(f"the connection to {self.url} broke: {error}") from None

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def _with_retries(self, method: str, path: str, options: dict[str, Any]) -> httpx.Response:
        """The response, once it is neither 429 nor 503 or patience ends."""
        until = time.monotonic() + self.patience
        while True:
            response = self._http.send(self._http.build_request(method, path, **options), stream=True)
            if not response.is_error:
                if told := response.headers.get("motion-warning"):
                    warnings.warn(told, ExtrapolationWarning, stacklevel=2)
                return response
            try:
                response.read()
                problem = as_error(response)
            finally:
                response.close()
            wait = max(_MIN_WAIT, problem.retry_after or 0.0)
            if problem.status not in _RETRIED or problem.retry_after is None or time.monotonic() + wait > until:
                raise problem
            time.sleep(wait)


def as_error(response: httpx.Response) -> ServiceError:
    """The error in an error response that has been read."""
    try:
        problem = response.json()
        detail, errors = str(problem["detail"]), problem.get("errors") or ()
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
