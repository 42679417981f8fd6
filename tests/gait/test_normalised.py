"""Curves over the gait cycle."""

import numpy as np

from motionenv.gait import Stride, normalised
from motionenv.gait.normalised import mean_and_sd


def test_lines_pass_exactly_and_ends_are_the_contacts():
    values = np.stack([np.arange(100.0), -2 * np.arange(100.0)], -1)
    cut = normalised(values, 50.0, [Stride("left", 0.25, 1.35)])
    frames = np.linspace(12.5, 67.5, 101)
    np.testing.assert_allclose(cut[0], np.stack([frames, -2 * frames], -1))


def test_gaps_and_what_lies_outside_are_unknown():
    values = np.arange(100.0)[:, None]
    values[40] = np.nan
    cut = normalised(values, 100.0, [Stride("left", 0.2, 0.7), Stride("left", 0.9, 1.2), Stride("left", 0.5, 0.99)])
    frames = np.linspace(20, 70, 101)
    np.testing.assert_array_equal(np.isnan(cut[0, :, 0]), (frames > 39) & (frames < 41))
    np.testing.assert_array_equal(np.isfinite(cut[1, :, 0]), np.linspace(90, 120, 101) <= 99)
    assert cut[2, -1, 0] == 99
    assert normalised(values, 100.0, []).shape == (0, 101, 1)
    assert normalised(values[:1], 100.0, [Stride("left", 0.0, 0.5)])[0, 0, 0] == 0


def test_mean_and_sd_know_what_is_missing():
    curves = np.random.default_rng(0).standard_normal((5, 101))
    curves[:4, 0], curves[:, 1] = np.nan, np.nan
    mean, sd = mean_and_sd(curves)
    np.testing.assert_allclose(mean[2:], curves[:, 2:].mean(0))
    np.testing.assert_allclose(sd[2:], curves[:, 2:].std(0, ddof=1))
    assert (mean[0], np.isnan(sd[0]), np.isnan(mean[1])) == (curves[4, 0], True, True)
