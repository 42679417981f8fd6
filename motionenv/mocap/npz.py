"""NPZ: motionenv's own file of a `Motion`, exact to the bit and without pickle."""

import struct
import zipfile
import zlib

import numpy as np

from motionenv.errors import FormatError
from motionenv.files import atomic_write
from motionenv.mocap.text import read_bytes
from motionenv.types import POSE, Motion, Skeleton

_FORMAT, _VERSION = "motionenv motion", 1
_LIMIT = 1 << 30  # [bytes] of arrays: 12 hours at 120 frames per second
_FIELDS = {"format", "version", "pose", "poses", "offsets", "radii", "height", "fps", "name"}

#: What zipfile, zlib and numpy raise on damaged files.
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, ValueError, OSError, EOFError, RuntimeError, KeyError)


def write(motion: Motion, path) -> None:
    """Write `motion` whole or not at all.

    Raises:
        MotionError: the folder is missing, not writable or full.
    """
    fields = {
        "format": np.array(_FORMAT),
        "version": np.array(_VERSION),
        "pose": np.array(POSE),
        "poses": motion.poses,
        "offsets": motion.skeleton.offsets,
        "radii": motion.skeleton.radii,
        "height": np.array(motion.skeleton.height),
        "fps": np.array(motion.fps),
        "name": np.array(motion.name),
    }
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, allow_pickle=False, **fields)


def read(path) -> Motion:
    """The motion in a file of `write`.

    Raises:
        FormatError: not such a file, of another version, damaged, or its arrays would take over 1 GiB.
    """
    read_bytes(path)
    try:
        with zipfile.ZipFile(path) as archive:
            _check_sizes(path, archive)
        with np.load(path, allow_pickle=False) as file:
            fields = {name: file[name] for name in _FIELDS if name in file}
    except _DAMAGED as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(path, f"is no NPZ file, or a damaged one: {error}") from None
    return _motion(path, fields)


def _check_sizes(path, archive: zipfile.ZipFile):
    """Refuse what would not fit in memory, by the arrays' own headers, before anything is unpacked."""
    total = 0
    for member in archive.infolist():
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # other kinds raise their own errors
            raise FormatError(path, "is damaged, or packed by something other than NumPy", member.filename)
        with archive.open(member) as file:
            version = np.lib.format.read_magic(file)
            reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = reader(file)
        total += abs(int(np.prod([*shape, dtype.itemsize], dtype=object)))
        if dtype.hasobject:
            raise FormatError(path, "holds Python objects, which are never loaded", member.filename)
        if total > _LIMIT:
            raise FormatError(path, f"its arrays would take over {_LIMIT >> 20} MiB", member.filename)


def _motion(path, fields: dict[str, np.ndarray]) -> Motion:
    """The motion of a file's arrays."""
    if str(fields.get("format")) != _FORMAT:
        raise FormatError(path, f"is an NPZ file of another kind: its 'format' isn't {_FORMAT!r}")
    if fields.get("version") != _VERSION:
        raise FormatError(path, f"is of version {fields.get('version')}; this motionenv reads version {_VERSION}")
    if missing := _FIELDS - set(fields):
        raise FormatError(path, f"has no {', '.join(sorted(missing))}")
    if tuple(fields["pose"]) != POSE:
        raise FormatError(path, f"its pose vector has other entries than {', '.join(POSE)}", "pose")
    try:
        skeleton = Skeleton(fields["offsets"], fields["radii"], float(fields["height"]))
        return Motion(fields["poses"], skeleton, float(fields["fps"]), str(fields["name"]))
    except (TypeError, ValueError) as error:
        raise FormatError(path, f"holds no motion: {error}") from None
