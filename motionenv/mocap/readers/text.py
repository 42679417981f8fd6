"""Parsing of text files: lines, numbers, names, with errors that name the place."""

import codecs
import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_KANA = re.compile(rb"[\x81-\x9f][\x40-\x7e\x80-\xfc]")  # of Shift-JIS: control characters in Latin-1
_LATIN = re.compile(rb"(?<![\x80-\xff])[\x80-\xff](?![\x80-\xff])|[\xe0-\xff]")  # small, or alone between ASCII


def read_lines(path: str | Path) -> list[str]:
    """The lines of a text file without line ends of any system, decoded as by `decoded`.

    Raises:
        FormatError: missing, unreadable, empty or binary.
    """
    raw = read_bytes(path)
    text = raw.decode("utf-16", errors="replace") if raw.startswith(_UTF_16) else decoded(raw)
    if "\0" in text:
        raise FormatError(path, "is binary, not a text format", f"byte {raw.index(0)}")
    return text.splitlines()


def decoded(raw: bytes) -> str:
    """Text in UTF-8, with or without its mark, or in one of the encodings of Windows: Shift-JIS or Latin-1."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        pass
    if _KANA.search(raw) or not _LATIN.search(raw):
        try:
            return raw.decode("cp932")
        except UnicodeDecodeError:
            pass
    return raw.decode("latin-1")


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


def pointed(word: str) -> str:
    """The `word` of a number with a decimal point for a decimal comma."""
    return word.replace(",", ".") if word.count(",") == 1 and "." not in word else word


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
