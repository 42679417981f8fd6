"""How many components: by a share of variance, or by the likelihood of people left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.models.fpca.model import FunctionalPCA

FOLDS = 10
TOL = 1e-4  # of fits that only choose
PATIENCE = 3  # numbers of components that may be worse than the best before the search ends
MOST = 40


@dataclass(frozen=True)
class Curve:
    """Log-likelihood per sample of people left out, by number of components: the median of their cycles.

    Attributes:
        n_components: (n,) numbers of components that were tried.
        score: (n,) mean over folds of people.
        error: (n,) standard error of the difference from the best, over folds.
    """

    n_components: np.ndarray
    score: np.ndarray
    error: np.ndarray

    @property
    def best(self) -> int:
        """The number of components with the greatest score."""
        return int(self.n_components[np.argmax(self.score)])


def choose_by_likelihood(model: FunctionalPCA, values: np.ndarray, people: Sequence[str], most: int) -> Curve:
    """The held-out curve of cycles `values` (K, P, m) of labelled `people` (K,), in folds of people.

    Numbers of components rise from 1 to at most `most`, until three in a row are worse than the best. With a single
    person, folds are of cycles.
    """
    labels, who = np.unique(people, return_inverse=True)
    units = who if len(labels) > 1 else np.arange(len(values))
    folds = units % min(FOLDS, int(units.max()) + 1)
    least = len(values) - int(np.bincount(folds).max()) - 1
    found: list[list[float]] = []
    for q in range(1, max(1, min(most, least, MOST)) + 1):
        found.append([_left_out(model, values, people, folds == f, q) for f in range(folds.max() + 1)])
        means = np.mean(found, axis=1)
        if len(found) - 1 - int(means.argmax()) >= PATIENCE:
            break
    scores = np.array(found)
    below = scores - scores[scores.mean(axis=1).argmax()]
    error = below.std(axis=1, ddof=1) / np.sqrt(scores.shape[1]) if scores.shape[1] > 1 else np.zeros(len(scores))
    return Curve(np.arange(1, len(scores) + 1), scores.mean(axis=1), error)


def _left_out(model: FunctionalPCA, values: np.ndarray, people: Sequence[str], out: np.ndarray, q: int) -> float:
    """Median log-likelihood per sample of the cycles `out` (K,), from a model of the others with q components."""
    some, own = model_of_others(model, q, values, people, out, TOL)
    seen = np.isfinite(own).sum(axis=(1, 2))
    return float(np.median(some.score_samples(own)[seen > 0] / seen[seen > 0]))


def model_of_others(
    model: FunctionalPCA, q: int, values: np.ndarray, people: Sequence[str], out: np.ndarray, tol: float
) -> tuple[FunctionalPCA, np.ndarray]:  # fmt: skip
    """A model of all cycles but those `out` (K,), with q components, and the latter's samples that it knows."""
    shown = np.isfinite(values[~out]).any(axis=(0, 1))
    others = [person for person, left in zip(people, out, strict=True) if not left]
    return model.of_others(q, values[~out][..., shown], others, tol), values[out][..., shown]


def choose_by_share(
    model: FunctionalPCA, values: np.ndarray, people: Sequence[str], most: int, share: float
) -> int:  # fmt: skip
    """The fewest components whose variance is at least `share` of the model's.

    Raises:
        MotionError: `most` components have less.
    """

    def enough(q: int) -> bool:
        return model.of_others(q, values, people, TOL).explained_variance_ratio_.sum() >= share

    low, high = 0, 1  # low is too few, high enough
    while not enough(high):
        if high >= most:
            raise MotionError(f"{most} components, the most there can be, have less than {share:.0%} of the variance")
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
