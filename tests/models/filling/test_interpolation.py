"""Interpolation across gaps: smooth at the borders, back to the level of its surroundings in long gaps."""

import numpy as np
import pytest

from motionenv.models.filling.interpolation import SCALE, around, interpolated


def gappy(values, first, last):
    values = np.array(values, dtype=float)
    values[first:last] = np.nan
    return values


def test_a_short_gap_in_a_slow_wave_is_closed():
    t = np.arange(200) / 100
    wave = np.sin(2 * np.pi * t)
    found = interpolated(gappy(wave, 90, 105), 90, 105, 100.0)
    np.testing.assert_allclose(found, wave[90:105], atol=0.02)


def test_it_meets_what_is_known_on_both_sides_without_a_jump():
    rng = np.random.default_rng(0)
    curve = np.cumsum(np.cumsum(rng.normal(size=300))) * 1e-3
    found = interpolated(gappy(curve, 100, 190), 100, 190, 100.0)
    steps = np.abs(np.diff(np.concatenate([curve[:100], found, curve[190:]])))
    assert steps[98:101].max() < 2 * np.abs(np.diff(curve)).max()
    assert steps[188:191].max() < 2 * np.abs(np.diff(curve)).max()


def test_far_inside_a_long_gap_only_the_level_is_left():
    found = interpolated(gappy(np.full(400, 3.0), 100, 300), 100, 300, 50.0)
    np.testing.assert_allclose(found, 3.0, atol=0.15)
    swinging = np.sin(np.arange(1000) / 50 * 2 * np.pi)
    found = interpolated(gappy(swinging, 400, 600), 400, 600, 50.0)
    middle = slice(round(6 * SCALE * 50), -round(6 * SCALE * 50))
    assert np.abs(found[middle]).max() < 0.3


def test_nothing_known_nearby_gives_zero():
    np.testing.assert_array_equal(interpolated(np.full(20, np.nan), 5, 15, 10.0), np.zeros(10))


@pytest.mark.parametrize("fps", [25.0, 100.0, 240.0])
def test_frames_around_a_gap_touch_it_and_are_as_many_at_every_rate(fps):
    frames = around(1000, 1200, 5000, fps)
    assert {999, 1200} <= set(frames)
    assert not ((frames >= 1000) & (frames < 1200)).any()
    assert len(frames) <= 2 * 75
    assert around(0, 3, 3, fps).size == 0
