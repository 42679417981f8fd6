"""Functional PCA against closed forms, brute force and Theorem 1."""

import numpy as np

from motionenv.models.fpca import FunctionalPCA
from motionenv.types import Cycles


def as_cycles(values, subject=None) -> Cycles:
    k, _, m = values.shape
    channels = tuple(f"angle_{a}" for a in range(m))
    return Cycles(values, channels, np.ones(k), np.arange(k), subject or ("one",) * k)


def test_without_gaps_fig_8_is_the_svd_of_the_smoothed_cycles():
    values = np.random.default_rng(0).standard_normal((12, 48, 3))
    model = FunctionalPCA(4, n_harmonics=6, method="svd").fit(as_cycles(values))
    spectrum = np.fft.rfft(values - values.mean(axis=0), axis=1)
    spectrum[:, 6:] = 0
    smooth = np.fft.irfft(spectrum, 48, axis=1).reshape(12, -1)
    _, s, vt = np.linalg.svd(smooth)
    np.testing.assert_allclose(model.singular_values_, s[:4])
    np.testing.assert_allclose(np.abs(np.sum(model.components_.reshape(4, -1) * vt[:4], axis=1)), 1)
