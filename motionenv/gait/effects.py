"""Effects on curves: people's curves regressed on what tells people apart, tested by permutations of people.

Function-on-scalar regression: at each phase, by least squares, y_i(τ) = Σ_k x_ik β_k(τ) + e_i(τ), for people i. The
standard errors are those of people whose spread isn't equal (HC2; MacKinnon & White 1985): of two groups the test is
Welch's, of one group or of differences Student's. A statistic is compared with the largest |t| over the cycle when
people are relabelled: signs are flipped where the mean itself is tested, else residuals under the null change places
(Freedman & Lane 1983; Winkler et al. 2014). So the curve's p values and band hold at all phases at once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.runs import runs
from motionenv._core.validation import checked_number, random_generator
from motionenv.errors import MotionError

PERMUTATIONS = 4999
_AT_A_TIME = 250


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect on one curve.

    Attributes:
        estimate, error: (phases,) of the effect and its standard error, in the curve's unit per unit of the predictor.
        threshold: |t| that is exceeded anywhere in the cycle with the probability 1 - level if there is no effect;
            infinite if so few people can't tell.
        p: probability, if there is no effect, of a |t| as large as the curve's largest.
        people: whose curves are known.
        maxima: (relabellings,) the largest |t| of each; of other curves of the same people, those of the same ones.
        least: the smallest p that they can give.
    """

    estimate: np.ndarray
    error: np.ndarray
    threshold: float
    p: float
    people: int
    maxima: np.ndarray
    least: float

    @property
    def t(self) -> np.ndarray:
        """(phases,) the effect in standard errors."""
        return _ratio(self.estimate, self.error)

    @property
    def band(self) -> np.ndarray:
        """(phases,) half the width of the band that holds the effect at all phases at once."""
        return self.threshold * self.error

    @property
    def intervals(self) -> list[tuple[int, int]]:
        """First and last phase of each part of the cycle in which the band leaves zero out."""
        return [(first, end - 1) for first, end in runs(np.abs(self.t) > self.threshold)]


def effect_of(
    curves: np.ndarray, design: np.ndarray, column: int, *, level: float = 0.95, permutations: int = PERMUTATIONS,
    seed: int | np.random.Generator = 0,
) -> Effect:  # fmt: skip
    """The effect of one column of a design on people's curves.

    Args:
        curves: (people, phases), NaN where unknown; people with gaps are left out.
        design: (people, k), the first column ones.
        column: the effect's; 0 tests the mean, which needs a design of ones alone.
        level: of the band.
        permutations: most relabellings; with so few people that there are fewer, all are taken.
        seed: draws them.

    Raises:
        MotionError: too few people, columns that tell the same, or a person who is alone with a value of a column.
    """
    checked_number(level, "level", 0.5, 0.9999)
    known = np.isfinite(curves).all(axis=1) & np.isfinite(design).all(axis=1)
    y, x = curves[known], design[known].astype(np.float64)
    n, k = x.shape
    if n < k + 2:
        raise MotionError(f"{k} coefficients need at least {k + 2} people whose curves are known, got {n}")
    if np.linalg.matrix_rank(x / np.maximum(np.abs(x).max(axis=0), 1e-300)) < k:
        raise MotionError("predictors tell the same, or one is the same for all: leave one out")
    inverse = np.linalg.pinv(x)
    leverage = np.einsum("ij,ji->i", x, inverse)
    if leverage.max() > 1 - 1e-9:
        raise MotionError("a single person has a value that decides a coefficient alone: each group needs two people")
    maker = inverse[column]
    weights = maker**2 / (1 - leverage)
    projection = x @ inverse

    def estimates(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Effect and standard error (..., phases) of data (..., people, phases)."""
        return np.einsum("i,...ip->...p", maker, data), np.sqrt(weights @ (data - projection @ data) ** 2)

    estimate, error = estimates(y)
    largest = float(np.abs(_ratio(estimate, error)).max())
    rest = np.delete(x, column, axis=1)
    residuals = y - rest @ (np.linalg.pinv(rest) @ y) if k > 1 else y
    ways, every, least = _relabellings(x, column, permutations, random_generator(seed))
    found = [largest]
    for some in iter(lambda: list(itertools.islice(ways, _AT_A_TIME)), []):
        moved = np.stack([residuals[way] if column else residuals * way[:, None] for way in some])
        found += np.abs(_ratio(*estimates(moved))).max(axis=1).tolist()
    maxima = np.array(found[1:] if every else found)  # all relabellings include the one that was seen
    threshold = np.inf if least > 1 - level + 1e-9 else float(np.sort(maxima)[math.ceil(level * len(maxima)) - 1])
    return Effect(estimate, error, threshold, float(p_of(largest, maxima)), n, maxima, least)


def p_of(t: ArrayLike, maxima: np.ndarray) -> np.ndarray:
    """The share of `maxima` (relabellings,) that reach each |t| of any shape."""
    within = np.asarray(t) * (1 - 1e-9)  # mirror images differ by rounding
    return 1 - np.searchsorted(np.sort(maxima), within) / len(maxima)


def _relabellings(
    x: np.ndarray, column: int, most: int, rng: np.random.Generator
) -> tuple[Iterator[np.ndarray], bool, float]:  # fmt: skip
    """Signs (people,) or orders (people,), whether they are all that there are, and the smallest p they can give."""
    n = len(x)
    if column == 0:
        if 2**n <= most + 1:
            return (np.array(signs) for signs in itertools.product((1.0, -1.0), repeat=n)), True, 2 / 2**n
        return (rng.choice((1.0, -1.0), n) for _ in range(most)), False, 1 / (most + 1)
    values, group = np.unique(x[:, column], return_inverse=True)
    if x.shape[1] == 2 and len(values) == 2 and (ways := math.comb(n, ones := int(group.sum()))) <= most + 1:
        return _divisions(group), True, (2 if 2 * ones == n else 1) / ways
    return (rng.permutation(n) for _ in range(most)), False, 1 / (most + 1)


def _divisions(group: np.ndarray) -> Iterator[np.ndarray]:
    """Orders that give each choice of people the label 1 once."""
    everyone, ones, zeros = range(len(group)), np.flatnonzero(group == 1), np.flatnonzero(group == 0)
    for chosen in itertools.combinations(everyone, len(ones)):
        order = np.empty(len(group), dtype=int)
        order[ones], order[zeros] = chosen, [i for i in everyone if i not in chosen]
        yield order


def _ratio(estimate: np.ndarray, error: np.ndarray) -> np.ndarray:
    return np.divide(estimate, error, out=np.zeros_like(estimate), where=error > 0)
