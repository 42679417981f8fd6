"""Work on cycles block by block, so that memory holds one block: here, or in the workers of an executor.

Blocks depend on the shape of the data only, and what they give is merged in order. So results are the same bits however
many workers there are and whatever each of them takes.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

BLOCK = 2**25  # bytes of float64 values in a block
CHUNK = 250  # cycles of a block that a thread takes, at least


@dataclass(frozen=True)
class Selected:
    """Some channels of `values` (K, P, M), an array or `motionenv.cycles.CycleFiles`; slices are arrays."""

    values: Any
    which: tuple[int, ...]

    @property
    def shape(self) -> tuple[int, int, int]:
        """(K, P, m) of the chosen channels."""
        return (*self.values.shape[:2], len(self.which))

    def __getitem__(self, part: slice) -> np.ndarray:
        """Values (k, P, m) of a slice of the cycles; NaN where missing."""
        rows = self.values[part]
        if self.which == tuple(range(rows.shape[2])):
            return rows
        return np.ascontiguousarray(rows[..., list(self.which)])

    @property
    def in_memory(self) -> bool:
        """Whether the numbers are in memory, not in files."""
        return isinstance(self.values, np.ndarray)

    def alone(self, part: slice) -> tuple["Selected", slice]:
        """A slice for another process: the numbers if they are in memory, otherwise the names of the files."""
        if self.in_memory:
            return Selected(self.values[part], self.which), slice(None)
        return self, part


def selected(values: Any, which: Sequence[int] | None = None) -> Selected:
    """The channels `which` of `values` (K, P, M), an array or files; None is all."""
    if isinstance(values, Selected):
        return values
    return Selected(values, tuple(range(values.shape[2]) if which is None else which))


def block_slices(shape: tuple[int, int, int], most: int | None = None) -> list[slice]:
    """Slices of K cycles of an array (K, P, m), each of at most `most` bytes; at least one, which may be empty.

    A cycle of more bytes is a slice of its own. By default `most` is `BLOCK`.
    """
    k, p, m = shape
    size = max(1, (BLOCK if most is None else most) // (8 * max(1, p * m)))
    return [slice(first, min(first + size, k)) for first in range(0, max(k, 1), size)]


def over(
    work: Callable, values: Selected, rows: tuple[np.ndarray, ...] = (), given: tuple = (),
    executor: Executor | None = None, some: list[slice] | None = None,
) -> Iterator:  # fmt: skip
    """work(values of a block, *rows of its cycles, *given) of every block, in order, computed here or by `executor`.

    Args:
        work: can be pickled, if the executor's workers are processes.
        values: (K, P, m).
        rows: arrays (K, …).
        given: further arguments, the same for each block.
        executor: any `concurrent.futures.Executor`; None computes each block when it is asked for.
        some: blocks, of `parts`; None is all.
    """
    every = block_slices(values.shape) if some is None else some
    if executor is None:
        for part in every:
            yield work(values[part], *(row[part] for row in rows), *given)
        return
    calls = [(work, *values.alone(part), [row[part] for row in rows], given) for part in every]
    yield from executor.map(_work, calls)


def _work(call: tuple) -> Any:
    work, values, part, rows, given = call
    return work(values[part], *rows, *given)


def merged(found: Iterable[tuple]) -> list:
    """Sums of what blocks have found, place by place, added in order as they come."""
    total: list = []
    for one in found:
        total = [a + b for a, b in zip(total, one, strict=True)] if total else list(one)
    return total
