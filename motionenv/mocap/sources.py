"""Public motion capture that can be downloaded by name: description, licence, and safe download.

`sources.json` holds the URL, size and SHA-256 of every file. The URLs refer to immutable content (a commit, or a git
blob by its hash).
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from motionenv._core.validation import checked_choice
from motionenv.errors import MotionError

__all__ = ["Source", "SourceFile", "download", "find_source", "list_sources"]

_RETRIES = 2  # retries, for dropped connections and failing proxies
_SECONDS = 60  # time-out without data from the server
_RAW = {"Accept": "application/vnd.github.raw+json, */*"}  # by default the blob API sends JSON


@dataclass(frozen=True)
class SourceFile:
    """One file of a source: `path` relative to the download folder, `url`, `sha256` (hex), size in `bytes`."""

    path: str
    url: str
    sha256: str
    bytes: int


@dataclass(frozen=True)
class Source:
    """Files under a `name`: `title`, `home` page, `licence` in a sentence, `acknowledgement` to print, `files`."""

    name: str
    title: str
    home: str
    licence: str
    acknowledgement: str
    files: tuple[SourceFile, ...]

    @property
    def bytes(self) -> int:
        """Total size of the files."""
        return sum(file.bytes for file in self.files)

    def __str__(self) -> str:
        """Summary to read before downloading: contents, size, licence, acknowledgement."""
        return (
            f"{self.name}: {self.title}\n"
            f"  size             {len(self.files)} files, {self.bytes / 1e6:.1f} MB\n"
            f"  licence          {self.licence}\n"
            f"  acknowledgement  {self.acknowledgement}\n"
            f"  home             {self.home}"
        )


@cache
def list_sources() -> tuple[Source, ...]:
    """Every source that `download` knows. `str(source)` describes contents, size and licence."""
    text = files("motionenv.mocap").joinpath("sources.json").read_text(encoding="utf-8")
    return tuple(
        Source(name, **{**entry, "files": tuple(SourceFile(path, **file) for path, file in entry["files"].items())})
        for name, entry in sorted(json.loads(text).items())
    )


def find_source(name: str) -> Source:
    """The source named `name`.

    Raises:
        MotionError: there is none; lists the available ones.
    """
    named = {source.name: source for source in list_sources()}
    return named[checked_choice(name, "the motion-capture source", named)]


def download(
    source: Source | str, to: Path | str, *, base_url: str | None = None,
    on_file: Callable[[SourceFile], None] = lambda file: None,
) -> list[Path]:  # fmt: skip
    """Fetch the files of `source` (or its name) below the folder `to`, made when missing; their paths, in order.

    A file that is there with the right SHA-256 is not fetched again, so a run that broke off goes on where it
    stopped; one with other content is replaced. Each file appears whole and checked, or not at all; a transfer
    that fails is tried twice more. `base_url` names a mirror with the same relative paths (the SHA-256 still
    must agree). `on_file` is called with each file once it is there, for a progress bar.

    Raises:
        MotionError: unknown name; the network or server failed, or sent other bytes; `to` can't be written.
    """
    source = find_source(source) if isinstance(source, str) else source
    fetch = _fetcher(source, Path(to), base_url)
    paths = []
    for file in source.files:
        paths.append(fetch(file))
        on_file(file)
    return paths


def _fetcher(source: Source, to: Path, base_url: str | None) -> Callable[[SourceFile], Path]:
    """A function that downloads one file of `source` with pooch and reports failures as MotionError."""
    import pooch
    import requests

    pooch.get_logger().setLevel("WARNING")  # log lines on stderr would break the caller's progress bar
    registry = pooch.create(
        path=to, base_url=f"{base_url.rstrip('/')}/" if base_url else "",
        registry={file.path: f"sha256:{file.sha256}" for file in source.files},
        urls=None if base_url else {file.path: file.url for file in source.files}, retry_if_failed=_RETRIES,
    )  # fmt: skip

    def fetch(file: SourceFile) -> Path:
        url = registry.get_url(file.path)
        again = f"no partial file was left; repeat the download into {to} to continue"
        try:
            return Path(registry.fetch(file.path, downloader=_stream))
        except requests.RequestException as error:
            raise MotionError(f"can't fetch {url}: {error}; {again}") from error
        except ValueError as error:  # raised by pooch if the SHA-256 differs
            raise MotionError(f"{url} sent other bytes than expected: {error}; {again}") from error
        except OSError as error:
            problem = f"can't write {to / file.path}: {error.strerror}"
            raise MotionError(f"{problem}; choose a writable folder with free space") from error

    return fetch


def _stream(url: str, path: str, _pooch) -> None:
    """Write the content of `url` to `path`. pooch's own downloader doesn't close the socket after an HTTP error."""
    import requests

    with requests.get(url, headers=_RAW, timeout=_SECONDS, stream=True) as response, open(path, "wb") as out:
        response.raise_for_status()
        for chunk in response.iter_content(2**16):
            out.write(chunk)
