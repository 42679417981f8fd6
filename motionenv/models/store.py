"""One file format for every model: a compressed NPZ of arrays and a JSON header. Loading never executes code.

The same arrays and header give the same bytes, whenever and wherever they are written.
"""

import importlib
import json
import math
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from motionenv import __version__
from motionenv.errors import ModelError
from motionenv.files import atomic_write

FORMAT = "motionenv model"
FORMAT_VERSION = 1
ASSETS = Path(__file__).parent / "assets"
LIMIT = 256 * 2**20  # bytes a model may take in memory; the shipped ones take under 2 MB
EPOCH = (1980, 1, 1, 0, 0, 0)  # a zip's earliest time, so that bytes don't depend on the clock

#: Where the class of each kind lives; a new model adds its line. A class has `kind`, `to_arrays`, `from_arrays`.
KINDS = {
    "fpca": "motionenv.models.fpca:FunctionalPCA",
    "eigenwalkers": "motionenv.models.eigenwalkers:Eigenwalkers",
    "walking": "motionenv.models.walking:WalkingModel",
}


def save_model(path, kind: str, arrays: Mapping[str, np.ndarray], meta: Mapping) -> None:
    """Write a model whole or not at all.

    Args:
        path: where; by habit ends in .npz.
        kind: a key of `KINDS`.
        arrays: numeric arrays by name, all finite.
        meta: what JSON can hold: settings, and the model card under "card".

    Raises:
        MotionError: the file can't be written.
        ModelError: an array is not numeric or not finite.
    """
    header = {"format": FORMAT, "format_version": FORMAT_VERSION, "motionenv": __version__, "kind": kind, "meta": meta}
    for name, array in arrays.items():
        _check_array(name, np.asarray(array), "can't save this model")
    members = {"header": np.array(json.dumps(header, sort_keys=True, allow_nan=False)), **arrays}
    with atomic_write(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in members.items():
            info = zipfile.ZipInfo(f"{name}.npy", EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w") as stream:
                np.lib.format.write_array(stream, np.asarray(array, order="C"), allow_pickle=False)


def load_model(path) -> tuple[str, dict[str, np.ndarray], dict]:
    """Read what `save_model` wrote: kind, arrays and meta.

    Raises:
        ModelError: no such file, not a model, damaged, of another version, too large, or not finite; says what to do.
    """
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as archive:
            _check_sizes(path, archive)
        with np.load(path, allow_pickle=False) as file:
            header = _header(path, file)
            arrays = {name: file[name] for name in file.files if name != "header"}
    except FileNotFoundError:
        raise ModelError(f"there is no model file {path}: check the path, or fit one with `motionenv fit`") from None
    except (OSError, EOFError, KeyError, ValueError, NotImplementedError, zipfile.BadZipFile, zlib.error) as error:
        if isinstance(error, ModelError):
            raise
        raise ModelError(f"{path} is not a whole model file ({error}): fetch or fit it again") from None
    for name, array in arrays.items():
        _check_array(name, array, f"{path} is damaged")
    return header["kind"], arrays, header["meta"]


def load(name_or_path) -> Any:
    """The fitted model in a file, or the one that ships under a name such as "walk/fpca".

    Args:
        name_or_path: one of `names()`, or a file.

    Raises:
        ModelError: neither a file nor a name (lists the names), or a file that `load_model` refuses.
    """
    asset = ASSETS / f"{str(name_or_path).replace('/', '-')}.npz"
    path = asset if str(name_or_path) in names() else Path(name_or_path)
    if not path.is_file():
        raise ModelError(
            f"{name_or_path!r} is neither a model file nor the name of a shipped model ({', '.join(names()) or 'none'})"
        )
    kind, arrays, meta = load_model(path)
    if kind not in KINDS:
        raise ModelError(
            f"{path} holds a model of kind {kind!r}; this motionenv {__version__} knows {', '.join(KINDS)}"
        )
    module, name = KINDS[kind].split(":")
    model = getattr(importlib.import_module(module), name)
    try:
        return model.from_arrays(arrays, meta)
    except (KeyError, TypeError, IndexError) as error:
        raise ModelError(f"{path} lacks what a model of kind {kind!r} needs ({error!r}): fit it again") from None


def names() -> tuple[str, ...]:
    """Names of the models that ship, such as "walk/fpca"."""
    return tuple(sorted(path.stem.replace("-", "/", 1) for path in ASSETS.glob("*.npz")))


def _check_sizes(path, archive) -> None:
    """Refuse, before anything is unpacked, an archive whose arrays would not fit in `LIMIT`."""
    total = 0
    for info in archive.infolist():
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # others raise errors of their own
            raise ModelError(f"{path} is not a whole model file (no NumPy packs like that): fetch or fit it again")
        with archive.open(info) as stream:
            version = np.lib.format.read_magic(stream)
            read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(stream)
        total += max(info.file_size, math.prod(shape) * dtype.itemsize)
    if total > LIMIT:
        raise ModelError(f"{path} would take {total / 2**20:.0f} MB of memory, more than any model: don't trust it")


def _header(path, file) -> dict:
    """The checked header of an open NPZ."""
    header = json.loads(str(file["header"])) if "header" in file.files else None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ModelError(f"{path} is an NPZ but not a motionenv model: save models with `model.save(path)`")
    version = header.get("format_version")
    if version != FORMAT_VERSION:
        raise ModelError(
            f"{path} is of model format {version!r} (written by motionenv {header.get('motionenv')}), this motionenv "
            f"{__version__} reads format {FORMAT_VERSION}: fit it again, or install that version"
        )
    if not isinstance(header.get("kind"), str) or not isinstance(header.get("meta"), dict):
        raise ModelError(f"{path} has a damaged header: fetch or fit it again")
    return header


def _check_array(name, array, problem) -> None:
    if array.dtype.kind not in "biuf" or not np.isfinite(array).all():
        raise ModelError(f"{problem}: array {name!r} must hold finite numbers; fit it again from checked data")
