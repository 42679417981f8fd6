"""Cycle lengths: made-up rhythms whose truth is known, noise that has none, and real walks against their events."""

import numpy as np
import pytest

from motionenv.cycles import estimate_period
from motionenv.errors import GapError, MotionError


def rhythm(seed, frames, period, m=19, noise=0.0, missing=0.0):
    """Four harmonics in every channel, of unit variance, plus noise of this standard deviation."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * np.arange(frames)[:, None] / period
    z = sum(np.cos(k * turn + rng.uniform(0, 6.3, m)) * rng.normal(size=m) / k**1.5 for k in range(1, 5))
    z = z / z.std(axis=0) + noise * rng.normal(size=(frames, m))
    z[rng.random(z.shape) < missing] = np.nan
    return z


def warped(seed, step_times, fps=100, m=6):
    """A rhythm whose strides last the given times [s]."""
    ends = np.cumsum([0, *step_times])
    turns = np.interp(np.arange(0, ends[-1], 1 / fps), ends, np.arange(len(ends)))
    rng = np.random.default_rng(seed)
    return sum(np.cos(2 * np.pi * k * turns[:, None] + rng.uniform(0, 6.3, m)) / k for k in (1, 2, 3))


@pytest.mark.parametrize(("frames", "period", "fps"), [(343, 132.4, 120), (5000, 126.5, 120), (150, 33.3, 30)])
@pytest.mark.parametrize(("noise", "percent"), [(0.0, 0.05), (0.2, 0.5), (0.5, 1.5)])
def test_fractional_period(frames, period, fps, noise, percent):
    for seed in range(3):
        got = estimate_period(rhythm(seed, frames, period, noise=noise, missing=0.2), fps)
        assert got.frames == pytest.approx(period, rel=percent / 100)
        assert got.seconds == got.frames / fps
        assert got.significance < 1e-6
        assert got.recurrence < 0.5


def test_a_step_is_not_a_cycle():
    """Left and right do the same half a cycle apart, so that the step would do if they were not told apart."""
    right = rhythm(0, 800, 110.0, m=4)
    z = np.hstack([right[:-55], right[55:]])
    assert estimate_period(z, 100).frames == pytest.approx(110, rel=1e-3)


def test_a_double_cycle_is_halved():
    """Strides that alternate by 5 %: the pair repeats exactly, and the stride is reported."""
    z = warped(1, [1.05, 1.0] * 4)
    got = estimate_period(z, 100)
    assert got.curve.candidates[got.curve.total.argmax()] == 205
    assert got.seconds == pytest.approx(1.025, rel=0.02)


def test_starting_and_stopping_do_not_stretch_the_cycle():
    assert estimate_period(warped(2, [1.35, 1.1, 1.1, 1.1, 1.1, 1.35]), 100).seconds == pytest.approx(1.1, rel=0.01)


def test_units_order_and_useless_channels_change_nothing():
    z = rhythm(3, 400, 93.7, m=5, noise=0.3, missing=0.1)
    want = estimate_period(z, 100)
    useless = np.hstack([z[:, ::-1] * [1, 57.3, 1e-3, 2, 1] + 4, np.full((400, 1), 0.7), np.full((400, 1), np.nan)])
    got = estimate_period(useless, 100)
    assert got.frames == pytest.approx(want.frames, rel=1e-9)
    assert got.peak == pytest.approx(want.peak, rel=1e-6)


@pytest.mark.parametrize("missing", [0.0, 0.4])
@pytest.mark.parametrize("m", [1, 3, 19])
def test_white_noise_has_no_period(m, missing):
    alarms = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        z = rng.normal(size=(rng.integers(150, 600), m))
        z[rng.random(z.shape) < missing] = np.nan
        alarms += has_period(z, 60)
    assert alarms <= 2


@pytest.mark.parametrize(("m", "most"), [(1, 12), (3, 2), (19, 0)])
def test_random_walks_have_no_period(m, most):
    """One wandering channel may look like two cycles now and then (about 1 in 20); several don't."""
    walks = (np.random.default_rng(seed).normal(size=(400, m)).cumsum(axis=0) for seed in range(100))
    assert sum(has_period(z, 100) for z in walks) <= most


def has_period(z, fps):
    try:
        estimate_period(z, fps)
    except MotionError:
        return False
    return True


def test_refusals():
    z = rhythm(0, 300, 60.0)
    with pytest.raises(GapError, match="fewer than two cycles"):
        estimate_period(z[:90], 100)
    seen_briefly = np.full((300, 2), np.nan)
    seen_briefly[100:180] = z[:80, :2]
    with pytest.raises(GapError, match="fewer than two cycles"):
        estimate_period(seen_briefly, 100)
    with pytest.raises(GapError, match="no observations"):
        estimate_period(np.full((300, 2), np.nan), 100)
    with pytest.raises(MotionError, match="end of the range"):
        estimate_period(z, 100, range_seconds=(0.5, 0.59))
    with pytest.raises(MotionError, match="range_seconds"):
        estimate_period(z, 100, range_seconds=(2, 1))
    with pytest.raises(MotionError, match="no period"):
        estimate_period(np.ones((300, 2)), 100)
    for fps in (0, -1, np.nan, "fast"):
        with pytest.raises(MotionError, match="fps"):
            estimate_period(z, fps)


@pytest.mark.slow
def test_cmu_walks_agree_with_foot_and_knee_events(cmu_walks, events, occlude):
    full = [estimate_period(w.angles, 120).seconds / events(w.legs, 120) for w in cmu_walks]
    assert np.mean(np.abs(np.array(full) - 1) <= 0.02) >= 0.95
    gaps = [estimate_period(occlude(w.angles, 0), 120).seconds / events(w.legs, 120) for w in cmu_walks]
    assert np.mean(np.abs(np.array(gaps) - 1) <= 0.03) >= 0.95


def test_santos25_agrees_with_knee_events(santos_walks, events, occlude):
    """Four strides between standing and standing, of one leg."""
    full = [estimate_period(w.angles, 100).seconds / events(w.legs, 100) for w in santos_walks]
    assert np.mean(np.abs(np.array(full) - 1) <= 0.02) >= 0.95
    gaps = [estimate_period(occlude(w.angles, 0), 100).seconds / events(w.legs, 100) for w in santos_walks]
    assert np.mean(np.abs(np.array(gaps) - 1) <= 0.03) >= 0.95


@pytest.mark.slow
def test_double_cycle_trap(cmu_walks):
    """CMU 38_02: its automatic stride of 2.10 s is two strides."""
    (walk,) = (w for w in cmu_walks if w.name == "38_02")
    assert 0.98 < estimate_period(walk.angles, 120).seconds < 1.08


@pytest.mark.parametrize("channels", [1, 4])
@pytest.mark.parametrize("frame", [0, 130, 131, 399])
def test_a_spike_of_twenty_deviations_does_not_move_the_period(channels, frame):
    rng = np.random.default_rng(4)
    time = np.arange(400)[:, None] / 100
    z = (
        np.sin(2 * np.pi * time / 0.91 + np.arange(4))
        + 0.3 * np.sin(4 * np.pi * time / 0.91)
        + 0.02 * rng.standard_normal((400, 4))
    )
    alone = estimate_period(z, 100).frames
    z[frame, :channels] += 20 * z.std(axis=0)[:channels]
    assert estimate_period(z, 100).frames == pytest.approx(alone, rel=0.005)
