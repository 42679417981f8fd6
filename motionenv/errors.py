"""Errors that motionenv raises on purpose. All are ValueErrors, and each says what to do next."""

from collections.abc import Mapping, Sequence
from typing import Any


class MotionError(ValueError):
    """Something about a motion, a model or a request is not as it must be."""


class FormatError(MotionError):
    """A file can't be read: the message names the file, the line or block, and what was expected."""

    def __init__(self, path, problem: str, where: str = ""):
        place = f"{path}, {where}" if where else f"{path}"
        super().__init__(f"{place}: {problem}")
        self.path, self.where, self.problem = str(path), where, problem

    def __reduce__(self):
        """Pickle by the three parts, so that the error crosses process borders whole."""
        return FormatError, (self.path, self.problem, self.where)


class GapError(MotionError):
    """Too much is missing (NaN) for the answer to mean anything."""


class ModelError(MotionError):
    """A model file is of another kind or version, or a model was used before `fit`."""


class EngineError(MotionError):
    """A rendering engine can't run here: the message says what to install."""


class ServiceError(MotionError):
    """A service refused, failed or can't be reached.

    Args:
        detail: what was wrong, and what to do.
        status: of HTTP; None where no answer came.
        errors: each field that was wrong: `field`, `problem` and, where it broke one, `bound`.
        request_id: by which the service's logs know the request.
        retry_after: seconds after which to ask again, where the service said so.
    """

    def __init__(
        self,
        detail: str,
        status: int | None = None,
        errors: Sequence[Mapping[str, Any]] = (),
        request_id: str | None = None,
        retry_after: float | None = None,
    ):
        super().__init__(detail)
        self.detail, self.status, self.errors = detail, status, tuple(errors)
        self.request_id, self.retry_after = request_id, retry_after

    def __reduce__(self):
        """Pickle by the parts, so that the error crosses process borders whole."""
        return ServiceError, (self.detail, self.status, self.errors, self.request_id, self.retry_after)
