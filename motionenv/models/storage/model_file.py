"""One file format for every model: an NPZ of arrays and a JSON header. Loading never executes code.

Files are compressed, except those of large models. Equal arrays and headers give equal bytes on every machine.
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
from typing import ClassVar, Self

import numpy as np

from motionenv import __version__
from motionenv._core.files import atomic_write, unpacked_size
from motionenv._core.representation import listed, short
from motionenv.errors import ModelError

FORMAT = "motionenv model"
FORMAT_VERSION = 1
LIMIT = 256 * 2**20  # greatest unpacked size [bytes] of files that are smaller; the shipped models take under 2 MB
EPOCH = (1980, 1, 1, 0, 0, 0)  # a zip's earliest time, so that bytes don't depend on the clock

# Errors that Python and NumPy raise for damaged files; the last two come from NumPy's parser of array headers.
_DAMAGE = (
    OSError, EOFError, KeyError, ValueError, NotImplementedError, zipfile.BadZipFile, zlib.error,
    SyntaxError, tokenize.TokenError,
)  # fmt: skip


class StoredModel(ABC):
    """A model that can be saved to a file and loaded from it.

    Attributes:
        kind: name by which the registry finds the class.
        compressed: whether files are compressed. Those that aren't may be of any size, and hold infinities.
        card_: the model card: data, licence, command.
    """

    kind: ClassVar[str]
    compressed: ClassVar[bool] = True
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
        save_model(path, self.kind, arrays, {**meta, "card": card or self.card_}, compressed=self.compressed)


def save_model(
    path: str | Path, kind: str, arrays: Mapping[str, np.ndarray], meta: Mapping, *, compressed: bool = True
) -> None:
    """Write a model file atomically.

    Args:
        path: the file, conventionally *.npz.
        kind: kind of the model.
        arrays: numeric arrays by name, all finite; where they aren't compressed, infinities are allowed.
        meta: JSON-serialisable settings, and the model card under "card".
        compressed: whether to compress the arrays.

    Raises:
        MotionError: the file can't be written.
        ModelError: an array is not numeric or not finite.
    """
    header = {"format": FORMAT, "format_version": FORMAT_VERSION, "motionenv": __version__, "kind": kind, "meta": meta}
    for name, array in arrays.items():
        _check_array(name, np.asarray(array), compressed, "can't save this model")
    members = {"header": np.array(json.dumps(header, sort_keys=True, allow_nan=False)), **arrays}
    with atomic_write(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in members.items():
            info = zipfile.ZipInfo(f"{name}.npy", EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
            with archive.open(info, "w", force_zip64=not compressed) as stream:
                np.lib.format.write_array(stream, np.asarray(array, order="C"), allow_pickle=False)


def load_model(path: str | Path) -> tuple[str, dict[str, np.ndarray], dict]:
    """Read kind, arrays and meta from the model file `path`.

    Raises:
        ModelError: no such file, not a model, damaged, of another version, too large, or not finite.
    """
    with _reading(path) as archive:
        header = _header(path, archive)
        members = [info for info in archive.infolist() if info.filename != "header.npy"]
        _check_sizes(path, archive, members)
        arrays = {}
        for info in members:
            name, compressed = info.filename.removesuffix(".npy"), info.compress_type != zipfile.ZIP_STORED
            arrays[name] = _unpacked(archive, info)
            _check_array(name, arrays[name], compressed, f"{path} is damaged")
    return header["kind"], arrays, header["meta"]


def open_model(path: str | Path, class_of: Callable[[str], type[StoredModel]]) -> StoredModel:
    """Load the model in the file at `path`; `class_of` returns the class of a kind, or raises a ModelError.

    Raises:
        ModelError: see `load_model`; also if the arrays don't fit the class.
    """
    kind, arrays, meta = load_model(path)
    try:
        model = class_of(kind).from_arrays(arrays, meta)
    except (KeyError, TypeError, IndexError) as error:
        raise ModelError(f"{path} lacks data of a model of kind {kind!r} ({error!r}): fit it again") from None
    model.card_ = meta.get("card", {})
    return model


def read_card(path: str | Path) -> dict:
    """The model card in the file `path`, without the model; a ModelError if it is no model file."""
    with _reading(path) as archive:
        return _header(path, archive)["meta"].get("card", {})


@contextmanager
def _reading(path) -> Iterator[zipfile.ZipFile]:
    """Open the zip; turn its errors into a ModelError."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
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
    """Check, before anything is unpacked, that the arrays of `members` fit in `LIMIT` or are as large as the file."""
    total, most = sum(unpacked_size(archive, info)[0] for info in members), max(LIMIT, Path(path).stat().st_size)
    if total > most:
        raise ModelError(
            f"{path} would take {total / 2**20:.0f} MB of memory, more than the limit of {most / 2**20:.0f} MB: "
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


def _check_array(name, array, finite: bool, problem) -> None:
    number = array.dtype.kind in "biuf"
    if not number or (np.isnan(array).any() if not finite else not np.isfinite(array).all()):
        raise ModelError(f"{problem}: array {name!r} must hold finite numbers; fit it again from checked data")
