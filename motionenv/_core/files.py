"""Writing files whole or not at all, and sizes of arrays before they are unpacked."""

import math
import os
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from motionenv.errors import MotionError


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path`, with its suffix, that takes its place when the block ends well.

    When the block fails, nothing is left behind and an older file at `path` stays as it was.

    Raises:
        MotionError: the folder is missing, not writable or full; says which.
    """
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        os.chmod(name, 0o666 & ~_umask())
    except OSError as error:
        why = error.strerror or str(error)
        raise MotionError(f"can't write {path}: {why}; choose a folder that exists and is writable") from None
    try:
        yield Path(name)
        os.replace(name, path)
    except OSError as error:
        raise MotionError(f"can't write {path}: {error.strerror or error}; nothing was left half-written") from error
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name)


def _umask() -> int:
    """The process's umask (the system has no call that only reads it)."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def unpacked_size(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> tuple[int, np.dtype]:
    """Bytes of memory that the array in a `member` of an NPZ `archive` takes, by its header alone, and its type.

    Raises:
        ValueError: packed by other methods than NumPy's, of which each raises errors of its own.
    """
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("unknown compression method")
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = reader(file)
    return max(member.file_size, math.prod(map(abs, shape)) * dtype.itemsize), dtype
