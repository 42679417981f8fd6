"""Parsing of text files: lines, numbers, names, with errors that name the place."""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError


def read_lines(path: str | Path, latin: bool = False) -> list[str]:
    """The lines of a text file, UTF-8 or, with `latin`, what Windows programs write, without line ends of any system.

    Raises:
        FormatError: missing, unreadable, empty, binary or not UTF-8.
    """
    raw = read_bytes(path)
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise FormatError(path, "is UTF-16; save it as plain text (UTF-8)", "start of the file")
    if b"\0" in raw:
        raise FormatError(path, "is binary, not a text format", f"byte {raw.index(0)}")
    try:
        return raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        if latin:
            return raw.decode("latin-1").splitlines()
        line = raw.count(b"\n", 0, error.start) + 1
        raise FormatError(path, "is not UTF-8 text; save it as UTF-8", f"line {line}") from None


def given_fps(fps: float | None, override: bool, stated: Callable[[], float]) -> float:
    """A caller's frame rate, if it overrides or the file's, `stated()`, is a FormatError; otherwise the file's."""
    if fps is None:
        return stated()
    try:
        return checked_fps(fps) if override else stated()
    except FormatError:
        return checked_fps(fps)


def read_bytes(path: str | Path) -> bytes:
    """The file's content; a FormatError if it is missing, unreadable or empty."""
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise FormatError(path, f"can't be read: {error.strerror}") from None
    if not raw.strip():
        raise FormatError(path, "is empty")
    return raw


def number(path: str | Path, line: int, word: str, what: str) -> float:
    """`word` as a finite number; otherwise a FormatError that names the line and `what`, the expected value."""
    try:
        value = float(word)
    except ValueError:
        raise FormatError(path, f"{what} must be a number, got {word!r}", f"line {line}") from None
    if not np.isfinite(value):
        raise FormatError(path, f"{what} must be finite, got {word!r}", f"line {line}")
    return value


def count(path: str | Path, line: int, word: str, what: str) -> int:
    """`word` as a whole number above 0; otherwise a FormatError that names the line and `what`, the expected value."""
    value = number(path, line, word, what)
    if value != int(value) or value < 1:
        raise FormatError(path, f"{what} must be a whole number above 0, got {word!r}", f"line {line}")
    return int(value)


def unique(names: Iterable[str]) -> tuple[str, ...]:
    """`names` with "_2", "_3", ... appended to repeated ones."""
    seen: set[str] = set()
    out = []
    for name in names:
        candidate, n = name, 1
        while candidate in seen:
            n += 1
            candidate = f"{name}_{n}"
        seen.add(candidate)
        out.append(candidate)
    return tuple(out)
