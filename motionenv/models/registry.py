"""The models of all installed packages, found through the entry-point group `motionenv.models`.

An entry whose name has a slash is a ready-made model. Its value is called without arguments and returns the model: a
class that needs no fitting, a function, or a `ModelFile` that the package contains. An entry without a slash is a kind;
its value is the class that reads files of that kind. docs/models.md has an example.

The value of a ready-made model may have two attributes: `card()`, which returns the model card without making the
model, and `takes_long`, which makes the service build it in the background.
"""

import re
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from motionenv._core.validation import did_you_mean
from motionenv.errors import ModelError, MotionError
from motionenv.models.base import GaitModel
from motionenv.models.storage.model_file import StoredModel, open_model, read_card

GROUP = "motionenv.models"
_NAME = re.compile(r"[a-z0-9]+/[a-z0-9][a-z0-9-]{0,62}")
_OURS = "motionenv"


@dataclass(frozen=True)
class ModelFile:
    """A ready-made model in the file `path`."""

    path: Path

    def __call__(self) -> StoredModel:
        """Load the model."""
        return open_model(self.path, class_of)

    def card(self) -> dict:
        """The model card, read without the model."""
        return read_card(self.path)


def names() -> tuple[str, ...]:
    """Names of the ready-made models, such as "walk/fpca"; loads none."""
    return tuple(sorted(name for name in _entries() if "/" in name))


def load(name_or_path: str | Path) -> Any:
    """Load a fitted model from a file, or a ready-made one by its name, one of `names()`, such as "walk/fpca".

    The first call for "mixed/tree" builds it, which takes seconds, and keeps it in the user's cache or in the folder
    of the environment variable MOTIONENV_CACHE.

    Raises:
        ModelError: `name_or_path` is neither a file nor a known name, or the file no model, or a package fails to make
            it.
        MotionError: the cache can't be written.
    """
    name = str(name_or_path)
    if name in names():
        return _made(name)
    path = Path(name_or_path)
    if not path.is_file():
        raise ModelError(
            f"{name_or_path!r} is neither a model file nor the name of a model ({', '.join(names())})"
            + did_you_mean(name, names())
        )
    return open_model(path, class_of)


def card(name: str) -> dict:
    """The model card of the ready-made model `name`, one of `names()`, if possible without making the model.

    A `ModelError` if there is no such model, or its package fails to make it.
    """
    if name not in names():
        raise ModelError(f"there is no model {name!r}: {', '.join(names())}" + did_you_mean(name, names()))
    entry = _value(name)
    return entry.card() if hasattr(entry, "card") else dict(_made(name).card_)


def takes_long(name: str) -> bool:
    """Whether making the ready-made model `name` takes more than about a second.

    A `ModelError` if its package can't be imported.
    """
    return bool(getattr(_value(name), "takes_long", False))


@cache  # a distribution reads its metadata each time
def version(name: str) -> str:
    """Version of the package that provides the ready-made model `name`, one of `names()`."""
    return _entries()[name].dist.version  # type: ignore[union-attr]


def gait_model(model: Any) -> GaitModel:
    """The gait model `model`, loaded if it is given by name or path; a `MotionError` if it is no gait model."""
    loaded = load(model) if isinstance(model, str | Path) else model
    if not isinstance(loaded, GaitModel):
        what = getattr(loaded, "kind", type(loaded).__name__)
        raise MotionError(f"{model!r} is a {what} model, which makes no motion; see `motionenv models`")
    return loaded


def class_of(kind: str) -> type[StoredModel]:
    """The class of the `kind` in the header of model files; a `ModelError` if no installed package registers it."""
    kinds = [name for name in _entries() if "/" not in name]
    if kind not in kinds:
        raise ModelError(f"no installed package has models of kind {kind!r}; known kinds: {', '.join(kinds)}")
    return _value(kind)


@cache
def _entries() -> dict[str, EntryPoint]:
    """Entry points by name. If several share a name, motionenv's wins, then the first one found."""
    found = sorted(entry_points(group=GROUP), key=lambda entry: _package(entry) != _OURS)
    if not found or _package(found[0]) != _OURS:
        raise ModelError(f"motionenv's entry points {GROUP!r} are missing: reinstall it with pip install .")
    return {entry.name: entry for entry in reversed(found)}


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else ""


def _value(name: str) -> Any:
    entry = _entries()[name]
    if "/" in name and not _NAME.fullmatch(name):
        raise ModelError(f"model {name!r} of package {_package(entry)} must be named group/name, with a-z, 0-9 and -")
    try:
        return entry.load()
    except Exception as error:
        raise _unusable(name, error) from error


def _made(name: str) -> StoredModel:
    value = _value(name)
    try:
        model = value()
    except MotionError:
        raise
    except Exception as error:
        raise _unusable(name, error) from error
    return gait_model(model)


def _unusable(name: str, error: Exception) -> ModelError:
    what = f"{type(error).__name__}: {error}"
    return ModelError(f"model {name!r} of package {_package(_entries()[name])} can't be used: {what}")
