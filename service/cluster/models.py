"""Fitted models of a service of several machines: rows in the database, files in the shared store, copies here."""

import os
import shutil
import tempfile
import threading
from pathlib import Path
from typing import NamedTuple

import psycopg

from service.cluster.objects import SharedFiles
from service.jobs.store import Unreachable
from service.model_registry import ModelRegistry

_CONNECT = 5  # [s] for a connection


class _Shared(NamedTuple):
    name: str  # fitted/...
    owner: str
    sha: str
    changed: int  # Unix time [ns], which its copies bear as their own, so that it has one version everywhere


class SharedModels(ModelRegistry):
    """Models that several machines share; those that aren't in `folder` yet are looked for in the database at `url`.

    What other machines replace or remove is learned by `refresh`. Methods that look for models raise `Unreachable` if
    the database or the shared store doesn't answer.
    """

    def __init__(self, folder: Path, url: str, files: SharedFiles) -> None:
        super().__init__(folder)
        self._url, self._files = url, files
        self._connection: psycopg.Connection | None = None
        self._turn = threading.Lock()
        self._copied: set[_Shared] = set()

    def find_path(self, name: str) -> Path | None:
        path = super().find_path(name)
        if path is None and name.startswith("fitted/"):
            self.refresh()
            path = super().find_path(name)
        return path

    def publish(self, file: Path, name: str, owner: str, sha: str) -> None:
        self._files.place(file, sha)  # `Store.finish` names it in the database

    def refresh(self) -> None:
        with self._turn:
            shared = set(self._asked())
            for model in shared - self._copied:
                self._copy(model)
            for path in self.folder.glob("[a-z0-9]*.npz"):
                if path not in {self._path(model) for model in shared}:
                    path.unlink(missing_ok=True)
            self._copied = shared

    def close(self) -> None:
        """Close the connection to the database."""
        with self._turn:
            if self._connection is not None:
                self._connection.close()

    def _path(self, model: _Shared) -> Path:
        stem = model.name.removeprefix("fitted/")
        return self.folder / (f"{stem}.{model.owner}.npz" if model.owner else f"{stem}.npz")

    def _copy(self, model: _Shared) -> None:
        path = self._path(model)
        if path.exists() and path.stat().st_mtime_ns == model.changed:
            return
        with tempfile.TemporaryDirectory(dir=self.folder) as making:
            copy = Path(making) / "model"
            try:
                shutil.copyfile(self._files.fetch(model.sha), copy)
            except FileNotFoundError:
                return  # it was replaced or removed meanwhile
            os.utime(copy, ns=(model.changed, model.changed))
            os.replace(copy, path)

    def _asked(self) -> list[_Shared]:
        """The models in the database; a connection that was lost meanwhile is made anew once."""
        for last in (False, True):
            try:
                if self._connection is None or self._connection.closed:
                    self._connection = psycopg.connect(self._url, autocommit=True, connect_timeout=_CONNECT)
                found = self._connection.execute("SELECT name, owner, sha, changed FROM motionenv_models").fetchall()
                return [_Shared(*row) for row in found]
            except psycopg.OperationalError as error:
                if self._connection is not None:
                    self._connection.close()
                if last:
                    raise Unreachable from error
        raise AssertionError
