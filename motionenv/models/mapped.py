"""Arrays in one file that are not read but mapped into memory: opened at once, however large, and shared by processes.

The file is an NPZ that `np.load` opens too, with two promises: nothing in it is compressed, and the data of every array
begins at a multiple of 64 bytes. For that the zip's local headers are padded in their extra field, as Android's
zipalign and PyTorch do. The same arrays give the same bytes.
"""

import mmap
import os
import struct
import weakref
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np

from motionenv.errors import ModelError
from motionenv.files import atomic_write

EPOCH = (1980, 1, 1, 0, 0, 0)  # a zip's earliest time, so that bytes don't depend on the clock
ALIGNMENT = 64  # bytes: a line of the cache, and what NumPy pads its own header to
_PADDING_ID = 0xD935  # zipalign's mark on an extra field that only pads
_LOCAL = struct.Struct("<4s22xHH")  # a local header: signature, lengths of name and extra field
_ZIP64 = 20  # bytes of the extra field in which the zip64 form tells sizes
_FLAG_ENCRYPTED = 0x1
_CHUNK = 2**24  # numbers looked at together


class Mapping:
    """A file that arrays are mapped from: says when it was changed under them.

    A file that another one takes the place of (as all writing here does) lives on for whoever has it open. One that
    is written to or truncated in place changes the arrays, or makes the process crash when it reads them: ask `check`
    before each use.

    Attributes:
        path: the file, absolute.
        fingerprint: a checksum over names, sizes and checksums of what the file holds.
    """

    def __init__(self, file, path, fingerprint: int):
        self.path = Path(path).absolute()
        self.fingerprint = fingerprint
        self._descriptor = os.dup(file.fileno())
        self._opened = self._state()
        weakref.finalize(self, os.close, self._descriptor)

    def check(self) -> None:
        """Make sure that the file is as it was when it was opened; takes a microsecond.

        Raises:
            ModelError: it was changed in place.
        """
        if self._state() != self._opened:
            raise ModelError(
                f"{self.path} was changed while it was in use: load it again, and replace such files by renaming, as "
                "`save` does, instead of writing over them"
            )

    def reduced(self, load: Callable[[str], Any]) -> tuple:
        """What `__reduce__` of the model in the file returns, so that a pickle holds the path and not the arrays.

        Args:
            load: makes the model from a path; it must leave the `Mapping` in the model's `mapping_`.
        """
        return reopened, (load, str(self.path), self.fingerprint)

    def _state(self) -> tuple[int, int]:
        found = os.fstat(self._descriptor)
        return found.st_size, found.st_mtime_ns


def reopened(load: Callable[[str], Any], path: str, fingerprint: int) -> Any:
    """The model of a pickle that holds a path.

    Args:
        load: makes the model from a path.
        path: where it was.
        fingerprint: of the file that was pickled.

    Raises:
        ModelError: no such file here, or another one in its place.
    """
    model = load(path)
    if model.mapping_.fingerprint != fingerprint:
        raise ModelError(f"{path} is another file than when this model was pickled: load it and pickle it again")
    return model


def write_mapped(path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays to a file that `map_arrays` opens, whole or not at all, without a copy of any in memory.

    Args:
        path: where; by habit ends in .npz.
        arrays: by name; of any size, mapped ones too, but C-contiguous.

    Raises:
        MotionError: the file can't be written.
        ModelError: an array isn't contiguous.
    """
    for name, array in arrays.items():
        if not array.flags.c_contiguous:
            raise ModelError(f"array {name!r} must be C-contiguous, to be written without a copy")
    with atomic_write(path) as temporary, open(temporary, "wb") as file, zipfile.ZipFile(file, "w") as archive:
        for name, array in arrays.items():
            info = zipfile.ZipInfo(f"{name}.npy", EPOCH)
            begin = file.tell() + _LOCAL.size + len(info.filename) + _ZIP64 + 4
            info.extra = struct.pack("<HH", _PADDING_ID, -begin % ALIGNMENT) + bytes(-begin % ALIGNMENT)
            with archive.open(info, "w", force_zip64=True) as stream:
                np.lib.format.write_array_header_1_0(stream, np.lib.format.header_data_from_array_1_0(array))
                flat = array.reshape(-1)
                for first in range(0, flat.size, _CHUNK):
                    stream.write(flat[first : first + _CHUNK].view(np.uint8).data)


def map_arrays(file, archive: zipfile.ZipFile, path) -> tuple[dict[str, np.ndarray], Mapping]:
    """The arrays of an open file, read-only, and the `Mapping` that watches over it.

    Names, sizes, types and places of all are checked against the file; the data aren't looked at.

    Args:
        file: the file, open for reading.
        archive: the zip in it.
        path: its name, for errors and for pickles.

    Raises:
        ModelError: a file that `write_mapped` didn't write, or a damaged one.
    """
    mapping = Mapping(file, path, _fingerprint(archive))
    data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    bounds = [*sorted(info.header_offset for info in archive.infolist()), archive.start_dir]
    arrays = {}
    for info in archive.infolist():
        until = bounds[bounds.index(info.header_offset) + 1]
        name = info.filename.removesuffix(".npy")
        arrays[name] = _mapped(data, info, until, f"{path} is damaged at array {name!r}: fetch or fit it again")
    return arrays, mapping


def has_nan(array: np.ndarray) -> bool:
    """Whether floats (any shape) hold a NaN anywhere, found in pieces."""
    flat = array.reshape(-1)
    return any(np.isnan(flat[first : first + _CHUNK]).any() for first in range(0, flat.size, _CHUNK))


def _mapped(data: mmap.mmap, info: zipfile.ZipInfo, until: int, damaged: str) -> np.ndarray:
    """The array of one member of the zip, which ends where the next thing begins, at `until`."""
    if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & _FLAG_ENCRYPTED:
        raise ModelError(damaged)
    local = data[info.header_offset : info.header_offset + _LOCAL.size]
    signature, name, extra = _LOCAL.unpack(local.ljust(_LOCAL.size))
    begin = info.header_offset + _LOCAL.size + name + extra
    end = begin + info.file_size
    if signature != b"PK\3\4" or begin % ALIGNMENT or end != until or info.compress_size != info.file_size:
        raise ModelError(damaged)
    data.seek(begin)
    if np.lib.format.read_magic(cast(Any, data)) != (1, 0):
        raise ModelError(damaged)
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(cast(Any, data))
    size = int(np.prod(shape, dtype=object)) * dtype.itemsize
    native = dtype.kind in "biufU" and dtype.isnative
    if fortran or not native or data.tell() % ALIGNMENT or data.tell() + size != end:
        raise ModelError(damaged)
    return np.ndarray(shape, dtype, cast(Any, data), data.tell())


def _fingerprint(archive: zipfile.ZipFile) -> int:
    """CRC-32 over names, sizes and CRC-32s of all members."""
    told = [f"{info.filename} {info.file_size} {info.CRC}" for info in archive.infolist()]
    return zlib.crc32("\n".join(told).encode())
