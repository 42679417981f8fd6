"""Files damaged at random, as hands, disks and attackers do it."""

import re
from collections.abc import Iterator

import numpy as np

#: What stands where a number was.
NUMBERS = [b"nan", b"inf", b"-1", b"1e999", b"0", b"4294967296", b"1000000000", b"-2147483648", b"x", b""]


def mutated(original: bytes, count: int, seed: int) -> Iterator[bytes]:
    """`count` damaged copies of a file, each in one to four ways.

    Args:
        original: the file.
        count: how many.
        seed: the same one gives the same copies.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        made = original
        for _ in range(rng.integers(1, 5)):
            made = WAYS[rng.integers(len(WAYS))](made, rng)
        yield made


def _bytes_changed(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, max(1, len(data)), rng.integers(1, 20)):
        if place < len(changed):
            changed[place] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.integers(256)])
    return bytes(changed)


def _beginning_changed(data: bytes, rng: np.random.Generator) -> bytes:
    """Where binary formats say how large everything is."""
    return _bytes_changed(data[:600], rng) + data[600:]


def _cut_off(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: rng.integers(1, max(2, len(data)))]


def _part_missing(data: bytes, rng: np.random.Generator) -> bytes:
    first, last = np.sort(rng.integers(0, len(data) + 1, 2))
    return data[:first] + data[last:] or b"\x00"


def _part_twice(data: bytes, rng: np.random.Generator) -> bytes:
    first, last = np.sort(rng.integers(0, len(data) + 1, 2))
    return data[:last] + data[first : first + 10_000] + data[last:]


def _number_changed(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(re.finditer(rb"-?\d+(?:\.\d+)?", data[:200_000]))
    if not found:
        return _bytes_changed(data, rng)
    one = found[rng.integers(len(found))]
    return data[: one.start()] + NUMBERS[rng.integers(len(NUMBERS))] + data[one.end() :]


def _lines_swapped(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = rng.integers(0, len(lines), 2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


WAYS = (
    _bytes_changed, _beginning_changed, _cut_off, _part_missing, _part_twice, _number_changed, _number_changed,
    _lines_swapped,
)  # fmt: skip
