"""`Walkers` as an iterable data set of `torch`."""

from collections.abc import Iterator

from torch import distributed
from torch.utils.data import IterableDataset, get_worker_info

from motionenv.data.samples import Sample
from motionenv.data.stream import Stream, Walkers


class TorchStream(IterableDataset):
    """The share of a data loader's worker, on this rank of `torch.distributed`: see `Walkers.torch`.

    `state_dict` and `load_state_dict` are those that torchdata's `StatefulDataLoader` calls in each worker.

    Args:
        walkers: the samples.
        batch: samples that are stacked, or None.
    """

    def __init__(self, walkers: Walkers, batch: int | None = None) -> None:
        self.walkers, self.batch = walkers, batch
        self._stream: Stream | None = None
        self._state: dict[str, int] | None = None

    def __iter__(self) -> Iterator[Sample]:
        worker = get_worker_info()
        here, workers = (0, 1) if worker is None else (worker.id, worker.num_workers)
        known = distributed.is_available() and distributed.is_initialized()
        rank, ranks = (distributed.get_rank(), distributed.get_world_size()) if known else (0, 1)
        stream = Stream(self.walkers, self.batch, rank * workers + here, ranks * workers)
        if self._state is not None:
            stream.load_state_dict(self._state)
            self._state = None
        self._stream = stream
        return iter(stream)

    def state_dict(self) -> dict[str, int]:
        """This worker's position; empty before it begins."""
        return {} if self._stream is None else self._stream.state_dict()

    def load_state_dict(self, state: dict[str, int]) -> None:
        """Go on at a `state` of `state_dict` when next iterated."""
        self._state = state or None
