"""Files by content in a store that many machines share, with copies in the data folder."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motionenv.data import Store as Objects
from service.jobs.file_store import FileStore, Incoming
from service.jobs.store import Full, Unreachable

_BLOCK = 1 << 22  # bytes that are copied at a time
_KEPT = 600.0  # [s] for which a copy is kept at least: somebody may have just asked for it


class SharedFiles(FileStore):
    """Files in a shared store at a `url` of `fsspec`'s; `folder` holds copies of up to `cache` bytes.

    `place`, `fetch`, `remove` and `all` raise `Unreachable` if the store doesn't answer.
    """

    def __init__(self, url: str, folder: Path, reserve: int, cache: int) -> None:
        super().__init__(folder, reserve)
        self.objects, self.cache = Objects(url, {"use_listings_cache": False}), cache  # others change it too

    def place(self, file: Path, sha: str) -> None:
        with _answering():
            if not self.objects.files.exists(self.objects.place(_name(sha))):
                self._send(file if file.exists() else self.path(sha), sha)
        if file.exists():
            super().place(file, sha)

    def _send(self, file: Path, sha: str) -> None:
        """Put a file into the shared store; where that is a folder, it is moved there from a copy."""
        if self.objects.local is None:
            self.objects.put(file, _name(sha))
            return
        with self.objects.scratch() as folder:
            shutil.copyfile(file, folder / sha)
            self.objects.put(folder / sha, _name(sha))

    def fetch(self, sha: str) -> Path:
        path = self.path(sha)
        try:
            os.utime(path)
        except FileNotFoundError:
            self._get(sha)
        return path

    def _get(self, sha: str) -> None:
        incoming = Incoming(self._incoming)
        try:
            with _answering(), self.objects.files.open(self.objects.place(_name(sha)), "rb") as source:
                while block := source.read(_BLOCK):
                    incoming.write(block)
            if incoming.close() != sha:
                raise Unreachable(f"the store gave another file than {sha}")
            super().place(incoming.path, sha)
        finally:
            incoming.discard()

    def remove(self, sha: str) -> None:
        with _answering():
            try:
                self.objects.files.rm_file(self.objects.place(_name(sha)))
            except FileNotFoundError:
                pass
        super().remove(sha)

    def all(self) -> list[str]:
        with _answering():
            return [sha for folder in self.objects.names("files") for sha in self.objects.names(f"files/{folder}")]

    def trim(self) -> None:
        """Remove the copies that were used longest ago, until those that are left fit into the cache."""
        found = sorted((path.stat().st_mtime, path.stat().st_size, path) for path in self.paths())
        size = sum(bytes_ for _, bytes_, _ in found)
        for used, bytes_, path in found:
            if size <= self.cache or used > time.time() - _KEPT:
                return
            path.unlink(missing_ok=True)
            size -= bytes_


def _name(sha: str) -> str:
    return f"files/{sha[:2]}/{sha}"


@contextmanager
def _answering() -> Iterator[None]:
    """Turn the many errors of a store that doesn't answer into `Unreachable`; a file that isn't there is another."""
    try:
        yield
    except (FileNotFoundError, Full, Unreachable):
        raise
    except Exception as error:
        raise Unreachable from error
