"""Change of one person's gait with speed: a direction in a model's scores along which steps get longer.

A person who walks faster takes longer and quicker steps. Step length goes with a power of speed, near 0.5: then the
walk ratio, step length over cadence, stays the same (Sekiya & Nagasaki 1998). The power, and how angles change when
steps get longer, are learned within people, and shrunk to what is known otherwise, as few people were captured at
several speeds. Speeds above those captured go on in this direction; far from them only the cadence changes.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine

#: The power of speed that step length follows when the walk ratio is constant, and how much studies differ: from 0.42
#: (Grieve & Gear 1966) to 0.58 (Zijlstra et al. 1995).
EXPONENT, _BETWEEN_STUDIES = 0.5, 0.03
_LEAST_ERROR = 0.05  # of a slope within a handful of people
_PRIOR = 0.02  # spread of log lengths that knowledge from between people counts as: one person's at ± 10 %
#: How far log stride lengths go from the average person's: not below the first, at about 0.35 m/s; above the second,
#: at about 1.65 m/s, half as far as the power of speed says, and cadence makes up for it.
REACH = (-0.6, 0.25)
_LEADING = 12  # components whose products say how long strides are
_LEAST_GAIN = 0.3
_DEPENDENT = 1e-9  # singular values below this share of the largest are rounding errors
#: Change of the knee's greatest flexion in swing per log stride length [rad]: 55°, 59°, 61° and 62° at slow, free, fast
#: and very fast speed (Schwartz et al. 2008).
_BEND = np.radians(15.0)


@dataclass(frozen=True, eq=False, repr=False)
class Pace(OneLine):
    """Effect of speed on walkers with scores z (..., q), in standard deviations from the average person.

    Attributes:
        length: log stride length of the average person, relative to body height.
        weights: (q,) its change with z.
        curvature: (q, q) and with products of z.
        direction: (q,) change of z per change of the log stride length in one person.
        between: (q,) mean difference of z between people per difference of the log stride length.
        exponent: power of speed that step length follows.
        speeds: (2,) least and greatest speed learned from [body heights / s].
    """

    length: float
    weights: np.ndarray
    curvature: np.ndarray
    direction: np.ndarray
    between: np.ndarray
    exponent: float
    speeds: np.ndarray

    def log_length(self, z: np.ndarray) -> np.ndarray:
        """Log stride lengths (...) of bodies of height 1 with scores `z` (..., q)."""
        return self.length + z @ self.weights + ((z @ self.curvature) * z).sum(-1)

    def longer(self, z: np.ndarray, change: float | np.ndarray, way: np.ndarray) -> np.ndarray:
        """Scores `z` (..., q), log stride lengths changed by `change` (...) along `way`: `direction` or `between`."""
        slope = np.maximum((self.weights + 2 * z @ self.curvature) @ way, _LEAST_GAIN)
        bend = way @ self.curvature @ way
        root = np.sqrt(np.maximum(slope**2 + 4 * bend * change, (0.5 * slope) ** 2))
        return z + (2 * np.clip(change, -1.0, 1.0) / (slope + root))[..., None] * way

    def at_speed(
        self, z: np.ndarray, seconds: float | np.ndarray, scale: float | np.ndarray, speed: float | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same people at another speed.

        Args:
            z: (..., q) at their own speed.
            seconds: (...) their stride times [s].
            scale: (...) their body heights [m], times the length of their legs relative to the model's.
            speed: (...) [m/s].

        Returns:
            Scores (..., q), and the stride times (...) [s] that make the speed.
        """
        now = self.log_length(z)
        goal = now + self.exponent * (np.log(speed * seconds / scale) - now)
        z = self.longer(z, reached(goal, self.length) - reached(now, self.length), self.direction)
        return z, np.exp(self.log_length(z)) * scale / speed

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Arrays by name, for a model file."""
        return {f"pace_{field.name}": np.asarray(getattr(self, field.name)) for field in fields(self)}


def reached(lengths: float | np.ndarray, average: float) -> np.ndarray:
    """Log stride lengths (...) that are walked where `lengths` (...) are wanted: see `REACH`."""
    most = average + REACH[1]
    return np.maximum(np.minimum(lengths, 0.5 * (lengths + most)), average + REACH[0])


def fit_pace(
    z: np.ndarray, people: ArrayLike, log_speeds: np.ndarray, log_lengths: np.ndarray,
    drawn: np.ndarray, drawn_lengths: np.ndarray, bend: np.ndarray,
) -> Pace:  # fmt: skip
    """Learn what speed does to walkers. What it does to the knee's greatest flexion is taken from published walks.

    Args:
        z: (n, q) standard scores of captured walks.
        people: (n,) the person's label of each.
        log_speeds: (n,) [body heights / s].
        log_lengths: (n,) of their strides as captured [body heights].
        drawn: (m, q) standard scores of synthetic walks.
        drawn_lengths: (m,) log stride lengths that the model gives these [body heights].
        bend: (q,) change of the knee's greatest flexion with z [rad].
    """
    q = z.shape[1]
    i, j = np.triu_indices(min(q, _LEADING))
    columns = np.column_stack([np.ones(len(drawn)), drawn, drawn[:, i] * drawn[:, j]])
    found = np.linalg.lstsq(columns, drawn_lengths, _DEPENDENT)[0]
    curvature = np.zeros((q, q))
    curvature[i, j] = found[1 + q :] / 2
    curvature[j, i] += found[1 + q :] / 2
    speeds = np.exp([log_speeds.min(), log_speeds.max()])
    power = exponent(log_lengths, log_speeds, people)
    made = Pace(float(found[0]), found[1 : 1 + q], curvature, np.zeros(q), np.zeros(q), power, speeds)
    spread = np.cov(drawn.T).reshape(q, q) @ made.weights
    variance = float(made.weights @ spread)
    if variance < 1e-9:  # walks that don't differ
        return made
    between = spread / variance
    ways = np.array([direction(z, made.log_length(z), people, between), between])
    # The likeliest change of both ways with which strides lengthen by 1 and knees bend by what is published.
    sides = np.array([made.weights, bend])
    spread = np.cov(drawn.T).reshape(q, q) @ sides.T
    ways += ([1.0, _BEND] - ways @ sides.T) @ np.linalg.pinv(sides @ spread, _DEPENDENT) @ spread.T
    return replace(made, direction=ways[0], between=ways[1])


def direction(values: np.ndarray, log_lengths: np.ndarray, people: ArrayLike, prior: np.ndarray) -> np.ndarray:
    """Change (k,) of the `values` (n, k) of walks per change of the log stride length, within people.

    `log_lengths` (n,) and `people` (n,), the person's label, are of each walk; `prior` (k,) is what is expected, which
    counts as much as one person's walks at two speeds.
    """
    return shrunk(within(log_lengths, people) @ values, log_lengths, people, prior)


def shrunk(products: np.ndarray, log_lengths: np.ndarray, people: ArrayLike, prior: np.ndarray) -> np.ndarray:
    """`direction`, from the `products` (k,) of the log lengths, less each person's mean, with the walks' values."""
    x = within(log_lengths, people)
    return (products + _PRIOR * prior) / (x @ x + _PRIOR)


def exponent(log_lengths: np.ndarray, log_speeds: np.ndarray, people: ArrayLike) -> float:
    """Power of speed that step length follows within people, weighted with the published one by their errors.

    `log_lengths`, of strides, `log_speeds` and `people`, the person's label, are (n,) of walks.
    """
    x, y = within(log_speeds, people), within(log_lengths, people)
    if x @ x < _PRIOR:
        return EXPONENT
    slope = float(x @ y / (x @ x))
    rest = x * (y - slope * x)
    _, who = np.unique(people, return_inverse=True)
    error = max(float((np.bincount(who, rest) ** 2).sum()) / float(x @ x) ** 2, _LEAST_ERROR**2)
    weight = _BETWEEN_STUDIES**2 / (_BETWEEN_STUDIES**2 + error)
    return EXPONENT + weight * (slope - EXPONENT)


def within(values: np.ndarray, people: ArrayLike) -> np.ndarray:
    """Values (n, ...) less the mean of each person's, whose labels are `people` (n,)."""
    _, who, count = np.unique(people, return_inverse=True, return_counts=True)
    sums = np.zeros((len(count), *values.shape[1:]))
    np.add.at(sums, who, values)
    return values - (sums / count.reshape(-1, *[1] * (values.ndim - 1)))[who]
