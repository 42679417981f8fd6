"""One file format for every model: an NPZ of arrays and a JSON header. Loading never executes code.

It is compressed, and unpacked into memory; of models that can be larger than memory it is neither, but mapped. The same
arrays and header give the same bytes, whenever and wherever they are written.
"""

import importlib
import json
import math
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from motionenv import __version__
from motionenv.errors import ModelError
from motionenv.files import atomic_write
from motionenv.models import mapped

FORMAT = "motionenv model"
FORMAT_VERSION = 1
ASSETS = Path(__file__).parent / "assets"
LIMIT = 256 * 2**20  # bytes that may be unpacked into memory; the shipped models take under 2 MB

# What Python and NumPy raise at files that are not whole; the last two come from NumPy's parser of array headers.
_DAMAGE = (
    OSError, EOFError, KeyError, ValueError, NotImplementedError, zipfile.BadZipFile, zlib.error,
    SyntaxError, tokenize.TokenError,
)  # fmt: skip

#: Where the class of each kind lives; a new model adds its line. A class has `kind`, `to_arrays`, `from_arrays`.
KINDS = {
    "fpca": "motionenv.models.fpca:FunctionalPCA",
    "eigenwalkers": "motionenv.models.eigenwalkers:Eigenwalkers",
    "walker-prior": "motionenv.models.walkerprior:WalkerPrior",
    "walking": "motionenv.models.walking:WalkingModel",
    "tree": "motionenv.models.tree.model:MotionTree",
}
#: Kinds whose arrays are mapped. Their classes have a `mapping_`, which `load` sets to the file's `mapped.Mapping`.
MAPPED = {"tree"}
#: Models that are made when they are first loaded, and who makes them: a module with `path`, the file, and `card`.
MADE = {"mixed/tree": "motionenv.models.tree.mixed"}


def save_model(path, kind: str, arrays: Mapping[str, np.ndarray], meta: Mapping) -> None:
    """Write a model whole or not at all.

    Args:
        path: where; by habit ends in .npz.
        kind: a key of `KINDS`.
        arrays: numeric arrays by name, all finite; those of a kind in `MAPPED` may be infinite.
        meta: what JSON can hold: settings, and the model card under "card".

    Raises:
        MotionError: the file can't be written.
        ModelError: an array is not numeric or not finite.
    """
    header = {"format": FORMAT, "format_version": FORMAT_VERSION, "motionenv": __version__, "kind": kind, "meta": meta}
    for name, array in arrays.items():
        _check_array(name, np.asarray(array), kind, "can't save this model")
    members = {"header": np.array(json.dumps(header, sort_keys=True, allow_nan=False)), **arrays}
    if kind in MAPPED:
        mapped.write_mapped(path, members)
        return
    with atomic_write(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in members.items():
            info = zipfile.ZipInfo(f"{name}.npy", mapped.EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w") as stream:
                np.lib.format.write_array(stream, np.asarray(array, order="C"), allow_pickle=False)


def load_model(path) -> tuple[str, dict[str, np.ndarray], dict]:
    """Read what `save_model` wrote: kind, arrays and meta. Arrays of a kind in `MAPPED` are read-only.

    Raises:
        ModelError: no such file, not a model, damaged, of another version, too large, or not finite; says what to do.
    """
    return _opened(path)[:3]


def load(name_or_path) -> Any:
    """The fitted model in a file, or the one that ships under a name such as "walk/fpca".

    "mixed/tree" is made when it is first asked for, which takes seconds, and kept in the user's cache, or in the folder
    that the environment variable MOTIONENV_CACHE names.

    Args:
        name_or_path: one of `names()`, or a file.

    Raises:
        ModelError: neither a file nor a name (lists the names), or a file that `load_model` refuses.
        MotionError: the cache can't be written.
    """
    path = _path_of(name_or_path)
    if not path.is_file():
        raise ModelError(
            f"{name_or_path!r} is neither a model file nor the name of a shipped model ({', '.join(names()) or 'none'})"
        )
    kind, arrays, meta, mapping = _opened(path)
    module, name = KINDS[kind].split(":")
    try:
        model = getattr(importlib.import_module(module), name).from_arrays(arrays, meta)
    except (KeyError, TypeError, IndexError) as error:
        raise ModelError(f"{path} lacks what a model of kind {kind!r} needs ({error!r}): fit it again") from None
    if mapping is not None:
        model.mapping_ = mapping
    return model


@cache
def names() -> tuple[str, ...]:
    """Names of the models that ship, such as "walk/fpca"."""
    return tuple(sorted([*MADE, *(path.stem.replace("-", "/", 1) for path in ASSETS.glob("*.npz"))]))


def card(name: str) -> dict:
    """The model card of a model that ships, without making or loading it.

    Args:
        name: one of `names()`.
    """
    if name in MADE:
        return importlib.import_module(MADE[name]).card()
    with _reading(_asset(name)) as (_, archive):
        return _header(_asset(name), archive)["meta"]["card"]


def _asset(name: str) -> Path:
    return ASSETS / f"{name.replace('/', '-')}.npz"


def _path_of(name_or_path) -> Path:
    """The file of a model; where the model is one of `MADE`, it is made if need be."""
    name = str(name_or_path)
    if name in MADE:
        return importlib.import_module(MADE[name]).path()
    return _asset(name) if name in names() else Path(name_or_path)


def _opened(path) -> tuple[str, dict[str, np.ndarray], dict, mapped.Mapping | None]:
    """Kind, arrays, meta, and for a kind in `MAPPED` what watches over the file."""
    path, mapping = Path(path), None
    with _reading(path) as (file, archive):
        header = _header(path, archive)
        kind = header["kind"]
        if kind in MAPPED:
            arrays, mapping = mapped.map_arrays(file, archive, path)
        else:
            _check_sizes(path, archive, archive.infolist())
            arrays = {i.filename.removesuffix(".npy"): _unpacked(archive, i) for i in archive.infolist()}
            for name, array in arrays.items():
                if name != "header":
                    _check_array(name, array, kind, f"{path} is damaged")
    del arrays["header"]
    return kind, arrays, header["meta"], mapping


@contextmanager
def _reading(path) -> Iterator[tuple[Any, zipfile.ZipFile]]:
    """The open file and the zip in it; what is wrong with either becomes a ModelError."""
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            yield file, archive
    except FileNotFoundError:
        raise ModelError(f"there is no model file {path}: check the path, or fit one with `motionenv fit`") from None
    except _DAMAGE as error:
        if isinstance(error, ModelError):
            raise
        raise ModelError(f"{path} is not a whole model file ({error}): fetch or fit it again") from None


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _check_sizes(path, archive: zipfile.ZipFile, members: list[zipfile.ZipInfo]) -> None:
    """Refuse, before anything is unpacked, `members` of an archive whose arrays would not fit in `LIMIT`."""
    total = 0
    for info in members:
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # others raise errors of their own
            raise ModelError(f"{path} is not a whole model file (no NumPy packs like that): fetch or fit it again")
        with archive.open(info) as stream:
            version = np.lib.format.read_magic(stream)
            read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(stream)
        total += max(info.file_size, math.prod(shape) * dtype.itemsize)
    if total > LIMIT:
        raise ModelError(f"{path} would take {total / 2**20:.0f} MB of memory, more than any model: don't trust it")


def _header(path, archive: zipfile.ZipFile) -> dict:
    """The checked header of an open file."""
    header = None
    if "header.npy" in archive.namelist():
        info = archive.getinfo("header.npy")
        _check_sizes(path, archive, [info])
        header = json.loads(str(_unpacked(archive, info)))
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ModelError(f"{path} is an NPZ but not a motionenv model: save models with `model.save(path)`")
    version = header.get("format_version")
    if version != FORMAT_VERSION:
        raise ModelError(
            f"{path} is of model format {version!r} (written by motionenv {header.get('motionenv')}), this motionenv "
            f"{__version__} reads format {FORMAT_VERSION}: fit it again, or install that version"
        )
    kind = header.get("kind")
    if not isinstance(kind, str) or not isinstance(header.get("meta"), dict):
        raise ModelError(f"{path} has a damaged header: fetch or fit it again")
    if kind not in KINDS:
        raise ModelError(
            f"{path} holds a model of kind {kind!r}; this motionenv {__version__} knows {', '.join(KINDS)}"
        )
    return header


def _check_array(name, array, kind, problem) -> None:
    whole = array.dtype.kind in "biuf" and (not mapped.has_nan(array) if kind in MAPPED else np.isfinite(array).all())
    if not whole:
        raise ModelError(f"{problem}: array {name!r} must hold finite numbers; fit it again from checked data")
