"""Arguments checked before any work, in one wording: the name, what is allowed, what was given."""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, TypeGuard

import numpy as np

from motionenv.errors import MotionError

PICTURE_SIZES = (1, 16384)  # [pixels], sides of a picture


def is_number(value: Any) -> TypeGuard[float]:
    """Whether a value is a real number; True and False are none."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def checked_number(
    value: Any, name: str, low: float = -np.inf, high: float = np.inf, unit: str = "", *, above: float = -np.inf,
    below: float = np.inf,
) -> float:  # fmt: skip
    """A finite number from `low` to `high`, and beyond `above` and `below`, counted in `unit`; else a MotionError."""
    number = float(value) if is_number(value) else np.nan
    if not (low <= number <= high and above < number < below):
        counted = f" of {unit}" if unit else ""
        limits = _limits(low, high, above, below)
        wanted = f"a number{counted} {limits}" if limits else f"a finite number{counted}"
        raise MotionError(f"{name} must be {wanted}, got {value!r}", name)
    return number


def checked_whole(value: Any, name: str, low: int, high: float = np.inf, unit: str = "") -> int:
    """A whole number from `low` to `high`, counted in `unit`, also as a float; else a MotionError about `name`."""
    number: float = np.nan
    if is_number(value):
        number = float(value) if isinstance(value, float | np.floating) else int(value)  # floats end at 2⁵³
    if number % 1 != 0 or not low <= number <= high:
        counted = f" of {unit}" if unit else ""
        limits = _limits(low, high, -np.inf, np.inf)
        raise MotionError(f"{name} must be a whole number{counted} {limits}, got {value!r}", name)
    return int(value)


def _limits(low: float, high: float, above: float, below: float) -> str:
    """Such as "from 0 to 1", or "above 0 and below 1"."""
    if np.isfinite(low) and not np.isfinite(below):
        return f"from {_short(low)}" + (f" to {_short(high)}" if np.isfinite(high) else "")
    sides = ((low, "at least"), (above, "above"), (high, "at most"), (below, "below"))
    return " and ".join(f"{word} {_short(limit)}" for limit, word in sides if np.isfinite(limit))


def _short(limit: float) -> str:
    return str(int(limit)) if limit % 1 == 0 else f"{limit:g}"


def did_you_mean(given: Any, known: Iterable[str]) -> str:
    """Suffix for an error text that suggests the `known` word closest to `given`; empty if none is close."""
    near = get_close_matches(str(given), list(known), n=1, cutoff=0.5)
    return f": did you mean {near[0]}?" if near else ""


def checked_choice(value: Any, name: str, known: Iterable[str]) -> Any:
    """One of the `known` words; else a MotionError about `name`, which suggests the nearest."""
    if value not in (words := list(known)):
        nearest = did_you_mean(value, words)
        raise MotionError(f"{name} must be one of {', '.join(words)}, got {value!r}{nearest}", name)
    return value


def checked_range(value: Any, name: str, low: float, high: float, unit: str = "") -> tuple[float, float]:
    """Two numbers in order from `low` to `high`, counted in `unit`; else a MotionError about `name`."""
    try:
        least, most = value if all(map(is_number, value)) else (np.nan, np.nan)
    except (TypeError, ValueError):
        least = most = np.nan
    if not low <= least <= most <= high:
        counted = f" of {unit}" if unit else ""
        limits = _limits(low, high, -np.inf, np.inf)
        raise MotionError(f"{name} must be two numbers{counted} (low, high) {limits}, got {value!r}", name)
    return float(least), float(most)


def checked_fps(fps: Any, name: str = "fps") -> float:
    """Frames per second as a float; a MotionError about `name` unless they are a finite number above zero."""
    return checked_number(fps, name, above=0, unit="frames per second")


def random_generator(seed: Any) -> np.random.Generator:
    """The generator of a seed, None, a whole number from 0 or several; a Generator as it is; else a MotionError."""
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise MotionError(f"seed must be None, a whole number from 0 or a numpy Generator, got {seed!r}") from None
