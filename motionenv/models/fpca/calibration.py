"""How much wider bands must be for people whom a model hasn't seen: it knows its own people better than others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from motionenv.models.fpca.selection import model_of_others

if TYPE_CHECKING:
    from motionenv.models.fpca.model import FunctionalPCA

FOLDS = 5
LEVEL = 0.9
REPEATS = 2
HIDDEN = 0.9  # share of the channels of a cycle in which a block is hidden: a fifth of all samples
SHORTEST, LONGEST = 0.05, 0.4  # share of a cycle that a block takes


def inflation(model: FunctionalPCA, values: np.ndarray, people: Sequence[str]) -> np.ndarray:
    """Factors on the half-widths of bands around single filled samples, and around all of a cycle.

    In folds of people, blocks of their cycles `values` (K, P, m) are hidden and filled by a model of the others. With
    the factors, at least 1, 90 % bands hold 90 % of what was hidden, where each person counts once.
    """
    labels, who = np.unique(people, return_inverse=True)
    if len(labels) < 2:
        return np.ones(2)
    rng = np.random.default_rng(0)
    single: list[np.ndarray] = []
    whole: list[np.ndarray] = []
    for fold in range(min(FOLDS, len(labels))):
        out = who % FOLDS == fold
        other, truth = model_of_others(model, model.n_components_, values, people, out, model.tol)
        other.inflation_ = np.ones(2)
        for _ in range(REPEATS):
            hidden = blocks(truth, rng)
            gappy = np.where(hidden, np.nan, truth)
            filled, one = other.impute(gappy, True, level=LEVEL)
            every = other.impute(gappy, True, level=LEVEL, simultaneous=True, seed=rng)[1]
            errors = np.where(hidden, np.abs(filled - truth), 0.0)
            most = (errors / np.where(hidden, every, np.inf)).max(axis=(1, 2))
            for person in np.unique(who[out]):
                own = who[out] == person
                single.append((errors[own] / np.where(hidden, one, np.inf)[own])[hidden[own]])
                whole.append(most[own & hidden.any(axis=(1, 2))])
    return np.maximum([_quantile(single), _quantile(whole)], 1.0)


def _quantile(found: list[np.ndarray]) -> float:
    """Quantile `LEVEL` of arrays (n,), each of which weighs the same."""
    kept = [each for each in found if len(each)]
    values = np.concatenate(kept)
    weights = np.concatenate([np.full(len(each), 1 / len(each)) for each in kept])
    order = np.argsort(values, kind="stable")
    return float(values[order[np.searchsorted(np.cumsum(weights[order]), LEVEL * len(kept))]])


def blocks(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Which seen samples (K, P, m) to hide: a block of some channels of each cycle."""
    k, p, m = values.shape
    start = rng.integers(p, size=(k, 1, m))
    length = np.rint(p * rng.uniform(SHORTEST, LONGEST, size=(k, 1, m)))
    chosen = rng.random((k, 1, m)) < HIDDEN
    inside = (np.arange(p)[:, None] - start) % p < length
    return chosen & inside & np.isfinite(values)
