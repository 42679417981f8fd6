"""Files called by their content's SHA-256: equal uploads are kept once, and none is ever half there."""

import contextlib
import errno
import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.jobs.store import Full

_CHUNK = 1 << 20
_RESERVE = 4 << 20  # bytes that are given up so that jobs can be ended and removed on a full disk
_STALE = 3600.0  # [s] after which what is still being received isn't


class Blobs:
    """A folder of files by content.

    Args:
        folder: of all that jobs keep; made when missing.
        reserve: bytes of disk that stay free.
    """

    def __init__(self, folder: Path, reserve: int):
        self.folder, self.reserve = folder, reserve
        self._incoming, self._ballast = folder / "incoming", folder / "ballast"
        self._incoming.mkdir(parents=True, exist_ok=True)

    def path(self, sha: str) -> Path:
        """Where the file with this SHA-256 is, or would be."""
        return self.folder / "blobs" / sha[:2] / sha

    def receive(self) -> "Incoming":
        """A file that is about to come.

        Raises:
            Full: the disk is full.
        """
        with telling_full():
            return Incoming(self._incoming)

    def check_room(self, size: int = 0) -> None:
        """Refuse what would take up the reserve.

        Args:
            size: bytes that are wanted.

        Raises:
            Full: there is less room.
        """
        if shutil.disk_usage(self.folder).free - size < self.reserve:
            raise Full

    def place(self, file: Path, sha: str) -> None:
        """Move a file, whose SHA-256 is `sha`, to where it belongs.

        Raises:
            Full: the disk is full.
        """
        with telling_full():
            self.path(sha).parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, self.path(sha))

    def remove(self, sha: str) -> None:
        """Remove a file, if it is there."""
        self.path(sha).unlink(missing_ok=True)

    def all(self) -> list[str]:
        """SHA-256 of every file."""
        return [path.name for path in self.folder.glob("blobs/??/*")]

    def sweep_incoming(self) -> None:
        """Remove what was being received when the service was killed."""
        for path in self._incoming.iterdir():
            with contextlib.suppress(FileNotFoundError):
                if time.time() - path.stat().st_mtime > _STALE:
                    path.unlink()

    def load_ballast(self) -> None:
        """Take up some disk while there is plenty, to be able to free it."""
        free = shutil.disk_usage(self.folder).free
        if self._ballast.exists() or free - _RESERVE < self.reserve:
            return
        with tempfile.NamedTemporaryFile(dir=self._incoming, delete=False) as file:
            try:
                os.posix_fallocate(file.fileno(), 0, _RESERVE)
                os.replace(file.name, self._ballast)
            except OSError:
                os.unlink(file.name)

    def drop_ballast(self) -> bool:
        """Free some disk; False where that was done before."""
        try:
            self._ballast.unlink()
        except FileNotFoundError:
            return False
        return True


class Incoming:
    """A file that comes in pieces; its methods that write belong in a thread.

    Args:
        folder: where it waits until it is placed.
    """

    def __init__(self, folder: Path):
        handle, name = tempfile.mkstemp(dir=folder)
        self.path, self.size = Path(name), 0
        self._file, self._hash = os.fdopen(handle, "wb", buffering=0), hashlib.sha256()

    def write(self, data: bytes) -> None:
        """Append.

        Raises:
            Full: the disk is full.
        """
        with telling_full():
            view = memoryview(data)
            while view:
                view = view[self._file.write(view) :]
        self._hash.update(data)
        self.size += len(data)

    def close(self) -> str:
        """The SHA-256 of all, which is on disk for good now.

        Raises:
            Full: the disk is full.
        """
        with telling_full():
            os.fchmod(self._file.fileno(), 0o444)
            os.fsync(self._file.fileno())
            self._file.close()
        return self._hash.hexdigest()

    def discard(self) -> None:
        """Remove it, unless it has been placed."""
        self._file.close()
        self.path.unlink(missing_ok=True)


def sha256(path: Path) -> str:
    """Of a file; it is on disk for good afterwards."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
        os.fsync(file.fileno())
    return digest.hexdigest()


@contextmanager
def telling_full() -> Iterator[None]:
    """Turn what the system says of a full disk into `Full`."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise Full from error
        raise
