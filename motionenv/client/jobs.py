"""Jobs: long-running work that continues on the service whether or not the client waits."""

import time
from collections.abc import Callable, Mapping
from typing import Any

from motionenv.client.connection import Connection
from motionenv.errors import MotionError, ServiceError

_ACTIVE = ("queued", "running")
_CONFLICT = 409  # response to cancelling a job that has ended
_WAIT = 10.0  # [s] in one request


class Job:
    """A job of a service, in the state of the last response.

    Args:
        connection: to the service.
        data: `JobStatus` of the service's API.

    Attributes:
        id: of the job.
        kind: fit, inspect, points, convert, report or render.
        status: queued, running, done, failed or cancelled.
        progress: 0 to 1.
        message: what it is doing.
        model: name of the model that it fits, or None.
        data: the last `JobStatus`, complete.
    """

    def __init__(self, connection: Connection, data: Mapping[str, Any]) -> None:
        self._connection = connection
        self._take(data)

    def __repr__(self):
        return f"<Job {self.id} {self.kind}: {self.status}, {self.progress:.0%}>"

    def refresh(self, wait: float = 0.0) -> "Job":
        """Update the state; for `wait` seconds, up to 30, the service may hold the response back until it changes.

        Raises:
            ServiceError: the job was removed, or no response.
        """
        self._take(self._connection.request("GET", self._path, params={"wait": wait}).json())
        return self

    def wait(self, progress: Callable[["Job"], object] | None = None, timeout: float | None = None) -> "Job":
        """Wait until it is done.

        Args:
            progress: called with this job at the beginning and after every change.
            timeout: maximum seconds to wait; None: no limit.

        Raises:
            ServiceError: it failed or was cancelled, or the service can't be reached.
            MotionError: timeout; the job continues.
        """
        until = None if timeout is None else time.monotonic() + timeout
        seen = None
        while True:
            if progress is not None and self.data != seen:
                seen = self.data
                progress(self)
            if self.status not in _ACTIVE:
                break
            left = _WAIT if until is None else until - time.monotonic()
            if left <= 0:
                raise MotionError(f"job {self.id} takes longer than {timeout:g} s ({self.message}); it continues")
            self.refresh(min(left, _WAIT))
        if self.status != "done":
            raise self._failure()
        return self

    def result(self) -> Any:
        """The result: a dict where it is JSON, otherwise bytes; a ServiceError if the job isn't done."""
        response = self._connection.request("GET", f"{self._path}/result")
        return response.json() if response.headers["content-type"].startswith("application/json") else response.content

    def save(self, path: Any) -> None:
        """Write the result to a file at `path`, whole or not at all.

        Raises:
            ServiceError: it isn't done.
            MotionError: the file can't be written.
        """
        self._connection.save(path, "GET", f"{self._path}/result")

    def cancel(self) -> "Job":
        """Cancel the job if it hasn't ended; its state is kept. A ServiceError if it was removed, or no response."""
        try:
            self._take(self._connection.request("POST", f"{self._path}/cancel").json())
        except ServiceError as error:
            if error.status != _CONFLICT:
                raise
            self.refresh()
        return self

    def remove(self) -> None:
        """Remove the job with its files and its result, cancelling it first where necessary. A fitted model stays.

        Raises:
            ServiceError: the job was removed, or no response.
        """
        while self._connection.request("DELETE", self._path).status_code != 204:  # it has been cancelled only
            self.refresh(_WAIT)

    def _take(self, data: Mapping[str, Any]) -> None:
        self.data = dict(data)
        self.id, self.kind, self.status = data["id"], data["kind"], data["status"]
        self.progress, self.message, self.model = data["progress"], data["message"], data["model"]
        self._path = f"/v1/jobs/{self.id}"

    def _failure(self) -> ServiceError:
        error = self.data.get("error")
        if not error:
            return ServiceError(f"job {self.id} was {self.status}")
        return ServiceError(error["detail"], error["status"], error.get("errors") or ())
