"""The parameter section of a C3D file and the numbers of its three kinds of processor."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.readers.text import decoded

BLOCK = 512
_INTEL, _DEC, _MIPS = 84, 85, 86
_TEXT = -1
_COUNTABLE = 2.0**40
_BYTES = {_TEXT: 1, 1: 1, 2: 2, 4: 4}  # per value of each type


@dataclass(frozen=True)
class Encoding:
    """Number format of a processor: 84 Intel, 85 DEC, 86 SGI/MIPS."""

    processor: int

    @property
    def _order(self) -> str:
        return ">" if self.processor == _MIPS else "<"

    def words(self, raw: bytes) -> np.ndarray:
        """Signed 16-bit integers."""
        return np.frombuffer(raw, dtype=f"{self._order}i2")

    def counts(self, raw: bytes) -> np.ndarray:
        """Unsigned 16-bit integers."""
        return np.frombuffer(raw, dtype=f"{self._order}u2")

    def reals(self, raw: bytes) -> np.ndarray:
        """32-bit floats. DEC's F-floating has its 16-bit halves swapped, and an exponent greater by 2 than IEEE's."""
        if self.processor != _DEC:
            return np.frombuffer(raw, dtype=f"{self._order}f4")
        halves = np.frombuffer(raw, dtype="<u2").reshape(-1, 2)
        swapped = (halves[:, 0].astype(np.uint32) << 16) | halves[:, 1]
        zero = (swapped & 0x7F800000) == 0
        with np.errstate(over="ignore", invalid="ignore"):
            return np.where(zero, np.float32(0), swapped.view(np.float32) * np.float32(0.25))


@dataclass
class Parameters:
    """The values by "GROUP:NAME", in capitals."""

    #: Arrays with the first index fastest, as in the file's language, Fortran; lists of text.
    values: dict[str, np.ndarray | list[str]] = field(default_factory=dict)
    whole: bool = True  # undamaged as far as can be told

    def texts(self, key: str) -> list[str]:
        """The texts of `key` and of its continuations (LABELS2, LABELS3, ...), beyond 255; empty without."""
        found: list[str] = []
        for name in (key, *(f"{key}{i}" for i in range(2, 258))):
            value = self.values.get(name)
            if not isinstance(value, list):
                break
            found += value
        return found

    def text(self, key: str) -> str:
        """The first text of `key`; "" without."""
        return next(iter(self.texts(key)), "")

    def numbers(self, key: str) -> np.ndarray:
        """The numbers of `key`, float64, in the shape that the file gives them; empty without."""
        value = self.values.get(key)
        with np.errstate(invalid="ignore"):  # signalling NaN
            return np.asarray(value, dtype=np.float64) if isinstance(value, np.ndarray) else np.empty(0)

    def number(self, key: str, default: float = np.nan) -> float:
        """The first number of `key`; `default` without."""
        return float(next(iter(self.numbers(key).ravel(order="F")), default))

    def counts(self, key: str) -> np.ndarray:
        """The whole numbers of `key`, whose signed type has those above 32767 as negative; 0 for what is no number."""
        numbers = self.numbers(key)
        whole = np.where(np.abs(numbers) < _COUNTABLE, numbers, 0)
        return np.where(whole < 0, whole + 65536, whole).astype(np.int64)


def read_encoding(path: str | Path, raw: bytes) -> Encoding:
    """Number format of the file of content `raw`.

    Raises:
        FormatError: not a C3D file, or one that ends before its parameters; names the block.
    """
    start = (raw[0] - 1) * BLOCK
    if raw[1:2] != b"\x50" or start < BLOCK:
        raise FormatError(path, "isn't a C3D file: it must start with the parameter block's number and 0x50", "block 1")
    if len(raw) < start + BLOCK:
        raise FormatError(path, f"is truncated: the parameters should start in block {raw[0]}", f"byte {len(raw)}")
    processor = raw[start + 3]
    if processor not in (_INTEL, _DEC, _MIPS):
        problem = f"the processor type must be 84 (Intel), 85 (DEC) or 86 (SGI/MIPS), got {processor}"
        raise FormatError(path, problem, f"block {raw[0]}")
    return Encoding(processor)


def read_parameters(raw: bytes, encoding: Encoding) -> Parameters:
    """All parameters that can be read: those of a damaged section up to the damage.

    Where a name occurs twice in a group, the first counts. The section's own number of blocks is ignored: it has 8
    bits, and long sections overflow it.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, np.ndarray | list[str]]] = []
    at, whole = (raw[0] - 1) * BLOCK + 4, True
    while at + 2 <= len(raw) and raw[at]:
        letters, group = abs(_signed(raw[at])), _signed(raw[at + 1])
        link = at + 2 + letters
        name = _decoded(raw[at + 2 : link]).strip().upper()
        if link + 2 > len(raw) or not name.isprintable() or not group:
            whole = False
            break
        step = int(encoding.counts(raw[link : link + 2])[0])
        if group < 0:
            groups.setdefault(-group, name)
        elif (value := _value(raw, link + 2, encoding)) is None:
            whole = False
        else:
            found.append((group, name, value))
        if not step:
            break
        at = link + step
    values: dict[str, np.ndarray | list[str]] = {}
    for group, name, value in found:
        values.setdefault(f"{groups.get(group, group)}:{name}", value)
    return Parameters(values, whole)


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _value(raw: bytes, at: int, encoding: Encoding) -> np.ndarray | list[str] | None:
    """The value whose type is at byte `at`; None if it is damaged."""
    if at + 2 > len(raw) or _signed(raw[at]) not in _BYTES or raw[at + 1] > 7:
        return None
    kind, begin = _signed(raw[at]), at + 2 + raw[at + 1]
    shape = tuple(raw[at + 2 : begin])
    size = _BYTES[kind] * int(np.prod(shape, dtype=object))
    data = raw[begin : begin + size]
    if len(data) < size:
        return None
    if kind == _TEXT:
        each = shape[0] if shape else 1
        return [_decoded(data[i : i + each]) for i in range(0, len(data), each)] if each else []
    if kind == 1:
        return np.frombuffer(data, dtype=np.int8).reshape(shape, order="F")
    numbers = encoding.words(data) if kind == 2 else encoding.reals(data)
    return numbers.reshape(shape, order="F")


def _decoded(raw: bytes) -> str:
    """Text without padding."""
    return decoded(raw.partition(b"\0")[0]).strip()
