"""Errors of motionenv. All are ValueErrors, and their messages say how to fix the problem."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


class MotionError(ValueError):
    """An invalid motion, model or argument."""


class FormatError(MotionError):
    """A file can't be read.

    Args:
        path: the file.
        problem: what is wrong, and what was expected.
        where: the line or block; "" for the whole file.
    """

    def __init__(self, path: str | Path, problem: str, where: str = "") -> None:
        place = f"{path}, {where}" if where else f"{path}"
        super().__init__(f"{place}: {problem}")
        self.path, self.where, self.problem = str(path), where, problem

    def __reduce__(self):
        """Pickle by the three parts, so that the error can cross process borders."""
        return FormatError, (self.path, self.problem, self.where)


class GapError(MotionError):
    """Too many missing values (NaN) for a meaningful result."""


class ModelError(MotionError):
    """A model file of another kind or version, or a model used before `fit`."""


class EngineError(MotionError):
    """A rendering engine can't run here: the message says what to install."""


class ServiceError(MotionError):
    """A service rejected a request, failed or can't be reached.

    Args:
        detail: what is wrong, and how to fix it.
        status: HTTP status; None if there was no response.
        errors: each invalid field: `field`, `problem` and, if it exceeds one, `bound`.
        request_id: of the request in the service's logs.
        retry_after: seconds after which to retry, if the service specified it.
    """

    def __init__(
        self, detail: str, status: int | None = None, errors: Sequence[Mapping[str, Any]] = (),
        request_id: str | None = None, retry_after: float | None = None,
    ) -> None:  # fmt: skip
        super().__init__(detail)
        self.detail, self.status, self.errors = detail, status, tuple(errors)
        self.request_id, self.retry_after = request_id, retry_after

    def __reduce__(self):
        """Pickle by the parts, so that the error can cross process borders."""
        return ServiceError, (self.detail, self.status, self.errors, self.request_id, self.retry_after)


class ExtrapolationWarning(UserWarning):
    """A model was asked for what none of the walks that it learned from shows, such as a very fast walk."""


class CaptureWarning(UserWarning):
    """A capture was read otherwise than its file says, or is not plausible for a person."""


class FitWarning(UserWarning):
    """A model was fitted to data that don't suit it, or its fit didn't converge: what was found, and what to do."""
