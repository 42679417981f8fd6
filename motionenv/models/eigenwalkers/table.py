"""The walks that a model of walkers learns from: rows of 225 coefficients, of as many walks as anyone has.

Above `MOST` bytes, rows lie in temporary files, of which blocks are read.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.cycles.stored import CycleFiles, Stored
from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import PARTS, FourierWalker, centred, in_phase, mirrored
from motionenv.models.storage.blocks import block_slices
from motionenv.types import MARKERS, Markers, Motion

COEFFICIENTS = (len(PARTS), len(MARKERS), 3)  #: shape of a walker's coefficients
MOST = 2**26  # bytes of rows in memory
BLOCK = 2**23  # bytes of rows that are worked on at a time: some of the work takes ten times as many
_FLAT = (len(PARTS) * len(MARKERS), 3)  # as which rows are stored
_AT_A_TIME = 64  # walks that are read ahead, to share them among workers


class Rows:
    """Coefficients (n, 5, 15, 3) [m] of walkers, NaN where unknown, in an array or in files; read in blocks.

    Args:
        stored: (N, 75, 3), an array or `motionenv.cycles.CycleFiles`.
        which: (n,) ascending numbers of the rows; None is all.
        both: whether the walkers' mirror images come after them.
    """

    def __init__(self, stored: Any, which: np.ndarray | None = None, both: bool = False) -> None:
        self._stored = stored
        self._which = np.arange(stored.shape[0]) if which is None else which
        self._both = both

    def __len__(self) -> int:
        return (1 + self._both) * len(self._which)

    def take(self, which: np.ndarray) -> "Rows":
        """Some of the rows, by their ascending numbers (n,) or a mask; of a table without mirror images."""
        return Rows(self._stored, self._which[which])

    def with_mirror_images(self) -> "Rows":
        """The rows, and after them their mirror images."""
        return Rows(self._stored, self._which, both=True)

    def __getitem__(self, part: slice) -> np.ndarray:
        """Coefficients (k, 5, 15, 3) of a slice of the rows."""
        which, half = np.arange(*part.indices(len(self))), len(self._which)
        own, images = which[which < half], which[which >= half] - half
        return np.concatenate([self._read(self._which[own]), mirrored(self._read(self._which[images]))])

    def blocks(self) -> Iterator[np.ndarray]:
        """Coefficients (k, 5, 15, 3) of all rows in order, a block at a time."""
        for part in block_slices((len(self), *_FLAT), BLOCK):
            yield self[part]

    def _read(self, which: np.ndarray) -> np.ndarray:
        if isinstance(self._stored, np.ndarray):
            return self._stored[which].reshape(-1, *COEFFICIENTS)
        runs = np.split(which, np.flatnonzero(np.diff(which) != 1) + 1)
        read = [self._stored[int(run[0]) : int(run[-1]) + 1] for run in runs if len(run)]
        return np.concatenate([np.empty((0, *_FLAT)), *read]).reshape(-1, *COEFFICIENTS)


@dataclass(frozen=True)
class Columns:
    """Some of the 225 entries of rows as cycles (n, entries, 1), for `motionenv.models.fpca`: shape, and slices."""

    rows: Rows
    shown: np.ndarray  # (225,) which entries

    @property
    def shape(self) -> tuple[int, int, int]:
        """(n, entries, 1)."""
        return len(self.rows), int(self.shown.sum()), 1

    def __getitem__(self, part: slice) -> np.ndarray:
        """Values (k, entries, 1) of a slice."""
        return self.rows[part].reshape(-1, self.shown.size)[:, self.shown, None]


@dataclass(frozen=True)
class Table:
    """Walks that a model learns from, or people's means of them."""

    rows: Rows  # (n, 5, 15, 3) [m]
    frequencies: np.ndarray  # (n,) strides per second [Hz]
    people: tuple[str, ...]  # (n,) the person's label

    def __len__(self) -> int:
        return len(self.people)


def read_walks(
    walks: Iterable[FourierWalker | Markers | Motion], subjects: Sequence | None, folder: Path,
    executor: Executor | None = None,
) -> Table:  # fmt: skip
    """The Fourier representations of walks, each of which is read when its turn comes.

    Args:
        walks: as of `FourierModel.fit`.
        subjects: the person's label of each; None takes all for different people.
        folder: for what memory doesn't hold.
        executor: computes the representations; None is this process.

    Raises:
        MotionError: no walks, or not one label per walk; see also `fourier_walker`.
    """
    frequencies: list[float] = []

    def blocks() -> Iterator[np.ndarray]:
        waiting = iter(walks)
        while some := list(islice(waiting, _AT_A_TIME)):
            made = list(map(_walker, some) if executor is None else executor.map(_walker, some))
            frequencies.extend(walker.frequency for walker in made)
            yield np.stack([walker.coefficients for walker in made])

    rows = _stored(blocks(), folder / "walks")
    if not len(rows):
        raise MotionError("fit needs walks of several people, got none")
    labels = [str(s) for s in (range(len(rows)) if subjects is None else subjects)]
    if len(labels) != len(rows):
        raise MotionError(f"fit needs a subject for each walk, got {len(rows)} walks and {len(labels)} subjects")
    return Table(rows, np.array(frequencies), tuple(labels))


def _walker(walk) -> FourierWalker:
    return walk if isinstance(walk, FourierWalker) else fourier_walker(walk)


def mean_walkers(table: Table, people: Sequence[str], folder: Path) -> Table:
    """Means over the walks that have the same label in `people` (n,), in the order in which labels come first.

    Of coefficients, over the walks that know them; of frequencies, geometric.
    """
    labels = tuple(dict.fromkeys(people))
    number = {label: i for i, label in enumerate(labels)}
    who = np.array([number[label] for label in people], dtype=np.intp)
    count = np.bincount(who, minlength=len(labels))
    frequencies = np.exp(np.bincount(who, np.log(table.frequencies), len(labels)) / count)
    if (np.diff(who) >= 0).all():  # each person's walks come together: one block of people at a time
        rows = _stored(_means_in_order(table, who), folder / "people")
    else:
        rows = _stored(_means_of_few(table, who, len(labels)), folder / "people")
    return Table(rows, frequencies, labels)


def _means_in_order(table: Table, who: np.ndarray) -> Iterator[np.ndarray]:
    """Means of blocks of people, whose numbers `who` (n,) ascend; the last person of a block may go on in the next."""
    total, known = np.zeros((1, *COEFFICIENTS)), np.zeros((1, *COEFFICIENTS), np.int32)
    current = 0
    for w, mine in each(pair, table.rows, who):
        sums, seen = _sums(w, mine - current, int(mine[-1] - current) + 1)
        sums[:1] += total
        seen[:1] += known
        yield _mean(sums[:-1], seen[:-1])
        total, known, current = sums[-1:], seen[-1:], int(mine[-1])
    yield _mean(total, known)


def _means_of_few(table: Table, who: np.ndarray, people: int) -> Iterator[np.ndarray]:
    """Means of all people, whose walks come in any order: memory holds their sums."""
    total, known = np.zeros((people, *COEFFICIENTS)), np.zeros((people, *COEFFICIENTS), np.int32)
    for w, mine in each(pair, table.rows, who):
        present, own = np.unique(mine, return_inverse=True)
        sums, seen = _sums(w, own, len(present))
        total[present] += sums
        known[present] += seen
    for part in block_slices((people, *_FLAT), BLOCK):
        yield _mean(total[part], known[part])


def _sums(w: np.ndarray, who: np.ndarray, people: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums of the known coefficients of each person's walks, and their numbers (people, 5, 15, 3)."""
    sums, seen, known = np.zeros((people, *COEFFICIENTS)), np.zeros((people, *COEFFICIENTS), np.int32), np.isfinite(w)
    np.add.at(sums, who, np.where(known, w, 0.0))
    np.add.at(seen, who, known)
    return sums, seen


def _mean(sums: np.ndarray, seen: np.ndarray) -> np.ndarray:
    mean = np.full(sums.shape, np.nan)
    np.divide(sums, seen, out=mean, where=seen > 0)
    return centred(in_phase(mean)) if len(mean) else mean


def _stored(blocks: Iterable[np.ndarray], path: Path) -> Rows:
    """Rows of blocks (k, 5, 15, 3) of coefficients: in memory, or from `MOST` bytes on in a file."""
    kept: list[np.ndarray] = []
    waiting = iter(blocks)
    for block in waiting:
        kept.append(block)
        if sum(some.nbytes for some in kept) > MOST:
            return _in_file(kept, waiting, path)
    return Rows(np.concatenate(kept).reshape(-1, *_FLAT) if kept else np.empty((0, *_FLAT)))


def _in_file(kept: list[np.ndarray], waiting: Iterator[np.ndarray], path: Path) -> Rows:
    """Rows in a file, of blocks that were kept and of those that come."""
    count = 0
    with open(path, "wb") as file:
        for blocks in (kept, waiting):
            for block in blocks:
                file.write(np.ascontiguousarray(block, dtype=np.float64).data)
                count += len(block)
            kept.clear()
    return Rows(CycleFiles([Stored(str(path), 0, (count, *_FLAT), np.dtype(np.float64))]))


def pair(w: np.ndarray, more: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A block's coefficients `w` and values of the same rows, as `each` gives them."""
    return w, more


def each(work: Callable[..., Any], rows: Rows, *more: np.ndarray) -> Iterator[Any]:
    """work(coefficients, *values of the same rows) of each block of `rows`; `more` are arrays (n, …)."""
    done = 0
    for w in rows.blocks():
        yield work(w, *(values[done : done + len(w)] for values in more))
        done += len(w)
