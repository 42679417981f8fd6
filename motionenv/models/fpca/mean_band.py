"""Bands around a mean cycle, from the spread of people: a person's cycles count together."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import t

DRAWS = 2000
FEWEST = 2  # people


def mean_band(
    deviations: np.ndarray, people: Sequence[str], level: float, simultaneous: bool, rng: np.random.Generator
) -> np.ndarray:
    """Half the width (P, m) of a band around the mean of cycles.

    The mean's error is the sum over people of their deviations, each person's taken together (Liang & Zeger 1986, with
    the factor G / (G - 1) of G people). Pointwise bands take Student's t with G - 1 degrees of freedom. For
    simultaneous ones, people's sums get random signs and sizes (multiplier bootstrap; Telschow & Schwartzman 2022), and
    the largest studentised error over a channel's phases takes the place of t.

    Args:
        deviations: (K, P, m) from the mean, NaN where missing.
        people: (K,) labels.
        level: coverage.
        simultaneous: whether the band holds a channel's mean at all phases at once.
        rng: for the bootstrap.
    """
    labels, who = np.unique(people, return_inverse=True)
    seen = np.isfinite(deviations)
    sums, counts = np.zeros((2, len(labels), *deviations.shape[1:]))
    np.add.at(sums, who, np.where(seen, deviations, 0.0))
    np.add.at(counts, who, seen)
    n = (counts > 0).sum(axis=0)  # people who show each sample
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(n / (n - 1) * (sums**2).sum(axis=0)) / counts.sum(axis=0)
    error[n < FEWEST] = np.nan
    if not simultaneous:
        return error * t.ppf(0.5 + level / 2, np.maximum(n - 1, 1))
    studentised = np.where(np.isnan(error), 0.0, sums / counts.sum(axis=0) / error)
    degrees = max(len(labels) - 1, 1)
    normal = rng.standard_normal((DRAWS, len(labels)))
    sizes = np.sqrt(rng.chisquare(degrees, DRAWS) / degrees)
    most = np.abs(np.tensordot(normal, studentised, axes=1)).max(axis=1) / sizes[:, None]
    return error * np.maximum(np.quantile(most, level, axis=0), t.ppf(0.5 + level / 2, degrees))
