"""Save the library's outputs for fixed inputs before a change, and compare them after it.

    motionenv bench outputs save before.npz [--only TEXT] [--mocap FOLDER]
    motionenv bench outputs compare before.npz [--only TEXT] [--mocap FOLDER] [--tolerance 1e-9]

The other modules of this folder define the outputs. Each is a set of arrays, bytes and texts. `compare` prints a line
for each output that differs, is new, is missing or raises, and exits with status 1 if there is any. Arrays are
identical if they have the same type and bytes. Run both commands on the same machine with the same number of cores: the
order of BLAS's sums depends on its threads, which changes lifting and fits of trees by about 1e-14.
"""

import dataclasses
import functools
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import MOCAP, Arguments, scratch
from benchmarks.outputs import estimating, rendering, serving  # noqa: F401 (they register outputs)
from benchmarks.outputs.cases import CAPTURED, OUTPUTS

_NUMBERS = "biuf"
_APART = " | "  # between the name of an output and that of one of its arrays


def arrays(value: Any, path: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield the numbers, texts and bytes in `value` as arrays, each with its path.

    Raises:
        TypeError: an object that an array can't hold.
    """
    if (array := _as_array(value)) is not None:
        yield path, array
        return
    for key, part in _parts(value, path):
        yield from arrays(part, f"{path}/{key}")


def _parts(value: Any, path: str) -> Iterable[tuple[Any, Any]]:
    """The public fields of a dataclass, or the items of a mapping or a list."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if not field.name.startswith("_")]
        return [(name, getattr(value, name)) for name in names]
    if isinstance(value, Mapping):
        return value.items()
    if isinstance(value, list | tuple):
        return enumerate(value)
    raise TypeError(f"{path or 'the output'} is of type {type(value).__name__}, which can't be kept")


def _as_array(value: Any) -> np.ndarray | None:
    """`value` as an array if it is bytes, text, None, numbers (None becomes NaN) or texts; otherwise None."""
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    if value is None:
        return np.array("None")
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":
            array = array.astype(np.float64)
    except (TypeError, ValueError):
        return None
    if array.dtype.kind == "U":  # NumPy makes texts of a list that mixes texts and numbers
        return array if isinstance(value, str | np.ndarray) or all(isinstance(v, str) for v in value) else None
    return array if array.dtype.kind in _NUMBERS else None


def difference(before: np.ndarray, after: np.ndarray) -> tuple[float, str]:
    """The greatest difference between two arrays, infinite if they can't be compared, and its description."""
    if (before.dtype, before.shape) != (after.dtype, after.shape):
        words = [f"{a.dtype}{a.shape}" for a in (before, after)]
        return np.inf, " → ".join(_shortened(before, after) if before.dtype.kind == after.dtype.kind == "U" else words)
    if before.tobytes() == after.tobytes():
        return 0.0, ""
    if before.dtype.kind not in _NUMBERS:
        return np.inf, " → ".join(_shortened(before, after))
    one, other = before.astype(np.float64), after.astype(np.float64)
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    apart = np.abs(np.where(same, 0.0, one) - np.where(same, 0.0, other))
    most = float(np.where(np.isnan(apart), np.inf, apart).max())
    return most, f"max |difference| {most:.3g}, {np.mean(~same):.2%} of {before.dtype}{before.shape}"


def _shortened(before: np.ndarray, after: np.ndarray) -> list[str]:
    """Both texts, or arrays of texts, shortened."""
    return [text if len(text := str(a.tolist())) <= 60 else f"{text[:57]}..." for a in (before, after)]


def computed(work: Mapping[str, Callable[[], Any]]) -> tuple[dict[str, dict[str, np.ndarray]], dict[str, str]]:
    """The arrays of each output, and the errors of those that raised."""
    found, failed = {}, {}
    for name, make in work.items():
        try:
            found[name] = dict(arrays(make()))
        except Exception as error:  # noqa: BLE001 any error counts as a difference
            failed[name] = f"{type(error).__name__}: {error}"
    return found, failed


def save(path: Path, work: Mapping[str, Callable[[], Any]]) -> bool:
    """Write all outputs to a file; return whether none of them raised."""
    found, failed = computed(work)
    for name, error in failed.items():
        print(f"ERROR    {name}: {error}")
    flat = {f"{name}{_APART}{at}": array for name, parts in found.items() for at, array in parts.items()}
    with path.open("wb") as file:
        np.savez(file, **flat)
    print(
        f"{len(work)} outputs: {len(found)} saved, {len(failed)} raised; {path.stat().st_size / 1e6:.1f} MB in {path}"
    )
    return not failed


def read(path: Path, only: str) -> dict[str, dict[str, np.ndarray]]:
    """The saved arrays of the outputs whose names contain `only`."""
    saved: dict[str, dict[str, np.ndarray]] = {}
    with np.load(path) as file:
        for key in file.files:
            name, _, at = key.partition(_APART)
            if only in name:
                saved.setdefault(name, {})[at] = file[key]
    return saved


def changed(before: dict[str, np.ndarray], after: dict[str, np.ndarray]) -> tuple[float, str]:
    """The greatest difference between two outputs, and its path."""
    worst, words = 0.0, ""
    for at in sorted(before.keys() | after.keys()):
        if at in before and at in after:
            most, told = difference(before[at], after[at])
        else:
            most, told = np.inf, "is new" if at in after else "is missing"
        if told and (not words or most > worst):
            worst, words = most, f"{at or 'value'}: {told}"
    return worst, words


def compare(path: Path, work: Mapping[str, Callable[[], Any]], only: str, tolerance: float) -> bool:
    """Print the differences from a file; return whether there are none."""
    before = {name: parts for name, parts in read(path, only).items() if name in work or name not in CAPTURED}
    found, failed = computed(work)
    told = {name: changed(before[name], after) for name, after in found.items() if name in before}
    within = [name for name, (most, words) in told.items() if words and most <= tolerance]
    apart = [name for name, (most, words) in told.items() if most > tolerance]
    new, missing = found.keys() - before.keys(), before.keys() - found.keys() - failed.keys()
    lines = [(name, "within", told[name][1]) for name in within] + [(name, "DIFFERS", told[name][1]) for name in apart]
    lines += [(name, "ERROR", error) for name, error in failed.items()]
    lines += [(name, "NEW", "not in the file") for name in new] + [(name, "MISSING", "not made") for name in missing]
    for name, what, words in sorted(lines):
        print(f"{what:8} {name}: {words}")
    counts = f"{len(told) - len(within) - len(apart)} identical, {len(within)} within tolerance, {len(apart)} differ"
    others = f"{len(failed)} raised, {len(new)} new, {len(missing)} missing"
    print(f"{len(work.keys() | before.keys())} outputs: {counts}; {others}")
    return not (apart or failed or new or missing)


def chosen(only: str, mocap: Path) -> dict[str, Callable[[], Any]]:
    """The outputs whose names contain `only`; without motion capture, those that need none."""
    work = dict(OUTPUTS)
    if mocap.is_dir():
        work |= {name: functools.partial(make, mocap) for name, make in CAPTURED.items()}
    else:
        print(f"no motion capture at {mocap}: {len(CAPTURED)} outputs are left out; --mocap names its folder")
    return {name: make for name, make in work.items() if only in name}


def main() -> None:
    """Save or compare the outputs."""
    parser = Arguments(__doc__)
    parser.add_argument("command", choices=("save", "compare"), nargs="?", default="save")
    parser.add_argument("file", type=Path, nargs="?", default=Path("outputs.npz"), quick=scratch() / "outputs.npz")
    parser.add_argument("--only", default="", quick="metrics", help="only outputs whose names contain this text")
    parser.add_argument("--mocap", type=Path, default=MOCAP)
    parser.add_argument("--tolerance", type=float, default=0.0, help="greatest |difference| accepted")
    asked = parser.parse_args()
    began, work = time.perf_counter(), chosen(asked.only, asked.mocap)
    if asked.command == "save" or asked.quick:
        fine = save(asked.file, work)
    if asked.command == "compare" or asked.quick:
        fine = compare(asked.file, work, asked.only, asked.tolerance)
    print(f"{time.perf_counter() - began:.0f} s")
    sys.exit(not fine)


if __name__ == "__main__":
    main()
