"""Numbers that callers give, checked before any work: whatever is none is refused by name, not where it is used."""

from typing import Any

import numpy as np

from motionenv.errors import MotionError


def as_number(value: Any) -> float:
    """The value as a float; NaN, which lies within no limits, if it isn't a real number.

    Args:
        value: anything.
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return float(value) if real else np.nan


def checked_whole(value: Any, name: str, least: int, most: int | None = None) -> int:
    """A whole number, which may come as a float.

    Args:
        value: anything.
        name: of the argument.
        least: allowed.
        most: allowed; None is no limit.

    Raises:
        MotionError: it isn't one, or out of range.
    """
    number = as_number(value)
    if number % 1 != 0 or not least <= number <= (np.inf if most is None else most):
        limits = f"from {least}" if most is None else f"from {least} to {most}"
        raise MotionError(f"{name} must be a whole number {limits}, got {value!r}")
    return int(value)
