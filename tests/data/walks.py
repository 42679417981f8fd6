"""Specifications and comparisons that the tests of data sets share."""

import hashlib
from pathlib import Path

import numpy as np

from motionenv.data import Specification
from motionenv.data.specification import PICTURES, TRUTH

#: Everything that can be asked for, small.
EVERYTHING = Specification.read("tracking").replace(
    frames=48, clip=6, seed=7, people={"passers_by": [1, 2], "views": 2},
    pictures={"width": 48, "height": 40}, output={"fields": [*PICTURES, *TRUTH], "shard": 18},
)  # fmt: skip
#: Single pictures, three shards of them.
SINGLE = Specification.read("keypoints").replace(
    frames=50, people={"views": 4}, pictures={"width": 64, "height": 48}, output={"shard": 20, "picture": "png"}
)


def same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    """Whether two samples have the same fields with the same bytes."""
    return one.keys() == other.keys() and all(
        one[name].dtype == other[name].dtype and np.asarray(one[name]).tobytes() == np.asarray(other[name]).tobytes()
        for name in one
    )


def digests(folder) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its path."""
    files = [file for file in sorted(Path(folder).rglob("*")) if file.is_file()]
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
