"""Samples drawn while they are needed, without files: for training loops.

`Walkers` is a sequence, and so a map-style data set of `torch`; `Walkers.stream` an iterator of NumPy arrays, and
`Walkers.torch` an iterable data set of `torch`. All give the samples that `generate` writes.
"""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.data.samples import Sample, Sampler
from motionenv.data.specification import Specification
from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.data.torch_stream import TorchStream


class Walkers:
    """The samples of a specification as a sequence; nothing is drawn before it is asked for.

    Samples are independent in the order of their indices, 16 walkers in turn, so that a stream needs no shuffling and
    is far faster than samples at random indices, each of which needs the motion of its group.

    Args:
        spec: the specification.

    Example:
        >>> walkers = Walkers(Specification.read("lifting"))
        >>> batch = next(iter(walkers.stream(batch=8)))
        >>> batch["joints"].shape  # and "pixels", "detected", ...; for PyTorch's DataLoader see `torch`
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

    def stream(self, *, batch: int | None = None, rank: int = 0, world: int = 1) -> "Stream":
        """An iterator of this consumer's share of the samples, in order.

        Args:
            batch: samples that are stacked to one dict of arrays; None gives single ones.
            rank, world: number of this consumer, from 0, and how many there are. Their shares are ranges of indices
                that don't overlap and differ in length by one at most.

        Raises:
            MotionError: a number out of range.
        """
        return Stream(self, batch, rank, world)

    def torch(self, *, batch: int | None = None) -> "TorchStream":
        """An iterable data set of `torch`, shared among the data loader's workers and the ranks of `torch.distributed`.

        Args:
            batch: samples that are stacked to one dict of arrays, for a loader with `batch_size=None`; None gives
                single ones, for the loader to stack.
        """
        from motionenv.data.torch_stream import TorchStream

        return TorchStream(self, batch)

    def __getstate__(self) -> dict[str, Any]:
        return {"spec": self.spec, "_sampler": None}  # each process draws for itself


class Stream:
    """A consumer's share of samples, from `Walkers.stream`; can be stopped, stored and continued at any step.

    Args:
        walkers: the samples.
        batch, rank, world: as of `Walkers.stream`.
    """

    def __init__(self, walkers: Walkers, batch: int | None = None, rank: int = 0, world: int = 1) -> None:
        checked_whole(world, "world", 1)
        checked_whole(rank, "rank", 0, world - 1)
        self.batch = None if batch is None else checked_whole(batch, "batch", 1)
        self.walkers = walkers
        self.share = range(rank * len(walkers) // world, (rank + 1) * len(walkers) // world)
        self._given = 0

    def __len__(self) -> int:
        """Steps that are left."""
        left = len(self.share) - self._given
        return left if self.batch is None else -(-left // self.batch)

    def __iter__(self) -> Iterator[Sample]:
        samples = self.walkers.sampler.samples(self.share.start + self._given, self.share.stop)
        size = self.batch or 1
        waiting: list[Sample] = []
        for sample in samples:
            waiting.append(sample)
            if len(waiting) == size or self._given + len(waiting) == len(self.share):
                self._given += len(waiting)
                yield sample if self.batch is None else stacked(waiting)
                waiting = []

    def state_dict(self) -> dict[str, int]:
        """The stream's position, for `load_state_dict`."""
        return {"start": self.share.start, "stop": self.share.stop, "given": self._given}

    def load_state_dict(self, state: dict[str, int]) -> None:
        """Go on where a stream of the same share was, at no cost.

        Raises:
            MotionError: `state` is of another share.
        """
        if (state["start"], state["stop"]) != (self.share.start, self.share.stop):
            raise MotionError(
                f"state is of the samples {state['start']} to {state['stop']}, this stream's are {self.share.start} to "
                f"{self.share.stop}: use the same specification, rank and world"
            )
        self._given = checked_whole(state["given"], "state['given']", 0, len(self.share))


def stacked(samples: Iterable[Sample]) -> Sample:
    """A dict of arrays with an axis for the `samples` first."""
    each = list(samples)
    return {name: np.stack([sample[name] for sample in each]) for name in each[0]}
