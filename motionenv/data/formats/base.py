"""The protocol of file formats of data sets."""

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Protocol

from motionenv.data.samples import Sample
from motionenv.data.specification import Specification
from motionenv.data.store import Store


class Format(Protocol):
    """Writes shards of samples to files. The same samples give the same bytes.

    Attributes:
        name: the format's name in the command line and in `dataset.json`.
    """

    name: ClassVar[str]

    def check(self, spec: Specification) -> None:
        """Raise a MotionError if `spec` asks for what the format can't hold, before any work."""

    def write(self, samples: Iterator[Sample], folder: Path, shard: int, spec: Specification) -> None:
        """Write one shard.

        Args:
            samples: of the shard, in the order of their indices.
            folder: an empty local folder; the files below it get the same paths in the data set.
            shard: its number.
            spec: the specification.
        """

    def finish(self, store: Store, rows: list[dict], spec: Specification) -> None:
        """Write what describes the whole set, when all shards are done; called again, it writes the same.

        Args:
            store: where the data set is.
            rows: of the manifest, one for each shard, in order; see `motionenv.data.making.manifest`.
            spec: the specification.
        """
