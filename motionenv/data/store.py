"""Storage of data sets: a folder, which any number of processes and machines may fill."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from motionenv._core.locks import lock
from motionenv.errors import MotionError

#: How the names of folders of unfinished files begin, in a data set.
MAKING = ".making-"


class Store:
    """A folder of files that are written whole or not at all.

    Args:
        folder: its path; created with the first file.

    Raises:
        MotionError: a URL.
    """

    def __init__(self, folder: str | os.PathLike) -> None:
        if "://" in str(folder):
            raise MotionError(f"a data set is made in a folder, got {folder}: copy it there afterwards")
        self.folder = Path(folder)

    def names(self, folder: str) -> list[str]:
        """Names of the files and folders in a `folder`, in order; none if there is no such folder."""
        try:
            return sorted(os.listdir(self.folder / folder))
        except FileNotFoundError:
            return []

    def read(self, path: str) -> bytes | None:
        """The content of the file at `path`; None if there is none."""
        try:
            return (self.folder / path).read_bytes()
        except FileNotFoundError:
            return None

    def write(self, path: str, content: bytes) -> None:
        """Write a file of some `content` at `path`, whole or not at all.

        Raises:
            OSError: it can't be written.
        """
        with self.scratch() as folder:
            (folder / "part").write_bytes(content)
            self.put(folder / "part", path)

    def put(self, file: Path, path: str) -> None:
        """Move a local `file` to `path` in the store, which it reaches whole or not at all, on a disk that kept it.

        Raises:
            OSError: it can't be written.
        """
        target = self.folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        _sync(file)
        os.replace(file, target)
        _sync(target.parent)

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """An empty folder for unfinished files, on the same disk, that is gone afterwards."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=MAKING, dir=self.folder, ignore_cleanup_errors=True) as name:
            with _in_use(Path(name)):
                files = Path(name) / "files"
                files.mkdir()
                yield files

    def sweep(self) -> None:
        """Delete the scratch folders whose processes were killed."""
        for folder in self.folder.glob(f"{MAKING}*"):
            if not _is_in_use(folder):
                shutil.rmtree(folder, ignore_errors=True)


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
