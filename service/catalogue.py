"""The models that can be asked for: those that ship, and those that jobs have fitted, files in the data folder."""

import re
import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

import structlog

import motionenv
from motionenv import MotionError
from motionenv.models import names
from service.problems import Problem, busy

_log = structlog.get_logger("motionenv.service")
_KEPT = 16  # fitted models in memory
_FITTED = re.compile(r"fitted/([a-z0-9][a-z0-9-]{0,62})")


class Catalogue:
    """Models by name.

    Args:
        folder: of the fitted ones, `<name>.npz` each, called `fitted/<name>`.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._shipped: dict[str, Any] = {}
        self._failed: dict[str, str] = {}

    def load(self) -> None:
        """Read the models that ship. A tree that is made, not shipped, comes later: making it takes up to a minute."""
        made = [name for name in names() if name.startswith("mixed/")]
        for name in set(names()) - set(made):
            self._shipped[name] = motionenv.load(name)
        threading.Thread(target=self._make, args=(made,), name="models", daemon=True).start()

    def _make(self, made: list[str]) -> None:
        for name in made:
            try:
                self._shipped[name] = motionenv.load(name)
            except MotionError as error:
                _log.error("model can't be made", model=name, problem=str(error))
                self._failed[name] = str(error)

    def get(self, name: str) -> Any:
        """The model called `name`.

        Raises:
            Problem: 404, there is none; 503, it isn't loaded yet, or can't be.
        """
        if name in self._shipped:
            return self._shipped[name]
        if name in names():
            if name in self._failed:
                raise Problem(503, f"{name} can't be made here: {self._failed[name]}")
            raise busy(f"{name} is still being loaded", seconds=5)
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
        return [*names(), *sorted(f"fitted/{path.stem}" for path in self.folder.glob("[a-z0-9]*.npz"))]

    def version(self, name: str) -> str:
        """What changes when the model called `name` does."""
        return "" if name in names() else str(self.path(name).stat().st_mtime_ns)


def _missing(name: str) -> Problem:
    return Problem(404, f"there is no model {name!r}: GET /v1/models lists them", field="/model")


@lru_cache(maxsize=_KEPT)
def _loaded(path: Path, _changed: int) -> Any:
    """The model in a file; read again when the file has changed."""
    return motionenv.load(path)
