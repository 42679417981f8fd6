r"""Scores of beliefs: distributions over the 15 joints, given as weighted samples.

The expectation of a proper score is optimal for reporting one's true belief (Gneiting & Raftery 2007). A calibrated
belief has the truth inside its credible region of level p in a fraction p of the cases.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import random_generator
from motionenv.errors import MotionError
from motionenv.types import MARKERS

_JOINTS = len(MARKERS)


def energy_score(samples: np.ndarray, log_weights: np.ndarray, truth: np.ndarray, *, fair: bool = False) -> np.ndarray:
    """Energy score (n,) [m] of beliefs, over the 45 coordinates jointly; 0 is perfect, smaller is better.

    E|X - y| - ½ E|X - X'| with X, X' independent draws of the belief and |·| the Euclidean norm in 45 dimensions: the
    negative of Gneiting & Raftery (2007, eq. 21) with β = 1. Divided by √15, it is comparable with an error per joint.

    Args:
        samples: (n, M, 15, 3) [m].
        log_weights: (n, M), up to a constant of each row; -inf excludes a sample.
        truth: (n, 15, 3) [m].
        fair: False scores the weighted sample as the belief itself, and is proper. True treats it as M draws of a
            belief and estimates that belief's score without bias for any M (Ferro 2014). Use it to compare filters with
            different numbers of particles, never as a reward, because samples that aren't independent draws can exploit
            it. Needs two samples.

    Raises:
        MotionError: wrong shapes, a weight that is NaN or +inf, no sample with a weight above zero, or, with `fair`,
            only one.
    """
    from motionenv.metrics._belief_kernel import mean_apart

    samples, weights, truth = _belief(samples, log_weights, truth)
    n, m = weights.shape
    flat, apart = samples.reshape(n, m, 3 * _JOINTS), np.empty(n)
    near = (weights * np.linalg.norm(flat - truth.reshape(n, 1, 3 * _JOINTS), axis=-1)).sum(axis=-1)
    mean_apart(flat, weights, apart)
    if not fair:
        return near - 0.5 * apart
    other = 1.0 - (weights**2).sum(axis=1)
    if (other <= 0).any():
        raise MotionError("fair=True needs two samples with weights above zero: use fair=False")
    return near - 0.5 * apart / other


def credible_level(
    samples: np.ndarray, log_weights: np.ndarray, truth: np.ndarray, *, seed: int | np.random.Generator | None = None
) -> np.ndarray:
    """The level (n, 15) of the smallest credible region of each joint that contains its truth, from 0 to 1.

    For a calibrated belief it is uniform on (0, 1). Regions consist of the points with the smallest mean distance to
    the pooled samples and truth, so that truth and samples are treated symmetrically (Gneiting et al. 2008, section
    3.1, with the mean distance as pre-rank); ties and the truth's own share are broken at random. Exact for samples of
    equal weight, for any M; with weights, the truth counts as one of 1/Σw² samples. NaN where the truth is NaN.

    `samples`, `log_weights` and `truth` are as in `energy_score`, and so are errors; `seed`, int or Generator, is for
    the ties.
    """
    from scipy.spatial.distance import cdist  # takes a while to import

    samples, weights, truth = _belief(samples, log_weights, truth)
    effective = 1.0 / (weights**2).sum(axis=1, keepdims=True)
    pooled = np.concatenate([effective * weights, np.ones_like(effective)], axis=1) / (1.0 + effective)
    deeper, alike = np.zeros((2, len(samples), _JOINTS))
    for i, joint in np.ndindex(deeper.shape):
        points = np.vstack([samples[i, :, joint], truth[i, joint]])
        mean = cdist(points, points) @ pooled[i]
        slack = 1e-12 * mean[-1]
        deeper[i, joint] = pooled[i, mean < mean[-1] - slack].sum()
        alike[i, joint] = pooled[i, np.abs(mean - mean[-1]) <= slack].sum()
    levels = deeper + random_generator(seed).random(deeper.shape) * alike
    return np.where(np.isfinite(truth).all(axis=-1), levels, np.nan)


def coverage(
    samples: np.ndarray, log_weights: np.ndarray, truth: np.ndarray, p: ArrayLike, *,
    seed: int | np.random.Generator | None = None,
) -> np.ndarray:  # fmt: skip
    """Fraction (..., 15) of the known truths inside the credible region of level `p`; p for a calibrated belief.

    `p` (...) is a level or levels from 0 to 1; `samples`, `log_weights`, `truth` and `seed` are as in `credible_level`.

    Raises:
        MotionError: as in `energy_score`, or a level outside 0 to 1.
    """
    levels = np.asarray(p, dtype=np.float64)
    if not ((levels >= 0) & (levels <= 1)).all():
        raise MotionError(f"p must be a level or levels from 0 to 1, got {p!r}")
    smallest = credible_level(samples, log_weights, truth, seed=seed)
    with np.errstate(invalid="ignore"):
        return (smallest <= levels[..., None, None]).sum(axis=-2) / np.isfinite(smallest).sum(axis=0)


def _belief(samples, log_weights, truth) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Samples and truth as float, C-ordered, and weights (n, M) with sum 1."""
    samples, truth = (np.ascontiguousarray(a, dtype=np.float64) for a in (samples, truth))
    log_weights = np.asarray(log_weights, dtype=np.float64)
    n, m = log_weights.shape if log_weights.ndim == 2 else (len(truth), 0)
    if samples.shape != (n, m, _JOINTS, 3) or truth.shape != (n, _JOINTS, 3) or not m:
        raise MotionError(
            "samples (n, M, 15, 3), log_weights (n, M) and truth (n, 15, 3) must agree, got shapes "
            f"{samples.shape}, {log_weights.shape} and {truth.shape}"
        )
    greatest = log_weights.max(axis=1, keepdims=True)
    if not np.isfinite(greatest).all():
        raise MotionError("log_weights must be finite or -inf, and at least one of each belief finite")
    weights = np.exp(log_weights - greatest)
    return samples, weights / weights.sum(axis=1, keepdims=True), truth
