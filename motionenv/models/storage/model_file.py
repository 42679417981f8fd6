"""One file format for every model: an NPZ of arrays and a JSON header. Loading never executes code.

Files are compressed and read into memory. Models that may exceed memory are stored uncompressed and memory-mapped.
Equal arrays and headers give equal bytes on every machine.
"""

import inspect
import json
import tokenize
import zipfile
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from motionenv import __version__
from motionenv._core.files import atomic_write, unpacked_size
from motionenv._core.representation import listed, short
from motionenv.errors import ModelError
from motionenv.models.storage import mapped_npz

FORMAT = "motionenv model"
FORMAT_VERSION = 1
LIMIT = 256 * 2**20  # greatest unpacked size [bytes]; the shipped models take under 2 MB

# Errors that Python and NumPy raise for damaged files; the last two come from NumPy's parser of array headers.
_DAMAGE = (
    OSError, EOFError, KeyError, ValueError, NotImplementedError, zipfile.BadZipFile, zlib.error,
    SyntaxError, tokenize.TokenError,
)  # fmt: skip


class StoredModel(ABC):
    """A model that can be saved to a file and loaded from it.

    Attributes:
        kind: name by which the registry finds the class.
        mapped: whether files are memory-mapped instead of read. Their arrays may exceed memory and hold infinities, and
            loading sets `mapping_` to the file's `mapped_npz.Mapping`.
        card_: the model card: data, licence, command.
    """

    kind: ClassVar[str]
    mapped: ClassVar[bool] = False
    card_: dict

    def __repr__(self) -> str:
        """The settings that aren't the default, as in scikit-learn."""
        settings = inspect.signature(type(self)).parameters.values()
        values = {p.name: getattr(self, p.name, p.default) for p in settings}
        changed = {p.name: values[p.name] for p in settings if short(values[p.name]) != short(p.default)}
        return f"{type(self).__name__}({listed(changed)})"

    @abstractmethod
    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and JSON-serialisable settings from which `from_arrays` restores the model."""

    @classmethod
    @abstractmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """Restore a model from `arrays` and `meta` of `to_arrays`; a ModelError if shapes are inconsistent."""

    def save(self, path: str | Path, card: dict | None = None) -> None:
        """Write the fitted model to `path` (.npz) with a `card`, by default `card_`; a MotionError if it can't be."""
        arrays, meta = self.to_arrays()
        save_model(path, self.kind, arrays, {**meta, "card": card or self.card_}, mapped=self.mapped)


def save_model(
    path: str | Path, kind: str, arrays: Mapping[str, np.ndarray], meta: Mapping, *, mapped: bool = False
) -> None:
    """Write a model file atomically.

    Args:
        path: the file, conventionally *.npz.
        kind: kind of the model.
        arrays: numeric arrays by name, all finite; in mapped files, infinities are allowed.
        meta: JSON-serialisable settings, and the model card under "card".
        mapped: whether loading memory-maps the file.

    Raises:
        MotionError: the file can't be written.
        ModelError: an array is not numeric or not finite.
    """
    header = {"format": FORMAT, "format_version": FORMAT_VERSION, "motionenv": __version__, "kind": kind, "meta": meta}
    if mapped:
        header["mapped"] = True
    for name, array in arrays.items():
        _check_array(name, np.asarray(array), mapped, "can't save this model")
    members = {"header": np.array(json.dumps(header, sort_keys=True, allow_nan=False)), **arrays}
    if mapped:
        mapped_npz.write_mapped(path, members)
        return
    with atomic_write(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in members.items():
            info = zipfile.ZipInfo(f"{name}.npy", mapped_npz.EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w") as stream:
                np.lib.format.write_array(stream, np.asarray(array, order="C"), allow_pickle=False)


def load_model(path: str | Path) -> tuple[str, dict[str, np.ndarray], dict]:
    """Read kind, arrays and meta from the model file `path`. Mapped arrays are read-only.

    Raises:
        ModelError: no such file, not a model, damaged, of another version, too large, or not finite.
    """
    return _opened(path)[:3]


def open_model(path: str | Path, class_of: Callable[[str], type[StoredModel]]) -> StoredModel:
    """Load the model in the file at `path`; `class_of` returns the class of a kind, or raises a ModelError.

    Raises:
        ModelError: see `load_model`; also if the arrays don't fit the class.
    """
    kind, arrays, meta, mapping = _opened(path)
    model_class = class_of(kind)
    if model_class.mapped != (mapping is not None):
        raise ModelError(f"{path} has a damaged header: fetch or fit it again")
    try:
        model = model_class.from_arrays(arrays, meta)
    except (KeyError, TypeError, IndexError) as error:
        raise ModelError(f"{path} lacks data of a model of kind {kind!r} ({error!r}): fit it again") from None
    model.card_ = meta.get("card", {})
    if mapping is not None:
        model.mapping_ = mapping  # type: ignore[attr-defined]
    return model


def read_card(path: str | Path) -> dict:
    """The model card in the file `path`, without the model; a ModelError if it is no model file."""
    with _reading(path) as (_, archive):
        return _header(path, archive)["meta"].get("card", {})


def _opened(path) -> tuple[str, dict[str, np.ndarray], dict, mapped_npz.Mapping | None]:
    """Kind, arrays, meta and, for a mapped file, its `Mapping`."""
    path, mapping = Path(path), None
    with _reading(path) as (file, archive):
        header = _header(path, archive)
        if header.get("mapped") is True:
            arrays, mapping = mapped_npz.map_arrays(file, archive, path)
        else:
            _check_sizes(path, archive, archive.infolist())
            arrays = {i.filename.removesuffix(".npy"): _unpacked(archive, i) for i in archive.infolist()}
            for name, array in arrays.items():
                if name != "header":
                    _check_array(name, array, False, f"{path} is damaged")
    del arrays["header"]
    return header["kind"], arrays, header["meta"], mapping


@contextmanager
def _reading(path) -> Iterator[tuple[Any, zipfile.ZipFile]]:
    """Open the file and the zip in it; turn errors of either into a ModelError."""
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            yield file, archive
    except FileNotFoundError:
        raise ModelError(f"there is no model file {path}: check the path, or fit one with `motionenv fit`") from None
    except _DAMAGE as error:
        if isinstance(error, ModelError):
            raise
        raise ModelError(f"{path} is damaged or not a model file ({error}): fetch or fit it again") from None


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _check_sizes(path, archive: zipfile.ZipFile, members: list[zipfile.ZipInfo]) -> None:
    """Check, before anything is unpacked, that the arrays of `members` fit in `LIMIT`."""
    total = sum(unpacked_size(archive, info)[0] for info in members)
    if total > LIMIT:
        raise ModelError(
            f"{path} would take {total / 2**20:.0f} MB of memory, more than the limit of {LIMIT / 2**20:.0f} MB: "
            "don't trust it"
        )


def _header(path, archive: zipfile.ZipFile) -> dict:
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
            f"{path} has model format {version!r} (written by motionenv {header.get('motionenv')}), but motionenv "
            f"{__version__} reads format {FORMAT_VERSION}: fit it again, or install that version"
        )
    kind = header.get("kind")
    if not isinstance(kind, str) or not isinstance(header.get("meta"), dict):
        raise ModelError(f"{path} has a damaged header: fetch or fit it again")
    return header


def _check_array(name, array, mapped: bool, problem) -> None:
    whole = array.dtype.kind in "biuf" and (not mapped_npz.has_nan(array) if mapped else np.isfinite(array).all())
    if not whole:
        raise ModelError(f"{problem}: array {name!r} must hold finite numbers; fit it again from checked data")
