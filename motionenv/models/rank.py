"""How many components: hide blocks of what was seen, fill them, and compare."""

from dataclasses import replace

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.fpca import FunctionalPCA
from motionenv.types import Cycles


def hide_blocks(values, share: float = 0.2, longest: float = 0.4, seed=None) -> np.ndarray:
    """A mask (K, P, m), True where blocks hide samples, as occlusions do: runs of one channel of one cycle.

    Args:
        values: (K, P, m), NaN where missing already; blocks may lie there too.
        share: of all samples to hide, from 0 to below 1.
        longest: length of the longest block, in cycles; the shortest is a quarter of it. Blocks go round the cycle.
        seed: int or Generator.

    Raises:
        MotionError: `share` or `longest` out of range.
    """
    if not (0 <= share < 1 and 0 < longest <= 1):
        raise MotionError(f"share must be in [0, 1) and longest in (0, 1], got {share}, {longest}")
    rng = np.random.default_rng(seed)
    k, p, m = np.shape(values)
    most = max(1, round(longest * p))
    hidden = np.zeros((k, m, p), dtype=bool)
    left = round(share * hidden.size)
    while left > 0:
        cycle, channel, first = rng.integers(k), rng.integers(m), rng.integers(p)
        n = min(rng.integers(max(1, most // 4), most + 1), left)
        block = np.arange(first, first + n) % p
        left -= n - np.count_nonzero(hidden[cycle, channel, block])
        hidden[cycle, channel, block] = True
    return hidden.transpose(0, 2, 1)


def imputation_error(truth, imputed, hidden) -> float:
    """Normalised root mean square error over `hidden` samples: 1 is as bad as filling in the mean cycle.

    Args:
        truth: (K, P, m), NaN where not known.
        imputed: (K, P, m).
        hidden: (K, P, m) True where the imputed values were not to be seen.
    """
    scored = hidden & np.isfinite(truth)
    mean = np.where(np.isfinite(truth), truth, 0).sum(axis=0) / np.maximum(np.isfinite(truth).sum(axis=0), 1)
    return float(np.sqrt(np.mean((truth - imputed)[scored] ** 2) / np.mean((truth - mean)[scored] ** 2)))


def choose_rank(cycles: Cycles, ranks=(1, 2, 3, 5, 8, 12, 16, 20), seed=0, **settings) -> tuple[int, dict[int, float]]:
    """The number of components that fills hidden blocks best.

    Args:
        cycles: what the model will be fitted to.
        ranks: numbers of components to try; those that the cycles are too few for are left out.
        seed: int or Generator, for the blocks: 15 % of all samples.
        settings: of `FunctionalPCA`.

    Returns:
        the best rank, and the `imputation_error` of each.
    """
    hidden = hide_blocks(cycles.values, 0.15, seed=seed)
    shown = replace(cycles, values=np.where(hidden, np.nan, cycles.values))
    people = len(set(cycles.subject)) if settings.get("centre") == "subject" else 1
    errors = {}
    for rank in sorted(r for r in ranks if r <= len(cycles.values) - people):
        model = FunctionalPCA(rank, **settings).fit(shown)
        errors[rank] = imputation_error(cycles.values, model.imputed_, hidden)
    if not errors:
        raise MotionError(f"no rank of {tuple(ranks)} can be fitted to {len(cycles.values)} cycles: try smaller ones")
    return min(errors, key=errors.__getitem__), errors
