"""The axis between two groups of people: how far left-out people fall on the right side (Troje 2002).

Troje, N. F. (2002). Decomposing biological motion: a framework for analysis and synthesis of human gait patterns.
Journal of Vision 2(5), 371-387. There linear discriminants of eigenwalkers tell men from women.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.types import Trait

_FEWEST = 2  # people of a group


@dataclass(frozen=True, eq=False)
class GroupAxis:
    """A direction in the space of walkers, from one group of people to another.

    Attributes:
        low, high: the groups.
        direction: (q,) unit vector, in standard deviations along each component.
        mean, gain: where the average walker is on the axis, on which the groups' means are at -1 and 1, and the change
            for one step along `direction`.
        people, right: of low and of high, the number of people, and of those who fell on the right side of an axis that
            was learned without them.
    """

    low: str
    high: str
    direction: np.ndarray
    mean: float
    gain: float
    people: tuple[int, int]
    right: tuple[int, int]

    def trait(self) -> Trait:
        """The axis as a trait of the model; its share is that of left-out people who fall right."""
        told = [f"{r} of {n} {who}" for r, n, who in zip(self.right, self.people, (self.low, self.high), strict=True)]
        note = f"Left out of the fit, {' and '.join(told)} fall on the right side; chance is half."
        share = sum(self.right) / sum(self.people)
        return Trait(
            f"{self.low} or {self.high}", self.low, self.high, self.direction, self.mean, self.gain, "of the way",
            share, note,
        )  # fmt: skip


def checked_groups(groups: Mapping[str, Sequence[str]], people: Sequence[str]) -> tuple[tuple[str, str], np.ndarray]:
    """Names of the two groups, and of each of the `people` (R,) -1, 1, or 0 for those of neither.

    Raises:
        MotionError: not two groups, fewer than two people in one, somebody in both, or somebody who isn't there.
    """
    if len(groups) != 2 or not all(groups):
        raise MotionError(f"an axis is between two groups with names, got {len(groups)}")
    (low, first), (high, second) = groups.items()
    if both := set(first) & set(second):
        raise MotionError(f"{min(both)} can't be in both groups, {low} and {high}")
    if missing := (set(first) | set(second)) - set(people):
        known = ", ".join(sorted(people)[:10])
        raise MotionError(f"no walk of {min(missing)} can be used for an axis: there are walks of {known}")
    for name, members in groups.items():
        if len(set(members)) < _FEWEST:
            raise MotionError(f"group {name} needs at least {_FEWEST} people, got {len(set(members))}")
    sides = np.array([-1 if who in set(first) else int(who in set(second)) for who in people])
    return (low, high), sides


def group_axis(
    names: tuple[str, str], sides: np.ndarray, z: np.ndarray, without: Callable[[int], tuple[np.ndarray, np.ndarray]]
) -> GroupAxis:
    """The axis between two groups.

    Args:
        names: of the groups.
        sides: (R,) -1 or 1, or 0 for people of neither.
        z: (R, q) everybody's scores, in standard deviations.
        without: given the number of a person, the scores (R - 1, p) of the others and his own (p,) in a model that was
            learned without him.
    """
    members = np.flatnonzero(sides)
    direction = _towards(z, sides)
    low, high = ((z[sides == side] @ direction).mean() for side in (-1, 1))
    right = {-1: 0, 1: 0}
    for i in members:
        others, own = without(int(i))
        falls = _side(others, np.delete(sides, i), own)
        right[int(sides[i])] += int(falls == sides[i])
    counts = (int((sides < 0).sum()), int((sides > 0).sum()))
    apart = max(float(high - low), 1e-12)
    mean, gain = -float(high + low) / apart, 2 / apart
    return GroupAxis(*names, direction, mean, gain, counts, (right[-1], right[1]))


def _side(z: np.ndarray, sides: np.ndarray, own: np.ndarray) -> int:
    """On which side of the middle between the means of two groups somebody falls."""
    direction = _towards(z, sides)
    middle = 0.5 * sum((z[sides == side] @ direction).mean() for side in (-1, 1))
    return 1 if own @ direction > middle else -1


def _towards(z: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Unit vector (q,) from the people of one side to those of the other, by ridge regression of their side."""
    members = sides != 0
    weights = shrunk_regression(z[members], sides[members].astype(float))[1]
    return weights / max(float(np.linalg.norm(weights)), 1e-300)
