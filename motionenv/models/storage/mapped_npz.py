"""Memory-mapped NPZ files, which open instantly at any size and are shared between processes.

`np.load` opens them too but reads the arrays into memory: it ignores `mmap_mode` for the members of an NPZ. The files
are mappable because members are uncompressed and each array's data begin at a multiple of 64 bytes. Padding in the
extra field of the zip's local headers aligns them, as in Android's zipalign and PyTorch. Equal arrays give equal bytes.
"""

import mmap
import os
import struct
import weakref
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from motionenv._core.files import atomic_write
from motionenv.errors import ModelError

EPOCH = (1980, 1, 1, 0, 0, 0)  # a zip's earliest time, so that bytes don't depend on the clock
ALIGNMENT = 64  # bytes: a cache line, and the multiple to which NumPy pads its own header
_PADDING_ID = 0xD935  # zipalign's ID of an extra field that only pads
_LOCAL = struct.Struct("<4s22xHH")  # a local header: signature, lengths of name and extra field
_ZIP64 = 20  # bytes of the zip64 extra field, which holds the sizes
_FLAG_ENCRYPTED = 0x1
_CHUNK = 2**24  # numbers checked or written at a time


class Mapping:
    """A memory-mapped file that detects changes in place.

    A file that is replaced by renaming, as `write_mapped` does, stays valid for the processes that have it open. A
    write or truncation in place changes the arrays, or crashes the process when it reads them: call `check` before
    each use. The `fingerprint` is a checksum over the names, sizes and checksums of the members.
    """

    def __init__(self, file: BinaryIO, path: str | Path, fingerprint: int) -> None:
        self.path = Path(path).absolute()
        self.fingerprint = fingerprint
        self._descriptor = os.dup(file.fileno())
        self._opened = self._state()
        weakref.finalize(self, os.close, self._descriptor)

    def check(self) -> None:
        """Raise a ModelError if the file has changed since it was opened; takes a microsecond."""
        if self._state() != self._opened:
            raise ModelError(
                f"{self.path} was changed while it was in use: load it again, and replace such files by renaming, as "
                "`save` does, instead of writing over them"
            )

    def reduced(self, load: Callable[[str], Any]) -> tuple:
        """Return value for `__reduce__` of the model in the file, so that a pickle holds the path and not the arrays.

        `load` loads the model from a path and sets its `mapping_`.
        """
        return reopened, (load, str(self.path), self.fingerprint)

    def _state(self) -> tuple[int, int]:
        found = os.fstat(self._descriptor)
        return found.st_size, found.st_mtime_ns


def reopened(load: Callable[[str], Any], path: str, fingerprint: int) -> Any:
    """Restore a model from a pickle that holds its path, `load` as of `Mapping.reduced`; a ModelError if changed."""
    model = load(path)
    if model.mapping_.fingerprint != fingerprint:
        raise ModelError(f"{path} has changed since this model was pickled: load it and pickle it again")
    return model


def write_mapped(path: str | Path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays atomically, and without copies in memory, to a file (*.npz) that `map_arrays` opens.

    Raises:
        MotionError: the file can't be written.
        ModelError: an array isn't C-contiguous.
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


def map_arrays(file: BinaryIO, archive: zipfile.ZipFile, path: str | Path) -> tuple[dict[str, np.ndarray], Mapping]:
    """Map the arrays of an open file, the zip `archive` in it, read-only; return them by name, and the `Mapping`.

    Checks names, sizes, types and offsets against the file, but doesn't read the data.

    Raises:
        ModelError: the file is damaged or wasn't written by `write_mapped`.
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
    """Whether a float array of any shape holds a NaN; checks it in chunks to bound memory."""
    flat = array.reshape(-1)
    return any(np.isnan(flat[first : first + _CHUNK]).any() for first in range(0, flat.size, _CHUNK))


def _mapped(data: mmap.mmap, info: zipfile.ZipInfo, until: int, damaged: str) -> np.ndarray:
    """The array of one member of the zip. The member must end at `until`, where the next record begins."""
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
