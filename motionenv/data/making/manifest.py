"""The manifest of a data set: what it is, and which of its shards are done.

`dataset.json` holds the specification. A shard is done when its row, `manifest/000012-49152-53248.json`, is there: it
is written last. The row's name has shard, first and last index, so that a listing tells what is left to do; rows say
nothing of who made them, so that two makers of one shard write the same.
"""

import hashlib
from pathlib import Path
from typing import Any

import orjson

from motionenv.data.specification import Specification
from motionenv.data.store import Store
from motionenv.errors import MotionError

RESUME = ("never", "always", "if-possible")
_HEAD, _ROWS = "dataset.json", "manifest"


def begin(store: Store, spec: Specification, form: str, resume: str) -> None:
    """Begin the data set of `spec` in a `store`, or go on with one; a MotionError says which part differs.

    The one that is there may have fewer frames, but nothing else may differ. `resume`: "never" refuses what is there,
    "always" a store without a data set; "if-possible" takes both.
    """
    if resume not in RESUME:
        raise MotionError(f"resume must be one of {', '.join(RESUME)}, got {resume!r}")
    head, before = _head(spec, form), store.read(_HEAD)
    if before is None:
        if resume == "always":
            raise MotionError(f'there is no data set in {store.folder} to go on with: use resume="if-possible"')
        store.write(_HEAD, _json(head))
        return
    if resume == "never":
        raise MotionError(f'{store.folder} has a data set: choose another place, or resume="if-possible"')
    there = _parsed(before, store)
    if differing := sorted(_differences(there, head)):
        raise MotionError(
            f"{store.folder} has another data set: {', '.join(differing)} differ(s); choose another place, or give the "
            "same specification, format and versions"
        )
    had = int(there["specification"]["frames"])
    if spec.frames < had:
        raise MotionError(f"{store.folder} has a data set of {had} frames: give as many or more, got {spec.frames}")
    if spec.frames > had:
        store.write(_HEAD, _json(head))


def read_head(store: Store) -> tuple[Specification, str]:
    """The specification and the format of the data set in a `store`; a MotionError if there is none."""
    content = store.read(_HEAD)
    if content is None:
        raise MotionError(f"there is no data set in {store.folder}: it would have a {_HEAD}")
    head = _parsed(content, store)
    return Specification.of(head["specification"]), str(head["format"])


def done(store: Store, spec: Specification) -> set[int]:
    there = set(store.names(_ROWS))
    return {shard for shard in range(spec.shards) if row_name(spec, shard) in there}


def row_name(spec: Specification, shard: int) -> str:
    whole = spec.range_of(shard)
    return f"{shard:06d}-{whole.start}-{whole.stop}.json"


def read_row(store: Store, spec: Specification, shard: int) -> dict[str, Any] | None:
    content = store.read(f"{_ROWS}/{row_name(spec, shard)}")
    return None if content is None else orjson.loads(content)


def read_rows(store: Store, spec: Specification) -> list[dict[str, Any]]:
    """The rows of all shards of `spec` in a `store`, in order, all of which are done."""
    return [row for row in (read_row(store, spec, shard) for shard in range(spec.shards)) if row is not None]


def write_row(store: Store, spec: Specification, shard: int, files: list[dict[str, Any]]) -> dict[str, Any]:
    """Write that a `shard` of `spec` is done in a `store`, in `files` with path, bytes and sha256; returns the row."""
    whole = spec.range_of(shard)
    row = {
        "shard": shard, "start": whole.start, "stop": whole.stop, "samples": len(whole),
        "frames": len(whole) * spec.clip, "files": files, "versions": _versions(),
    }  # fmt: skip
    store.write(f"{_ROWS}/{row_name(spec, shard)}", _json(row))
    return row


def _head(spec: Specification, form: str) -> dict[str, Any]:
    from motionenv import __version__

    return {
        "specification": spec.model_dump(mode="json"), "hash": spec.hash, "format": form, "motionenv": __version__,
        "models": {name: _model_version(name) for name in spec.people.models},
    }  # fmt: skip


def _model_version(name: str) -> str:
    """Version of the package that a ready-made model comes with, or what is in a model's file."""
    from motionenv.models.registry import load, names, version

    if name in names():
        return version(name)
    load(name)  # says what is wrong with the name
    return hashlib.sha256(Path(name).read_bytes()).hexdigest()


def _differences(there: dict[str, Any], here: dict[str, Any]) -> set[str]:
    """Names of what differs between the heads of two data sets, except for the number of frames."""
    one, other = (dict(head.get("specification", {}), frames=0) for head in (there, here))
    parts = {name for name in ("format", "motionenv", "models") if there.get(name) != here.get(name)}
    for name in {*one, *other}:
        a, b = one.get(name), other.get(name)
        if isinstance(a, dict) and isinstance(b, dict):
            parts |= {f"{name}.{key}" for key in {*a, *b} if a.get(key) != b.get(key)}
        elif a != b:
            parts.add(name)
    return parts


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("motionenv", "numpy", "scipy", "numba", "pillow", "pyarrow")}


def _json(content: dict[str, Any]) -> bytes:
    return orjson.dumps(content, option=orjson.OPT_INDENT_2 | orjson.OPT_SORT_KEYS)


def _parsed(content: bytes, store: Store) -> dict[str, Any]:
    try:
        return orjson.loads(content)
    except orjson.JSONDecodeError as error:
        raise MotionError(f"{_HEAD} in {store.folder} is damaged: {error}") from None
