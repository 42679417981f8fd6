"""Registry of the ready-made models and of those that jobs have fitted, which are files in the data folder."""

import os
import re
import threading
from collections.abc import Collection
from functools import lru_cache
from pathlib import Path

import structlog

from motionenv import MotionError
from motionenv.models import GaitModel, did_you_mean, gait_model, names, takes_long, version
from service.errors import Problem, busy
from service.transport.access import Access

_log = structlog.get_logger("motionenv.service")
_KEPT = 16  # fitted models in memory
_UNLISTED = "unlisted"
_FITTED = re.compile(r"fitted/([a-z0-9][a-z0-9-]{0,62})")


class ModelRegistry:
    """Models by name.

    Those in the folder are called `fitted/<name>`: `<name>.npz` belongs to all, `<name>.<owner>.npz` to one key. What
    ends in `.unlisted.npz` is in no list.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._ready: dict[str, GaitModel] = {}
        self._failed: dict[str, str] = {}

    def load(self) -> None:
        """Load the ready-made models; those that take up to a minute come later, in a thread of their own."""
        later = [name for name in names() if not self._load(name, unless_long=True)]
        threading.Thread(target=lambda: list(map(self._load, later)), name="models", daemon=True).start()

    def _load(self, name: str, unless_long: bool = False) -> bool:
        """Load a ready-made model, or keep why it can't be; whether that is done now."""
        try:
            if unless_long and takes_long(name):
                return False
            self._ready[name] = gait_model(name)
        except MotionError as error:
            _log.error("model can't be made", model=name, problem=str(error))
            self._failed[name] = str(error)
        return True

    def get(self, name: str, access: Access) -> GaitModel:
        """The model called `name`; 404 if there is none to be seen, 503 if it isn't loaded yet or can't be."""
        model, problem = self.find(name, access)
        if model is not None:
            return model
        if problem is not None:
            raise Problem(503, f"{name} can't be used here: {problem}")
        raise busy(f"{name} is still being loaded", seconds=5)

    def find(self, name: str, access: Access) -> tuple[GaitModel | None, str | None]:
        """The model called `name`, or None and why it can't be loaded, both None while loading; 404 if unknown."""
        if name in self._ready:
            return self._ready[name], None
        if name in names():
            return None, self._failed.get(name)
        self.check(name, access)
        try:
            path = self.place(name, "")
            return _loaded(path, path.stat().st_mtime_ns), None
        except FileNotFoundError:
            raise self.missing(name, access) from None
        except MotionError as error:
            return None, str(error)

    def check(self, name: str, access: Access) -> None:
        """Raise 404 if there is no model called `name` to be seen, whether it is loaded or not."""
        if name not in names():
            path = self.find_path(name)
            if path is None or not self.shows(path, access):
                raise self.missing(name, access)

    def find_path(self, name: str) -> Path | None:
        """The file of the fitted model called `name`, or None."""
        match = _FITTED.fullmatch(name)
        if match is None:
            return None
        path = self.folder / f"{match[1]}.npz"
        return path if path.exists() else next(self.folder.glob(f"{match[1]}.*.npz"), None)

    def place(self, name: str, owner: str, listed: bool = True) -> Path:
        """Path of the fitted model called `name`, which may not exist yet."""
        parts = (name.removeprefix("fitted/"), owner, "" if listed else _UNLISTED, "npz")
        return self.find_path(name) or self.folder / ".".join(filter(None, parts))

    def publish(self, file: Path, name: str, owner: str, listed: bool) -> None:
        """Move the file of a model to where it is served from."""
        os.replace(file, self.place(name, owner, listed))

    def remove_unlisted(self, wanted: Collection[str]) -> None:
        """Remove the unlisted models whose names aren't `wanted`."""
        for path in self.folder.glob(f"*.{_UNLISTED}.npz"):
            if self.name_of(path) not in wanted:
                path.unlink(missing_ok=True)

    def name_of(self, path: Path) -> str:
        """The name of the model in a file."""
        return f"fitted/{path.name.split('.')[0]}"

    def owner_of(self, path: Path) -> str:
        """Owner of the model in a file; empty for one that belongs to all."""
        return ".".join(part for part in path.name.split(".")[1:-1] if part != _UNLISTED)

    def shows(self, path: Path, access: Access) -> bool:
        """Whether the model in a file may be used."""
        owner = self.owner_of(path)
        return not owner or access.to(owner)

    def names(self, access: Access) -> list[str]:
        """Names of all models that may be used, the ready-made ones first."""
        listed = (path for path in self.folder.glob("[a-z0-9]*.npz") if f".{_UNLISTED}" not in path.suffixes)
        fitted = (path for path in listed if self.shows(path, access))
        return [*names(), *sorted(map(self.name_of, fitted))]

    def missing(self, name: str, access: Access) -> Problem:
        """404: there is no such model."""
        near = did_you_mean(name, self.names(access))
        return Problem(404, f"there is no model {name!r}: GET /v1/models lists them{near}", field="/model")

    def version(self, name: str) -> str:
        """Version of the model called `name`, which changes when its file does."""
        return version(name) if name in self._ready or name in names() else str(self.place(name, "").stat().st_mtime_ns)


@lru_cache(maxsize=_KEPT)
def _loaded(path: Path, _changed: int) -> GaitModel:
    return gait_model(path)
