"""The signal-to-noise ratio against eq. 1-3 written out, and against what theory says of white noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.cycles import snr
from motionenv.errors import GapError, MotionError


def literal(z, candidates, weighting):
    """Eq. 1-3 bin by bin; empty bins don't count."""
    out = np.full((len(candidates), z.shape[1]), np.nan)
    for i, p in enumerate(candidates):
        for a in range(z.shape[1]):
            seen = np.flatnonzero(~np.isnan(z[:, a]))
            bins = [z[seen[seen % p == k], a] for k in range(p)]
            bins = [b for b in bins if len(b)]
            values = z[seen, a]
            q, n = len(bins), len(values)
            if q < 2 or n <= q:
                continue
            noise = sum(((b - b.mean()) ** 2).sum() for b in bins) / (n - q)
            if weighting == "paper":
                signal = sum((b.mean() - values.mean()) ** 2 for b in bins) / ((q - 1) * q / n)
            else:
                signal = sum(len(b) * (b.mean() - values.mean()) ** 2 for b in bins) / (q - 1)
            out[i, a] = signal / noise
    return out


def gappy(seed, frames, m, missing):
    rng = np.random.default_rng(seed)
    z = rng.normal(3.0, 2.0, (frames, m))
    z[rng.random(z.shape) < missing] = np.nan
    z[0] = 1.0
    return z


@pytest.mark.parametrize("weighting", ["counts", "paper"])
@given(st.integers(0, 2**32), st.integers(20, 300), st.integers(1, 9), st.floats(0, 0.8), st.sets(st.integers(2, 90)))
@settings(max_examples=40, deadline=None)
def test_equals_the_equations(weighting, seed, frames, m, missing, extra):
    z = gappy(seed, frames, m, missing)
    candidates = [7, 8, 16, 3, *extra]
    got = snr(z, candidates, weighting=weighting)
    assert got.candidates.tolist() == candidates
    np.testing.assert_allclose(got.channels, literal(z, candidates, weighting), rtol=1e-9)
    np.testing.assert_allclose(got.total, np.nansum(got.channels, axis=1))


@pytest.mark.parametrize("frames", [509, 510, 511, 512, 3000])
def test_counts_beyond_one_byte(frames):
    z = gappy(1, frames, 3, 0.0)
    np.testing.assert_allclose(snr(z, [2, 5]).channels, literal(z, [2, 5], "counts"), rtol=1e-9)


def test_white_noise_has_no_drift_with_counts_and_drifts_as_printed():
    """ambiguities.md: eq. 2 as printed assumes equal counts."""
    z = np.random.default_rng(0).normal(size=(500, 3000))
    candidates = np.arange(60, 220, 4)
    ours = snr(z, candidates).channels.mean(axis=1)
    # F with n - p degrees of freedom below has mean (n - p) / (n - p - 2)
    ours *= (500 - candidates - 2) / (500 - candidates)
    assert np.abs(ours - 1).max() < 0.01
    assert np.ptp(snr(z, candidates, weighting="paper").channels.mean(axis=1)) > 0.04


def test_constant_and_unseen_channels_take_no_part():
    z = gappy(2, 200, 4, 0.1)
    total = snr(z[:, :2], [20, 31]).total
    z[:, 2], z[:, 3] = 0.1, np.nan
    got = snr(z, [20, 31])
    assert np.isnan(got.channels[:, 2:]).all()
    np.testing.assert_allclose(got.total, total, rtol=1e-12)


def test_an_exact_period_is_finite_and_highest():
    z = np.tile(np.random.default_rng(3).normal(size=(25, 2)), (8, 1))
    got = snr(z, np.arange(10, 90))
    assert np.isfinite(got.total).all()
    assert got.candidates[got.total.argmax()] == 25


def test_refusals():
    with pytest.raises(GapError, match="no observations"):
        snr(np.full((50, 2), np.nan), [5])
    with pytest.raises(MotionError, match="shape"):
        snr(np.zeros(50), [5])
    with pytest.raises(MotionError, match="infinite"):
        snr(np.full((50, 2), np.inf), [5])
    with pytest.raises(MotionError, match="whole numbers"):
        snr(np.zeros((50, 2)), [5.5])
    with pytest.raises(MotionError, match="weighting"):
        snr(np.zeros((50, 2)), [5], weighting="other")
