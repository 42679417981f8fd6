"""Work that takes minutes, and goes on whether or not anybody waits for it."""

import time
from collections.abc import Callable, Mapping
from typing import Any

from motionenv.client.connection import Connection
from motionenv.errors import MotionError, ServiceError

_GOES_ON = ("queued", "running")
_ENDED = 409  # what cancelling gets then
_WAIT = 10.0  # [s] in one request


class Job:
    """A job of a service, as it was when last looked at.

    Args:
        connection: to the service.
        told: the service's answer.

    Attributes:
        id: of the job.
        kind: fit, inspect, convert or render.
        status: queued, running, done, failed or cancelled.
        progress: 0 to 1.
        message: what it is doing.
        model: name of the model that it fits, or None.
        told: all that the service says of it.
    """

    def __init__(self, connection: Connection, told: Mapping[str, Any]):
        self._connection = connection
        self._take(told)

    def __repr__(self):
        return f"<Job {self.id} {self.kind}: {self.status}, {self.progress:.0%}>"

    def refresh(self, wait: float = 0.0) -> "Job":
        """Look again.

        Args:
            wait: seconds in which the service waits for a change, up to 30, instead of being asked again.

        Raises:
            ServiceError: there is no such job any more, or no answer.
        """
        self._take(self._connection.ask("GET", self._path, params={"wait": wait}).json())
        return self

    def wait(self, progress: Callable[["Job"], object] | None = None, timeout: float | None = None) -> "Job":
        """Wait until it is done.

        Args:
            progress: called with this job at first and whenever it has changed.
            timeout: seconds to wait at most; None for as long as it takes.

        Raises:
            ServiceError: it failed or was cancelled, or the service can't be reached.
            MotionError: it took longer; it goes on.
        """
        until = None if timeout is None else time.monotonic() + timeout
        seen = None
        while True:
            if progress is not None and self.told != seen:
                seen = self.told
                progress(self)
            if self.status not in _GOES_ON:
                break
            left = _WAIT if until is None else until - time.monotonic()
            if left <= 0:
                raise MotionError(f"job {self.id} takes longer than {timeout:g} s ({self.message}); it goes on")
            self.refresh(min(left, _WAIT))
        if self.status != "done":
            raise self._failure()
        return self

    def result(self) -> Any:
        """What it made: a dict where that is JSON, else bytes.

        Raises:
            ServiceError: it isn't done.
        """
        response = self._connection.ask("GET", f"{self._path}/result")
        return response.json() if response.headers["content-type"].startswith("application/json") else response.content

    def save(self, path: Any) -> None:
        """Write what it made to a file, whole or not at all.

        Args:
            path: of the file.

        Raises:
            ServiceError: it isn't done.
            MotionError: the file can't be written.
        """
        self._connection.save(path, "GET", f"{self._path}/result")

    def cancel(self) -> "Job":
        """Stop it, if it hasn't ended; what is known of it stays.

        Raises:
            ServiceError: there is no such job any more, or no answer.
        """
        try:
            self._take(self._connection.ask("POST", f"{self._path}/cancel").json())
        except ServiceError as error:
            if error.status != _ENDED:
                raise
            self.refresh()
        return self

    def remove(self) -> None:
        """Remove it with its files and its result, first stopping it if it hasn't ended. A fitted model stays.

        Raises:
            ServiceError: there is no such job any more, or no answer.
        """
        while self._remove():
            self.refresh(_WAIT)

    def _remove(self) -> bool:
        """Cancel or remove it; whether it is still there."""
        return self._connection.ask("DELETE", self._path).status_code != 204

    def _take(self, told: Mapping[str, Any]) -> None:
        self.told = dict(told)
        self.id, self.kind, self.status = told["id"], told["kind"], told["status"]
        self.progress, self.message, self.model = told["progress"], told["message"], told["model"]
        self._path = f"/v1/jobs/{self.id}"

    def _failure(self) -> ServiceError:
        error = self.told.get("error")
        if not error:
            return ServiceError(f"job {self.id} was {self.status}")
        return ServiceError(error["detail"], error["status"], error.get("errors") or ())
