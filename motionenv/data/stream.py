"""Samples drawn while they are needed, without files: for training loops.

`Walkers` is a sequence, and so a map-style data set of PyTorch; `Walkers.stream` an iterator of NumPy arrays. Both give
the samples that `generate` writes.
"""

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.data.samples import Sample, Sampler
from motionenv.data.specification import Specification


class Walkers:
    """The samples of a specification as a sequence; nothing is drawn before it is asked for.

    Samples are independent in the order of their indices, 16 walkers in turn, so that a stream needs no shuffling and
    is far faster than samples at random indices, each of which needs the motion of its group.

    Args:
        spec: the specification.

    Example:
        >>> walkers = Walkers(Specification.read("lifting"))
        >>> batch = next(iter(walkers.stream(batch=8)))
        >>> batch["joints"].shape  # and "pixels", "detected", ...
        (8, 60, 15, 3)
    """

    def __init__(self, spec: Specification) -> None:
        self.spec = spec
        self._sampler: Sampler | None = None

    def __len__(self) -> int:
        return self.spec.samples

    def __getitem__(self, index: int) -> Sample:
        """The sample of an index; negative ones count from the end."""
        count = len(self)
        if not -count <= index < count:
            raise IndexError(f"index must be from 0 to {count - 1}, got {index}")
        return self.sampler.sample(int(index) % count)

    def __iter__(self) -> Iterator[Sample]:
        return self.sampler.samples(0, len(self))

    @property
    def sampler(self) -> Sampler:
        """The sampler of this process."""
        if self._sampler is None:
            self._sampler = Sampler(self.spec)
        return self._sampler

    def stream(self, *, batch: int | None = None, rank: int = 0, world: int = 1, start: int = 0) -> Iterator[Sample]:
        """Draw this consumer's share of the samples, in order.

        Args:
            batch: samples that are stacked to one dict of arrays; None gives single ones.
            rank, world: number of this consumer, from 0, and how many there are. Their shares are ranges of indices
                that don't overlap and differ in length by one at most.
            start: steps to leave out, at no cost, to go on where an earlier stream ended.

        Raises:
            MotionError: a number out of range.
        """
        checked_whole(world, "world", 1)
        checked_whole(rank, "rank", 0, world - 1)
        size = 1 if batch is None else checked_whole(batch, "batch", 1)
        first, stop = rank * len(self) // world, (rank + 1) * len(self) // world
        drawn = self.sampler.samples(min(first + size * checked_whole(start, "start", 0), stop), stop)
        return drawn if batch is None else map(stacked, iter(lambda: list(islice(drawn, size)), []))

    def __getstate__(self) -> dict[str, Any]:
        return {"spec": self.spec, "_sampler": None}  # each process draws for itself


def stacked(samples: Iterable[Sample]) -> Sample:
    """A dict of arrays with an axis for the `samples` first."""
    each = list(samples)
    return {name: np.stack([sample[name] for sample in each]) for name in each[0]}
