"""NPZ: motionenv's own file format of a `Motion`, lossless and without pickle."""

import io
import struct
import zipfile
import zlib
from collections.abc import Container, Iterator, Mapping
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write, unpacked_size
from motionenv.body.limbs import current_radii
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.readers.text import read_bytes
from motionenv.types import POSE, Motion, Skeleton

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


_FORMAT, _VERSION = "motionenv motion", 1
_NAMES = {"format", "version", "pose", "poses", "offsets", "radii", "height", "fps", "name"}
_OPTIONAL = {"filled"}  # in files of motions of which a model filled entries


def write(motion: Motion, path: str | Path, beside: Mapping[str, np.ndarray] | None = None) -> None:
    """Write `motion` atomically; a MotionError if the folder is missing, not writable or full.

    Arrays of other names, `beside` the motion, are for other programs: `read` ignores them.
    """
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, allow_pickle=False, **(beside or {}), **_fields(motion))


def encode(motion: Motion) -> Iterator[bytes]:
    """The bytes of an uncompressed file, in one part, which `read` reads too; a MotionError if too large."""
    if motion.poses.nbytes > LIMIT:
        raise MotionError(f"an NPZ file has at most {LIMIT >> 20} MiB of poses, got {motion.poses.nbytes >> 20}")
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **_fields(motion))
    return iter([file.getvalue()])


def _fields(motion: Motion) -> dict[str, np.ndarray]:
    body = motion.skeleton
    fields = {
        "format": np.array(_FORMAT), "version": np.array(_VERSION), "pose": np.array(POSE), "offsets": body.offsets,
        "radii": body.radii, "height": np.array(body.height), "fps": np.array(motion.fps),
        "name": np.array(motion.name), "poses": motion.poses,
    }  # fmt: skip
    return fields if motion.filled is None else {**fields, "filled": motion.filled}


def read(path: str | Path) -> Motion:
    """Read a file of `write`.

    Raises:
        FormatError: not such a file, another version, damaged, or arrays of more than 1 GiB.
    """
    return parse(read_bytes(path), path)


def parse(raw: bytes, path: str | Path) -> Motion:
    """The motion in the bytes of a file of `write` or `parts`; errors as of `read` call it `path`."""
    fields, held = load_arrays(raw, path, _NAMES | _OPTIONAL)
    return _motion(path, fields, held)


def _motion(path, fields: dict[str, np.ndarray], held: list[str]) -> Motion:
    if str(fields.get("format")) != _FORMAT:
        names = ", ".join(held[:8]) + (" ..." if len(held) > 8 else "") or "no arrays"
        raise FormatError(
            path, f"is an NPZ file of another kind, with {names}: neither motionenv's ('format' {_FORMAT!r}) nor "
            "AMASS's ('poses' and 'trans', or 'joints')",
        )  # fmt: skip
    if fields.get("version") != _VERSION:
        raise FormatError(path, f"is of version {fields.get('version')}; this motionenv reads version {_VERSION}")
    if missing := _NAMES - set(fields):
        raise FormatError(path, f"has no {', '.join(sorted(missing))}")
    if tuple(fields["pose"]) != POSE:
        raise FormatError(path, f"its pose vector has other entries than {', '.join(POSE)}", "pose")
    try:
        radii = current_radii(fields["radii"], float(fields["height"]))
        skeleton = Skeleton(fields["offsets"], radii, float(fields["height"]))
        return Motion(fields["poses"], skeleton, float(fields["fps"]), str(fields["name"]), fields.get("filled"))
    except (TypeError, ValueError) as error:
        raise FormatError(path, f"has no valid motion: {error}") from None
