"""The models that can be asked for: those that ship, and those that jobs have fitted, files in the data folder."""

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import motionenv
from motionenv.models import names
from service.problems import Problem

_KEPT = 16  # fitted models in memory
_FITTED = re.compile(r"fitted/([a-z0-9][a-z0-9-]{0,62})")
_SHIPPED = {name: None for name in names()}


class Catalogue:
    """Models by name.

    Args:
        folder: of the fitted ones, `<name>.npz` each, called `fitted/<name>`.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._shipped: dict[str, Any] = {}

    def get(self, name: str) -> Any:
        """The model called `name`.

        Raises:
            Problem: 404, there is none.
        """
        if name in self._shipped:
            return self._shipped[name]
        if name in _SHIPPED:
            return self._shipped.setdefault(name, motionenv.load(name))
        path = self.path(name)
        try:
            return _loaded(path, path.stat().st_mtime_ns)
        except FileNotFoundError:
            raise _missing(name) from None

    def path(self, name: str) -> Path:
        """The file of the fitted model called `name`, which need not exist.

        Raises:
            Problem: 404, not the name of a fitted model.
        """
        match = _FITTED.fullmatch(name)
        if match is None:
            raise _missing(name)
        return self.folder / f"{match[1]}.npz"

    def names(self) -> list[str]:
        """Names of all models, those that ship first."""
        return [*_SHIPPED, *sorted(f"fitted/{path.stem}" for path in self.folder.glob("[a-z0-9]*.npz"))]

    def ready(self, name: str) -> bool:
        """Whether asking for `name` takes no time: it is in memory."""
        return name in self._shipped

    def version(self, name: str) -> str:
        """What changes when the model called `name` does."""
        return "" if name in _SHIPPED else str(self.path(name).stat().st_mtime_ns)


def _missing(name: str) -> Problem:
    return Problem(404, f"there is no model {name!r}: GET /v1/models lists them", field="/model")


@lru_cache(maxsize=_KEPT)
def _loaded(path: Path, _changed: int) -> Any:
    """The model in a file; read again when the file has changed."""
    return motionenv.load(path)
