"""Filtering and interpolation of captured paths."""

import numpy as np
import pytest

from motionenv.gait.signals import bridged, smoothed


@pytest.mark.parametrize("fps", [30.0, 100.0, 300.0])
def test_straight_paths_pass_from_end_to_end(fps):
    """A filter that hasn't settled at the ends would slow a walker down there."""
    path = np.arange(round(1.3 * fps))[:, None] / fps * [1.2, -0.3]
    for cutoff in (0.5, 0.8, 7.0):
        np.testing.assert_allclose(smoothed(path, fps, cutoff), path, atol=0.002)


def test_the_cutoff_halves_an_amplitude_and_delays_nothing():
    t = np.arange(1000) / 100
    wave = np.cos(2 * np.pi * 2 * t)[:, None]
    middle = slice(200, 800)
    np.testing.assert_allclose(smoothed(wave, 100.0, 2.0)[middle], 0.5 * wave[middle], atol=0.01)
    np.testing.assert_allclose(smoothed(wave, 100.0, 40.0)[middle], wave[middle], atol=0.01)
    np.testing.assert_array_equal(smoothed(wave, 4.0, 2.0), wave)


@pytest.mark.parametrize("frames", range(1, 12))
def test_short_paths_stay_finite(frames):
    path = np.random.default_rng(frames).standard_normal((frames, 3))
    assert np.isfinite(smoothed(path, 100.0, 7.0)).all()


def test_gaps_are_bridged_and_ends_are_held():
    path = np.array([[np.nan, 0], [1, 1], [np.nan, 7], [3, 3], [np.nan, np.nan]])
    np.testing.assert_allclose(bridged(path), [[1, 1], [1, 1], [2, 2], [3, 3], [3, 3]])
    assert np.isnan(bridged(np.full((4, 2), np.nan))).all()
