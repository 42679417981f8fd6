"""Content-addressed files, named by their SHA-256: equal uploads are stored once, and files appear atomically."""

import contextlib
import hashlib
import os
import shutil
import tempfile
import time
from pathlib import Path

from service.jobs.store import Full, full_disk_errors

_BALLAST = 4 << 20  # bytes to free on a full disk, so that jobs can still be cancelled and removed
_STALE = 3600.0  # [s] after which an unfinished upload is abandoned


class FileStore:
    """A folder of files by content, created if missing; `reserve` bytes of the disk are kept free.

    What writes raises `Full` if the disk is full.
    """

    def __init__(self, folder: Path, reserve: int) -> None:
        self.folder, self.reserve = folder, reserve
        self._incoming, self._ballast = folder / "incoming", folder / "ballast"
        self._incoming.mkdir(parents=True, exist_ok=True)

    def path(self, sha: str) -> Path:
        """Path of the file with this SHA-256, whether it exists or not."""
        return self.folder / "file_store" / sha[:2] / sha

    def fetch(self, sha: str) -> Path:
        """Path of the file with this SHA-256; FileNotFoundError if there is none."""
        path = self.path(sha)
        path.stat()
        return path

    def receive(self) -> "Incoming":
        """Create a file to write an upload to."""
        with full_disk_errors():
            return Incoming(self._incoming)

    def check_room(self, size: int = 0) -> None:
        """Raise `Full` if writing `size` bytes would touch the reserve."""
        if shutil.disk_usage(self.folder).free - size < self.reserve:
            raise Full

    def place(self, file: Path, sha: str) -> None:
        """Move a file, whose SHA-256 is `sha`, into the store."""
        with full_disk_errors():
            self.path(sha).parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, self.path(sha))

    def remove(self, sha: str) -> None:
        """Remove a file, if it exists."""
        self.path(sha).unlink(missing_ok=True)

    def all(self) -> list[str]:
        """SHA-256 of every file."""
        return [path.name for path in self.folder.glob("file_store/??/*")]

    def sweep_incoming(self) -> None:
        """Remove unfinished uploads of a service that was killed."""
        for path in self._incoming.iterdir():
            with contextlib.suppress(FileNotFoundError):
                if time.time() - path.stat().st_mtime > _STALE:
                    path.unlink()

    def load_ballast(self) -> None:
        """Reserve some disk space that `drop_ballast` can free."""
        free = shutil.disk_usage(self.folder).free
        if self._ballast.exists() or free - _BALLAST < self.reserve:
            return
        with tempfile.NamedTemporaryFile(dir=self._incoming, delete=False) as file:
            try:
                os.posix_fallocate(file.fileno(), 0, _BALLAST)
                os.replace(file.name, self._ballast)
            except OSError:
                os.unlink(file.name)

    def drop_ballast(self) -> bool:
        """Free the reserved space; False if it was freed before."""
        try:
            self._ballast.unlink()
        except FileNotFoundError:
            return False
        return True


class Incoming:
    """A file that is being received in a folder for unfinished ones; its methods block, and raise `Full`."""

    def __init__(self, folder: Path) -> None:
        handle, name = tempfile.mkstemp(dir=folder)
        self.path, self.size = Path(name), 0
        self._file, self._hash = os.fdopen(handle, "wb", buffering=0), hashlib.sha256()

    def write(self, data: bytes) -> None:
        """Append."""
        with full_disk_errors():
            view = memoryview(data)
            while view:
                view = view[self._file.write(view) :]
        self._hash.update(data)
        self.size += len(data)

    def close(self) -> str:
        """Sync the file to disk and return its SHA-256."""
        with full_disk_errors():
            os.fchmod(self._file.fileno(), 0o444)
            os.fsync(self._file.fileno())
            self._file.close()
        return self._hash.hexdigest()

    def discard(self) -> None:
        """Remove the file, unless it was placed."""
        self._file.close()
        self.path.unlink(missing_ok=True)


def sha256(path: Path) -> str:
    """SHA-256 of a file, which is synced to disk."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
        os.fsync(file.fileno())
    return digest.hexdigest()
