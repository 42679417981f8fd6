"""Fourier walkers against signals built from known coefficients, and against numpy's least squares."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.body.skeleton import ANKLE_HEIGHT, from_height
from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker, steady_stretch
from motionenv.models.eigenwalkers.fourier_series import (
    LEFT_ANKLE,
    PELVIS,
    RIGHT_ANKLE,
    FourierWalker,
    centred,
    columns,
    grounded,
    harmonic_power,
    in_phase,
    later,
    positions_at,
)
from motionenv.types import MARKERS, Markers

TURNS = st.floats(-np.pi, np.pi)


def random_walker(seed=0) -> np.ndarray:
    """Coefficients (5, 15, 3) of something that goes forward: a body with waves, its legs in opposite phase."""
    rng = np.random.default_rng(seed)
    w = np.concatenate([np.zeros((1, 15, 3)), 0.03 * rng.standard_normal((4, 15, 3))])
    w[0] = np.random.default_rng(seed + 1).normal(0, 0.02, (15, 3)) + standing()
    w[2, [LEFT_ANKLE, RIGHT_ANKLE], 0] += [0.3, -0.3]
    return w


def standing() -> np.ndarray:
    """Where the markers of a standing body are (15, 3) [m], the pelvis 0.9 m high."""
    offsets = from_height(1.75).offsets[:15].copy()
    for side in ("left", "right"):
        for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
            for near, far in pairwise(chain):
                offsets[MARKERS.index(f"{side}_{far}")] += offsets[MARKERS.index(f"{side}_{near}")]
    offsets[MARKERS.index("head")] += [0, 0, 0.525]
    return offsets + np.array([0, 0, 0.93])


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


def test_columns_are_equation_3_1_and_its_derivatives():
    phase = np.linspace(-4, 9, 300)
    expected = np.stack([phase**0, np.sin(phase), np.cos(phase), np.sin(2 * phase), np.cos(2 * phase)], axis=-1)
    np.testing.assert_allclose(columns(phase), expected)
    step = 1e-5
    for d in (1, 2):
        slope = (columns(phase + step, d - 1) - columns(phase - step, d - 1)) / (2 * step)
        np.testing.assert_allclose(columns(phase, d), slope, atol=1e-8)


@given(TURNS, st.integers(0, 20))
def test_a_later_start_is_the_same_motion(turn, seed):
    w, phase = random_walker(seed), np.linspace(0, 7, 40)
    np.testing.assert_allclose(positions_at(later(w, turn), phase), positions_at(w, phase + turn), atol=1e-12)
    np.testing.assert_allclose(harmonic_power(later(w, turn)), harmonic_power(w))


@given(TURNS)
def test_zero_phase_is_where_the_left_ankle_leads_most(start):
    w = in_phase(later(random_walker(), start))
    np.testing.assert_allclose(w, in_phase(random_walker()), atol=1e-12)
    fundamental = np.where(np.arange(5)[:, None, None] < 3, w, 0)
    cycle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    x = positions_at(fundamental, cycle)[..., 0]
    assert (x[:, LEFT_ANKLE] - x[:, RIGHT_ANKLE]).argmax() == 0


def test_one_ankle_is_enough_for_the_phase_and_none_is_not():
    w = random_walker()
    w[1:3, RIGHT_ANKLE] = -w[1:3, LEFT_ANKLE]
    known = in_phase(w)
    for missing in (LEFT_ANKLE, RIGHT_ANKLE):
        part = w.copy()
        part[:, missing] = np.nan
        kept = [m for m in range(15) if m != missing]
        np.testing.assert_allclose(in_phase(part)[:, kept], known[:, kept], atol=1e-12)
    w[:, [LEFT_ANKLE, RIGHT_ANKLE]] = np.nan
    with pytest.raises(GapError, match="ankle"):
        in_phase(w)


def test_grounded_stands_on_the_ground_and_changes_nothing_else():
    w = random_walker()
    w[0, :, 2] += 5.0
    g = grounded(w)
    np.testing.assert_allclose(g, grounded(g), atol=1e-12)
    np.testing.assert_array_equal(g[1:], w[1:])
    np.testing.assert_allclose(np.ptp(g[0] - w[0], axis=0), 0, atol=1e-12)
    lowest = positions_at(g, np.linspace(0, 6.3, 500))[:, [LEFT_ANKLE, RIGHT_ANKLE], 2].min()
    # 0.491 of a standing height from ankle to pelvis, the ankle at 0.039 of it
    assert lowest == pytest.approx(ANKLE_HEIGHT / 0.491 * (g[0, PELVIS, 2] - lowest), abs=1e-4)


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


def test_a_walker_needs_a_frequency_and_no_infinity():
    with pytest.raises(MotionError, match="frequency"):
        FourierWalker(random_walker(), 0.0)
    with pytest.raises(MotionError, match="infinity"):
        FourierWalker(random_walker() * np.inf, 1.0)
    with pytest.raises(MotionError, match=r"\(5, 15, 3\)"):
        FourierWalker(np.zeros((5, 45)), 1.0)
