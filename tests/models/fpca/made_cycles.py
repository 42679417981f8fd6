"""Cycles made of a few smooth components, with noise and gaps, for the tests of functional PCA."""

import numpy as np

from benchmarks.models.imputation import hide_blocks
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.types import Cycles


def as_cycles(values, subject=None) -> Cycles:
    k, _, m = values.shape
    channels = tuple(f"angle_{a}" for a in range(m))
    return Cycles(values, channels, np.ones(k), np.arange(k), subject or ("one",) * k)


def low_rank(k=60, p=64, m=4, q=3, noise=0.05, seed=0, n_harmonics=6):
    """Cycles (k, p, m) of q smooth components with falling variance, and the components."""
    rng = np.random.default_rng(seed)
    basis = sampled_basis(p, n_harmonics)
    w = np.linalg.qr(rng.standard_normal((basis.shape[1] * m, q)))[0].T.reshape(q, -1, m)
    scores = rng.standard_normal((k, q)) * 8 * 0.6 ** np.arange(q)
    mean = basis @ rng.standard_normal((basis.shape[1], m))
    components = basis @ w
    return mean + np.tensordot(scores, components, axes=1) + noise * rng.standard_normal((k, p, m)), components


def with_gaps(values, share=0.2, seed=1):
    hidden = hide_blocks(values, share, seed=seed)
    return np.where(hidden, np.nan, values), hidden
