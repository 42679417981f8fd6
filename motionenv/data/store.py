"""Storage of data sets: a folder on this machine, or whatever `fsspec` reaches, such as S3."""

import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from motionenv._core.locks import lock
from motionenv.errors import MotionError

# Stores in which an object appears whole or not at all when its upload ends; renaming there is copying.
_WHOLE = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "memory", "oci", "oss"}
#: How the names of folders of unfinished files begin, in a data set on this machine.
MAKING = ".making-"


class Store:
    """A folder of files that are written whole or not at all.

    Args:
        url: a path, or a URL that `fsspec` knows, such as `s3://bucket/folder`.
        options: of the file system, such as `{"endpoint_url": ...}` for S3; None takes `fsspec`'s own configuration.

    Raises:
        MotionError: no such kind of URL, or a package that it needs is missing; says which.
    """

    def __init__(self, url: str | os.PathLike, options: dict[str, Any] | None = None) -> None:
        self.url, self.options = os.fspath(url).rstrip("/"), options or {}
        try:
            import fsspec

            self.files, self.root = fsspec.core.url_to_fs(self.url, **self.options)
        except ImportError as error:
            raise MotionError(f"can't write to {self.url}: {error}; pip install 'motionenv[data]'") from None
        except ValueError as error:
            raise MotionError(f"can't write to {self.url}: {error}") from None
        protocol = self.files.protocol
        self.protocols = {protocol} if isinstance(protocol, str) else set(protocol)
        self.local = Path(self.root) if "file" in self.protocols else None

    def __reduce__(self):
        return Store, (self.url, self.options)

    def place(self, path: str) -> str:
        """The file system's name of a `path` in the store."""
        return f"{self.root}/{path}"

    def names(self, folder: str) -> list[str]:
        """Names of the files and folders in a `folder`, in order; none if there is no such folder."""
        self.files.invalidate_cache()
        try:
            with _told(self.url):
                listed = self.files.ls(self.place(folder) if folder else self.root, detail=False)
        except FileNotFoundError:
            return []
        return sorted(name.rstrip("/").rsplit("/", 1)[-1] for name in listed)

    def read(self, path: str) -> bytes | None:
        """The content of the file at `path`; None if there is none."""
        try:
            with _told(self.url):
                return self.files.cat_file(self.place(path))
        except FileNotFoundError:
            return None

    def read_all(self, paths: list[str]) -> list[bytes]:
        """The contents of the files at `paths`, in the order of their names, read at once where the store can.

        Raises:
            OSError: one can't be read.
        """
        if not paths:
            return []
        with _told(self.url):
            found = self.files.cat([self.place(path) for path in paths])
        return [content for _, content in sorted(found.items())]

    def write(self, path: str, content: bytes) -> None:
        """Write a file of some `content` at `path`, whole or not at all.

        Raises:
            OSError: it can't be written.
        """
        if self.local is None:
            self._send(path, lambda place: self.files.pipe_file(place, content))
            return
        with self.scratch() as folder:
            (folder / "part").write_bytes(content)
            self.put(folder / "part", path)

    def put(self, file: Path, path: str) -> None:
        """Move a local `file` to `path` in the store, which it reaches whole or not at all, on a disk that kept it.

        Raises:
            OSError: it can't be written.
        """
        if self.local is None:
            self._send(path, lambda place: self.files.put_file(str(file), place))
            return
        target = self.local / path
        target.parent.mkdir(parents=True, exist_ok=True)
        _sync(file)
        os.replace(file, target)
        _sync(target.parent)

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """An empty folder for unfinished files, on the same disk as a local store, that is gone afterwards."""
        if self.local is not None:
            self.local.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=MAKING, dir=self.local, ignore_cleanup_errors=True) as name:
            with _in_use(Path(name)):
                files = Path(name) / "files"
                files.mkdir()
                yield files

    def sweep(self) -> None:
        """Delete the scratch folders of a local store whose processes were killed."""
        if self.local is None:
            return
        for folder in self.local.glob(f"{MAKING}*"):
            if not _is_in_use(folder):
                shutil.rmtree(folder, ignore_errors=True)

    def _send(self, path: str, write) -> None:
        """Write elsewhere by `write(place)`, under another name first where files could be seen half-written."""
        place = self.place(path)
        with _told(self.url):
            if self.protocols & _WHOLE:
                write(place)
                return
            part = f"{place}.{uuid.uuid4().hex}.part"
            self.files.makedirs(place.rsplit("/", 1)[0], exist_ok=True)
            write(part)
            self.files.mv(part, place)


@contextmanager
def _told(url: str) -> Iterator[None]:
    """Turn the many errors of stores' libraries into OSError, with the store's `url`."""
    try:
        yield
    except FileNotFoundError:
        raise
    except Exception as error:
        raise OSError(f"{url}: {error or type(error).__name__}") from error


def _sync(path: Path) -> None:
    """Wait until a file or folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _in_use(folder: Path) -> Iterator[None]:
    """Hold a lock in a scratch folder, which the system lets go when this process ends, however it ends."""
    with open(folder / "locking", "wb") as file:
        with suppress(OSError):  # no locks here: nobody will sweep this folder
            lock(file)
            os.rename(folder / "locking", folder / "lock")  # only now: who finds it must find it locked
        yield


def _is_in_use(folder: Path) -> bool:
    """Whether a process works in a scratch folder, as far as can be told."""
    try:
        with open(folder / "lock", "r+b") as file:
            return not lock(file, wait=False)
    except OSError:
        return True
