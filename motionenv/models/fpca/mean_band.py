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

    By the jackknife over people: how much the mean changes without each of them (Bell & McCaffrey 2002; nearly unbiased
    if some have far more cycles than others). Pointwise bands take Student's t, whose degrees of freedom are those of
    as many people as would weigh the same. For simultaneous ones, people's changes get random signs and sizes
    (multiplier bootstrap; Telschow & Schwartzman 2022), and the largest studentised error over a channel's phases takes
    t's place.

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
    total, n = counts.sum(axis=0), (counts > 0).sum(axis=0)  # samples, and people who show one
    enough = n >= FEWEST
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = sums.sum(axis=0) / total
        changes = np.where((counts > 0) & enough, (sums.sum(axis=0) - sums) / (total - counts) - whole, 0.0)
        error = np.where(enough, np.sqrt((n - 1) / n * (changes**2).sum(axis=0)), np.nan)
        degrees = np.maximum(1 / ((counts / total) ** 2).sum(axis=0) - 1, 1.0)
    single = t.ppf(0.5 + level / 2, np.where(enough, degrees, 1.0))
    if not simultaneous:
        return error * single
    studentised = np.where(enough & (error > 0), np.sqrt((n - 1) / n) * changes / error, 0.0)
    normal = rng.standard_normal((DRAWS, len(labels)))
    fewest = float(np.min(degrees[enough], initial=len(labels)))
    sizes = np.sqrt(rng.chisquare(fewest, DRAWS) / fewest)
    most = np.abs(np.tensordot(normal, studentised, axes=1)).max(axis=1) / sizes[:, None]
    return error * np.maximum(np.quantile(most, level, axis=0), single)
