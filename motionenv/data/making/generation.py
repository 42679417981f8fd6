"""Making data sets: `generate`."""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from motionenv.data.formats import format_of
from motionenv.data.formats.card import card
from motionenv.data.making import manifest
from motionenv.data.making.engine import run
from motionenv.data.samples import Sampler
from motionenv.data.specification import Specification
from motionenv.data.store import Store
from motionenv.errors import MotionError
from motionenv.render.sensors.augmentation import Augmentation


@dataclass(frozen=True)
class Made:
    """Result of `generate`.

    Attributes:
        shards: numbers of the shards that it made.
        skipped: numbers of shards that were there already.
        failed: reasons, by number, for shards that couldn't be made.
        missing: number of the set's shards that aren't there yet.
        frames, bytes: of the shards that it made.
        interrupted: whether it was stopped by Ctrl-C.
    """

    shards: tuple[int, ...]
    skipped: tuple[int, ...]
    failed: dict[int, str]
    missing: int
    frames: int
    bytes: int
    interrupted: bool

    @property
    def complete(self) -> bool:
        """Whether the whole set is there."""
        return not self.missing


@dataclass(frozen=True)
class _Job:
    """Arguments of a worker that makes shards."""

    content: str  # of the specification, in JSON
    folder: str
    form: str


def generate(
    spec: Specification, out: str | Path, shards: Iterable[int] | None = None, resume: str = "if-possible", *,
    format: str = "webdataset", workers: int | None = None,
    on_shard: Callable[[dict], object] | None = None,
) -> Made:  # fmt: skip
    """Make a data set, or what is missing of it.

    A script that calls this with more than one worker needs `if __name__ == "__main__":`, as Python's processes do.

    Args:
        spec: what it shows.
        out: a folder.
        shards: numbers of the shards to make, as for one of several jobs that share the work; None makes all. Whoever
            finishes the last one describes the whole.
        resume: "never", "always" or "if-possible": whether to go on with what is in `out`.
        format: one of `motionenv.data.FORMATS`.
        workers: processes; None is one for each core.
        on_shard: called with each row of the manifest as it is written.

    Returns:
        What was made. Shards that failed are in it, with the reason; the others are whole, and a later call makes the
        rest.

    Raises:
        MotionError: `out` holds another data set, `resume` forbids it, no such shard, format, or background.
    """
    store, form = Store(out), format_of(format)
    form.check(spec)
    if spec.pictures.background != "black":
        Augmentation(spec.pictures.background)  # raises before anything is written
    wanted = sorted(set(range(spec.shards) if shards is None else shards))
    for shard in wanted[:1] + wanted[-1:]:
        spec.range_of(shard)
    try:
        manifest.begin(store, spec, format, resume)
        before = manifest.done(store, spec)
    except OSError as error:
        raise MotionError(f"can't write to {store.folder}: {error}") from error
    todo = [shard for shard in wanted if shard not in before]
    job = _Job(spec.json(), str(store.folder), format)
    outcome = run(partial(make_shard, job), todo, workers=workers, on_done=on_shard)
    return _concluded(store, spec, format, wanted, before, outcome)


def _concluded(store: Store, spec: Specification, form: str, wanted: list[int], before: set[int], outcome) -> Made:
    """The result by the manifest alone; describes the whole set if nothing is missing."""
    there = manifest.done(store, spec)
    failed = {shard: why for shard, why in outcome.failed.items() if shard not in there}
    missing = spec.shards - len(there)
    if not missing:
        finish(store, spec, form)
    made = [row for shard, row in outcome.done.items() if shard in there]
    return Made(
        tuple(sorted(row["shard"] for row in made)), tuple(shard for shard in wanted if shard in before),
        dict(sorted(failed.items())), missing, sum(row["frames"] for row in made),
        sum(file["bytes"] for row in made for file in row["files"]), outcome.interrupted,
    )  # fmt: skip


def finish(store: Store, spec: Specification, form: str) -> None:
    """Describe the data set of `spec` in a `store` and the format `form`, of which all shards are done."""
    rows = manifest.read_rows(store, spec)
    format_of(form).finish(store, rows, spec)
    store.write("README.md", card(spec, form).encode())
    store.sweep()


def make_shard(job: _Job, shard: int) -> dict[str, Any]:
    """Make a `shard` of a `job` unless it is there; returns its row of the manifest."""
    sampler = _sampler(job.content)
    spec, store, form = sampler.spec, Store(job.folder), format_of(job.form)
    row = manifest.read_row(store, spec, shard)
    if row is not None:
        return row
    whole = spec.range_of(shard)
    with store.scratch() as folder:
        form.write(sampler.samples(whole.start, whole.stop), folder, shard, spec)
        files = [_described(file, folder) for file in sorted(folder.rglob("*")) if file.is_file()]
        for file in files:
            store.put(folder / file["path"], file["path"])
    return manifest.write_row(store, spec, shard, files)


@lru_cache(maxsize=2)
def _sampler(content: str) -> Sampler:
    return Sampler(Specification.of(json.loads(content)))


def _described(file: Path, folder: Path) -> dict[str, Any]:
    """Path, size and SHA-256 of a file."""
    with file.open("rb") as content:
        digest = hashlib.file_digest(content, "sha256").hexdigest()
    return {"path": file.relative_to(folder).as_posix(), "bytes": file.stat().st_size, "sha256": digest}


def verify(out: str | Path) -> dict[str, str]:
    """Compare every file of the data set in `out` with the manifest; the problems by path, none if all is well.

    Args:
        out: folder of the data set.

    Raises:
        MotionError: there is no data set.
    """
    store = Store(out)
    spec, _ = manifest.read_head(store)
    wrong: dict[str, str] = {}
    for shard in range(spec.shards):
        row = manifest.read_row(store, spec, shard)
        if row is None:
            wrong[f"shard {shard}"] = "isn't made yet"
            continue
        for file in row["files"]:
            content = store.read(file["path"])
            if content is None:
                wrong[file["path"]] = "is gone"
            elif hashlib.sha256(content).hexdigest() != file["sha256"]:
                wrong[file["path"]] = f"differs from what was written ({len(content)} of {file['bytes']} bytes)"
    return wrong
