"""Fourier walkers against signals built from known coefficients, and against numpy's least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker, steady_stretch
from motionenv.models.eigenwalkers.fourier_series import (
    LEFT_ANKLE,
    PELVIS,
    centred,
    grounded,
    harmonic_power,
    in_phase,
    positions_at,
)
from motionenv.types import MARKERS, Markers
from tests.models.eigenwalkers.walks import random_walker

TURNS = st.floats(-np.pi, np.pi)


def rotated(positions, heading):
    c, s = np.cos(heading), np.sin(heading)
    return positions @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T


def captured(w, frequency, *, start=0.0, speed=1.2, side=0.0, heading=0.0, seconds=4.0, fps=100.0) -> Markers:
    """The walk of coefficients `w` over the ground, in the direction `heading`, from anywhere in its cycle."""
    t = np.arange(round(seconds * fps)) / fps
    positions = positions_at(w, 2 * np.pi * frequency * t + start)
    positions[..., 0] += speed * t[:, None]
    positions[..., 1] += side * t[:, None]
    return Markers(MARKERS, rotated(positions, heading) + np.array([3.0, -2.0, 0.0]), fps)


@settings(max_examples=40)
@given(st.floats(0.65, 1.4), TURNS, TURNS, st.floats(0.4, 2.0), st.floats(-0.05, 0.05), st.integers(0, 50))
def test_known_series_are_recovered(frequency, start, heading, speed, side, seed):
    w = random_walker(seed)
    markers = captured(w, frequency, start=start, speed=speed, side=side, heading=heading)
    found = fourier_walker(markers, drift=1, steady=0)
    assert found.frequency == pytest.approx(frequency, abs=1e-7)
    assert found.strides == pytest.approx(4 * frequency)
    assert found.speed == pytest.approx(np.hypot(speed, side), abs=1e-6)
    expected = grounded(centred(in_phase(rotated(w, -np.arctan2(side, speed)))))
    np.testing.assert_allclose(found.coefficients, expected, atol=1e-6)
    power = harmonic_power(w)
    np.testing.assert_allclose(found.shares, power / power.sum(), atol=1e-6)


def test_a_walker_on_a_treadmill_goes_where_it_faces():
    w = random_walker()
    found = fourier_walker(captured(w, 0.9, speed=0.0, heading=2.0))
    left = found.coefficients[0, MARKERS.index("left_hip")] - found.coefficients[0, MARKERS.index("right_hip")]
    left = left + found.coefficients[0, MARKERS.index("left_shoulder")]
    left = left - found.coefficients[0, MARKERS.index("right_shoulder")]
    np.testing.assert_allclose(left[:2] / np.hypot(*left[:2]), [0, 1], atol=1e-6)
    assert found.speed == pytest.approx(0, abs=1e-6)


@settings(max_examples=15)
@given(st.integers(0, 30))
def test_gaps_change_nothing_but_what_they_hide(seed):
    rng = np.random.default_rng(seed)
    markers = captured(random_walker(seed), 0.9, heading=0.7)
    positions = markers.positions.copy()
    for marker in rng.choice([m for m in range(15) if m != PELVIS], 5, replace=False):
        first = rng.integers(0, 250)
        positions[first : first + 150, marker] = np.nan
    hidden = MARKERS.index("left_wrist")
    positions[:, hidden] = np.nan
    part = fourier_walker(Markers(MARKERS, positions, 100.0), drift=1)
    whole = fourier_walker(markers, drift=1)
    assert np.isnan(part.coefficients[:, hidden]).all()
    kept = [m for m in range(15) if m != hidden]
    np.testing.assert_allclose(part.coefficients[:, kept], whole.coefficients[:, kept], atol=1e-6)


def test_a_marker_seen_only_in_one_corner_of_the_cycle_is_not_made_up():
    markers = captured(random_walker(), 1.0)
    positions = markers.positions.copy()
    positions[:, 7] = np.where((np.arange(400) % 100 < 25)[:, None], positions[:, 7], np.nan)
    assert np.isnan(fourier_walker(Markers(MARKERS, positions, 100.0)).coefficients[:, 7]).all()


def test_noise_gives_the_shares_that_its_variance_says():
    rng = np.random.default_rng(5)
    w = random_walker()
    markers = captured(w, 0.95, seconds=12.0)
    noisy = Markers(MARKERS, markers.positions + 0.02 * rng.standard_normal((1200, 15, 3)), 100.0)
    power = harmonic_power(w)
    expected = power / (power.sum() + 45 * 0.02**2)
    np.testing.assert_allclose(fourier_walker(noisy).shares, expected, atol=0.01)


def test_the_steady_stretch_leaves_start_and_stop_out():
    t = np.arange(1200) / 100
    speed = np.interp(t, [0, 2, 4, 9, 11, 12], [0, 0, 1.4, 1.4, 0, 0])
    positions = np.zeros((1200, 15, 3))
    positions[..., 0] = (np.cumsum(speed) / 100)[:, None]
    found = steady_stretch(Markers(MARKERS, positions, 100.0), 0.6)
    # 0.6 of 1.4 m/s is passed at 3.2 s and at 9.8 s
    assert abs(found.start - 320) < 20
    assert abs(found.stop - 980) < 20
    assert steady_stretch(Markers(MARKERS, positions, 100.0), 0.0) == slice(0, 1200)
    assert steady_stretch(Markers(MARKERS, positions[:250], 100.0)) == slice(0, 250)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p[:150], "two strides"),
        (lambda p: p[:60], "too short"),
        (lambda p: np.where(np.arange(15)[:, None] == PELVIS, np.nan, p), "pelvis"),
        (lambda p: np.where(np.arange(15)[:, None] >= LEFT_ANKLE, np.nan, p), "ankle"),
        (lambda p: np.where(p > 3.3, np.inf, p), "infinite"),
    ],
)
def test_walks_that_say_too_little_are_refused(change, says):
    positions = change(captured(random_walker(), 0.9).positions)
    with pytest.raises(MotionError, match=says):
        fourier_walker(Markers(MARKERS, positions, 100.0))


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ({"frequencies": (1.0, 0.5)}, "frequencies"),
        ({"frequencies": (0.0, 2.0)}, "frequencies"),
        ({"steady": 1.5}, "steady"),
        ({"drift": -1}, "drift"),
    ],
)
def test_settings_out_of_range_are_refused(setting, says):
    with pytest.raises(MotionError, match=says):
        fourier_walker(captured(random_walker(), 0.9), **setting)


def test_only_the_15_markers_make_a_walker():
    with pytest.raises(MotionError, match="to_markers"):
        fourier_walker(Markers(("a", "b"), np.zeros((300, 2, 3)), 100.0))
    with pytest.raises(MotionError, match="ndarray"):
        fourier_walker(np.zeros((300, 15, 3)))
