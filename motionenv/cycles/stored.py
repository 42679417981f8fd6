"""Cycles that don't fit in memory: in .npy files, of which a few cycles at a time are read."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import MotionError

_REALS = (np.dtype(np.float32), np.dtype(np.float64))


@dataclass(frozen=True)
class Stored:
    """Location in a file of the numbers of an array (cycles, samples, channels)."""

    path: str
    offset: int
    shape: tuple[int, int, int]
    dtype: np.dtype

    def read(self, start: int, stop: int) -> np.ndarray:
        """Cycles `start` to `stop`, without mapping the file: mapped pages would count as this process's memory."""
        each = self.shape[1] * self.shape[2]
        size, offset = (stop - start) * each, self.offset + start * each * self.dtype.itemsize
        numbers = np.fromfile(self.path, self.dtype, size, offset=offset)
        if len(numbers) < size:
            raise MotionError(f"{self.path} has become shorter while it was read: write it again")
        return numbers.reshape(-1, *self.shape[1:])


class CycleFiles:
    """Arrays of cycles in files, one after the other, as if they were one array: `shape`, and slices, which are read.

    It pickles as the names of its `files`.
    """

    def __init__(self, files: Sequence[Stored]) -> None:
        self._files = tuple(files)
        self._starts = np.cumsum([0, *(file.shape[0] for file in files)])
        self.shape = (int(self._starts[-1]), *files[0].shape[1:])

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, part: slice) -> np.ndarray:
        """Cycles (n, samples, channels) float64 of a slice with a step of at least 1."""
        start, stop, step = part.indices(len(self))
        found = []
        for file, first in zip(self._files, self._starts[:-1].tolist(), strict=True):
            low = max(start, first) + -(max(start, first) - start) % step - first
            high = min(stop - first, file.shape[0])
            if low >= high:
                continue
            ranges = [(low, high)] if step == 1 else [(k, k + 1) for k in range(low, high, step)]
            found += [file.read(*pair) for pair in ranges]
        if len(found) == 1:
            return found[0].astype(np.float64, copy=False)
        return np.concatenate([*found, np.empty((0, *self.shape[1:]))], dtype=np.float64)


class StoredCycles:
    """Motion cycles as of `motionenv.types.Cycles`, but in files, for models that are fitted block by block.

    Args:
        files: .npy files, or memory maps of files (`numpy.load(path, mmap_mode="r")`), of arrays (cycles, samples,
            channels), float32 or float64, in C order; NaN where missing.
        channels: a name per channel.
        subject: the person's label of each cycle, over all files; None if all are one person's.

    Attributes:
        values: the `CycleFiles`, whose slices are arrays.
        channels, subject: as given, as tuples.

    Raises:
        MotionError: no file, one that can't be read or holds something else, or labels that don't match the cycles.
    """

    def __init__(self, files: Sequence[str | Path | np.memmap], channels: Sequence[str], subject: Any = None) -> None:
        self.channels = tuple(str(c) for c in channels)
        opened = [_opened(file) for file in files]
        if not opened:
            raise MotionError("files must name at least one .npy file of cycles, got none")
        for file in opened:
            if file.shape[1:] != (opened[0].shape[1], len(self.channels)):
                raise MotionError(
                    f"{file.path} must hold cycles (n, {opened[0].shape[1]}, {len(self.channels)}), as the first file "
                    f"and channels say, got {file.shape}"
                )
        self.values = CycleFiles(opened)
        self.subject = ("",) * len(self.values) if subject is None else tuple(str(s) for s in subject)
        if len(self.subject) != len(self.values):
            raise MotionError(f"subject must hold {len(self.values)} labels, got {len(self.subject)}")


def _opened(file) -> Stored:
    """The place of an array in a file, from a path or a memory map."""
    try:
        array = file if isinstance(file, np.memmap) else np.load(file, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
        raise MotionError(f"{file} is no .npy file of cycles: {error}") from None
    if not isinstance(array, np.memmap) or array.filename is None:
        raise MotionError(f"{file} must be a .npy file, not an archive of several arrays: save one array per file")
    if array.ndim != 3 or array.dtype not in _REALS or not array.flags.c_contiguous:
        raise MotionError(
            f"{array.filename} must hold float32 or float64 (cycles, samples, channels) in C order, got {array.dtype} "
            f"{array.shape}"
        )
    inside = array.__array_interface__["data"][0] - _origin(array)
    return Stored(str(array.filename), inside, array.shape, array.dtype)


def _origin(array: np.memmap) -> int:
    """The address at which the beginning of the file would lie; a slice of a map begins further on."""
    whole = array
    while isinstance(whole.base, np.memmap):
        whole = whole.base
    return whole.__array_interface__["data"][0] - whole.offset
