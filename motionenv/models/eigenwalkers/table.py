"""The walks that a model of walkers learns from: rows of 225 coefficients, and people's means of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import (
    HIGHER,
    PARTS,
    FourierWalker,
    centred,
    in_phase,
    mirrored,
    stride_lengths,
)  # fmt: skip
from motionenv.types import MARKERS, Markers, Motion

COEFFICIENTS = (len(PARTS), len(MARKERS), 3)  #: shape of a walker's coefficients


@dataclass(frozen=True)
class Table:
    """Walks that a model learns from, or people's means of them."""

    rows: np.ndarray  # (n, 5, 15, 3) [m], NaN where unknown
    frequencies: np.ndarray  # (n,) strides per second [Hz]
    people: tuple[str, ...]  # (n,) the person's label
    higher: np.ndarray | None = None  # (n, 12, 15, 3) [m] higher harmonics, NaN where unknown

    def __len__(self) -> int:
        return len(self.people)


def with_mirror_images(rows: np.ndarray) -> np.ndarray:
    """Coefficients (2n, 5, 15, 3): `rows` (n, 5, 15, 3), and after them their mirror images."""
    return np.concatenate([rows, mirrored(rows)])


def read_walks(walks: Iterable[FourierWalker | Markers | Motion], subjects: Sequence | None) -> Table:
    """The Fourier representations of `walks`, which are as of `FourierModel.fit`.

    `subjects` labels the person of each; None takes all for different people.

    Raises:
        MotionError: no walks, or not one label per walk; see also `fourier_walker`.
    """
    made = [walk if isinstance(walk, FourierWalker) else fourier_walker(walk) for walk in walks]
    if not made:
        raise MotionError("fit needs walks of several people, got none")
    labels = [str(s) for s in (range(len(made)) if subjects is None else subjects)]
    if len(labels) != len(made):
        raise MotionError(f"fit needs a subject for each walk, got {len(made)} walks and {len(labels)} subjects")
    unknown = np.full((2 * len(HIGHER), len(MARKERS), 3), np.nan)
    higher = np.stack([unknown if w.higher is None else w.higher for w in made])
    rows, frequencies = np.stack([w.coefficients for w in made]), np.array([w.frequency for w in made])
    return Table(rows, frequencies, tuple(labels), higher)


def mean_walkers(table: Table, people: Sequence[str]) -> Table:
    """Means over the walks that have the same label in `people` (n,), in the order in which labels come first.

    Of coefficients, over the walks that know them; of frequencies, geometric.
    """
    labels = tuple(dict.fromkeys(people))
    number = {label: i for i, label in enumerate(labels)}
    who = np.array([number[label] for label in people], dtype=np.intp)
    frequencies = np.exp(np.bincount(who, np.log(table.frequencies)) / np.bincount(who))
    sums, seen = np.zeros((2, len(labels), *COEFFICIENTS))
    known = np.isfinite(table.rows)
    np.add.at(sums, who, np.where(known, table.rows, 0.0))
    np.add.at(seen, who, known)
    mean = np.full(sums.shape, np.nan)
    np.divide(sums, seen, out=mean, where=seen > 0)
    return Table(centred(in_phase(mean)), frequencies, labels)


def mean_higher(walks: Table) -> np.ndarray:
    """The `HIGHER` harmonics (12, 15, 3) of the average walker, per length of strides; 0 where no walk shows them.

    By least squares over walks, with equal weight for each person; left and right learn from each other.
    """
    assert walks.higher is not None
    strides = stride_lengths(walks.rows)[:, None, None, None]
    _, who, count = np.unique(walks.people, return_inverse=True, return_counts=True)
    weight = (1.0 / count[who])[:, None, None, None] * np.isfinite(walks.higher * strides)
    strides = np.nan_to_num(strides)
    squares = (weight * strides**2).sum(axis=0)
    found = (weight * strides * np.nan_to_num(walks.higher)).sum(axis=0) / np.where(squares > 0, squares, 1.0)
    whole = np.concatenate([np.zeros(COEFFICIENTS), found])
    return 0.5 * (whole + mirrored(whole))[len(PARTS) :]
