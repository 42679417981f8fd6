"""Arrays of NPZ files from anywhere: never pickles, never more than fits."""

import io
import struct
import zipfile
import zlib
from collections.abc import Container
from pathlib import Path

import numpy as np

from motionenv._core.files import unpacked_size
from motionenv.errors import FormatError

#: Most array data of a file [bytes]: 12 hours of motion at 120 frames per second.
LIMIT = 1 << 30

#: Exceptions of zipfile, zlib and numpy on damaged files.
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, ValueError, OSError, EOFError, RuntimeError, KeyError)


def load_arrays(raw: bytes, path: str | Path, wanted: Container[str]) -> tuple[dict[str, np.ndarray], list[str]]:
    """The `wanted` arrays of a file's content, by name, and the names of all; messages call it `path`.

    Raises:
        FormatError: not an NPZ file, damaged, Python objects, or arrays of more than 1 GiB.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            _check_sizes(path, archive, wanted)
        with np.load(io.BytesIO(raw), allow_pickle=False) as file:
            return {name: file[name] for name in file.files if name in wanted}, list(file.files)
    except _DAMAGED as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(path, "isn't an NPZ file, or is damaged") from None


def _check_sizes(path, archive: zipfile.ZipFile, wanted: Container[str]):
    """Reject archives that wouldn't fit in memory, by the arrays' headers, before anything is decompressed."""
    total = 0
    for member in archive.infolist():
        if member.filename.removesuffix(".npy") not in wanted:
            continue
        size, dtype = unpacked_size(archive, member)
        total += size
        if dtype.hasobject:
            raise FormatError(path, "has Python objects, which are never loaded", member.filename)
        if total > LIMIT:
            raise FormatError(path, f"has arrays of more than {LIMIT >> 20} MiB", member.filename)
