"""Cycles on the common grid: against splines known beforehand, the paper's count, and real data between its samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from motionenv.cycles import Alignment, align, segment, spline_basis, to_reference
from motionenv.errors import GapError, MotionError
from motionenv.types import ANGLES, POSE


def placed(periods, offsets, m=1):
    """An alignment made by hand."""
    return Alignment(np.asarray(periods, float), np.asarray(offsets, float), np.zeros((10, m)), np.zeros(1))


def piecewise(seed, frames, period, offset, m=2):
    """Frames of a motion that is another spline in every cycle, and their values on 64 points (cycles, 64, m)."""
    place = (np.arange(frames) - offset) / period
    number = np.floor(place).astype(int)
    rng = np.random.default_rng(seed)
    shapes = {k: rng.normal(size=(13, m)) for k in np.unique(number)}
    z = np.stack([spline_basis(x - k)[0] @ shapes[k] for x, k in zip(place, number, strict=True)])
    return z, np.stack([spline_basis(np.arange(64) / 64) @ shapes[k] for k in sorted(shapes)])


@given(st.integers(0, 2**32), st.floats(40, 90), st.integers(1, 39), st.integers(150, 300), st.booleans())
@settings(max_examples=40, deadline=None)
def test_splines_come_back(seed, period, offset, frames, gaps):
    z, truth = piecewise(seed, frames, period, offset)
    if gaps:
        z[frames // 2 : frames // 2 + 20, 0] = np.nan
    got = to_reference([z], placed([period], [offset]), 50.0, samples=64).values
    away = np.nanmax(np.abs(got[:, None] - truth), axis=(2, 3)).min(axis=1)
    assert (away < 1e-6).all()
    assert len(got) >= len(truth) - 2


def test_partial_ends_are_kept_and_stay_open():
    z, truth = piecewise(0, 350, 100, 30)
    got = to_reference([z], placed([100], [30]), 50.0, samples=64).values
    before, after = np.arange(64) / 64 < 0.7 - 1 / 100, np.arange(64) / 64 > 0.2
    assert len(got) == 5
    assert np.isnan(got[0, before]).all()
    assert np.isnan(got[4, after]).all()
    assert np.isnan(got).sum() == 2 * (before.sum() + after.sum())
    np.testing.assert_allclose(got[~np.isnan(got)], truth[~np.isnan(got)], atol=1e-8)


@given(st.floats(20, 60), st.integers(1, 19), st.integers(120, 300))
@settings(max_examples=60, deadline=None)
def test_number_of_cycles(period, offset, frames):
    """K_i = ⌈(T_i - o)/p⌉ + 1, less an end too short for a single point of the grid."""
    z = np.random.default_rng(0).normal(size=(frames, 1))
    got = to_reference([z], placed([period], [offset]), 50.0)
    want = np.ceil((frames - offset) / period) + 1
    assert want - 2 <= len(got.values) <= want
    np.testing.assert_array_equal(got.seconds, period / 50)


def test_gaps_stay_gaps():
    """A gap of a quarter of a cycle is left open but for a frame at its rims; one of 6 % is bridged."""
    turn = np.arange(300)[:, None] / 100
    z = np.sin(2 * np.pi * turn + [0.0, 1.0, 2.0])
    z[130:155, 0] = np.nan
    z[130:136, 1] = np.nan
    got = to_reference([z], placed([100], [0]), 100.0, samples=100).values
    assert np.isnan(got[1, 31:54, 0]).all()
    assert not np.isnan(got[1, :29, 0]).any()
    assert not np.isnan(got[1, 56:, 0]).any()
    assert not np.isnan(got[:, :, 1:]).any()
    whole = np.sin(2 * np.pi * np.arange(100)[:, None] / 100 + [0.0, 1.0, 2.0])
    assert np.nanmax(np.abs(got - whole)) < 2e-3


def test_a_channel_never_seen_is_nan_and_an_empty_cycle_is_left_out():
    z = np.random.default_rng(1).normal(size=(400, 2))
    z[:, 1] = np.nan
    z[100:200] = np.nan
    got = to_reference([z], placed([100], [0]), 100.0)
    assert len(got.values) == 3
    assert np.isnan(got.values[:, :, 1]).all()


def test_segment_lets_channels_ride_along():
    """Drifting channels that don't steer change nothing; labels, names and durations are of the sequence."""
    turn = 2 * np.pi * np.arange(420)[:, None] / np.array([[100.0]])
    angles = [np.sin(turn * k + np.arange(19)) + 0.3 * np.cos(2 * turn * k) for k in (1.0, 0.9)]
    poses = [np.hstack([np.cumsum(np.ones((420, 6)), axis=0), a]) for a in angles]
    alone = segment(angles, 100, subjects=["ann", "bob"])
    both = segment(poses, 100, steer=slice(6, None), subjects=["ann", "bob"])
    np.testing.assert_allclose(both.values[:, :, 6:], alone.values)
    assert (alone.channels, both.channels) == (ANGLES, POSE)
    assert set(zip(both.subject, both.sequence.tolist(), both.seconds.round(2), strict=True)) == {
        ("ann", 0, 1.0),
        ("bob", 1, 1.11),
    }
    at_50 = segment([angles[0][::2], angles[1]], [50, 100])
    np.testing.assert_allclose(np.unique(at_50.seconds), [1.0, 1 / 0.9], rtol=1e-3)


def test_real_walks_pass_through_their_samples(cmu_walks):
    """Between the spline of a cycle and a curve through all samples: under 0.7° rms, over nine walks."""
    walks = cmu_walks[:9]
    sequences = [w.angles for w in walks]
    alignment = align(sequences, [130] * 9)
    got = to_reference(sequences, alignment, 120)
    assert got.values.shape[1:] == (128, 19)
    away = []
    for i in range(9):
        own = got.values[got.sequence == i]
        first = int(np.floor(-alignment.offsets[i] / 130))
        frames = alignment.offsets[i] + 130 * (first + np.arange(len(own))[:, None] + np.arange(128) / 128)
        curve = CubicSpline(np.arange(len(sequences[i])), sequences[i])(frames)
        away.append((own - curve)[(frames >= 0) & (frames <= len(sequences[i]) - 1)].ravel())
    away = np.concatenate(away)
    assert np.isnan(away).mean() < 0.01
    assert np.degrees(np.sqrt(np.nanmean(away**2))) < 0.7


def test_real_walks_are_brought_into_step(cmu_walks):
    """After alignment the hips of 95 % of all cycles swing within 3 % of a cycle of each other."""
    got = segment([w.angles for w in cmu_walks], 120, subjects=[w.name[:2] for w in cmu_walks])
    left, right = (ANGLES.index(f"{side}_hip_flexion") for side in ("left", "right"))
    whole = got.values[~np.isnan(got.values[:, :, [left, right]]).any(axis=(1, 2))]
    swing = np.fft.rfft(whole[:, :, left] - whole[:, :, right], axis=1)[:, 1]
    assert len(whole) > 100
    assert np.quantile(np.abs(np.angle(swing / swing.mean())), 0.95) / (2 * np.pi) < 0.035
    assert len(set(got.subject)) == 13


def test_refusals():
    z = np.sin(2 * np.pi * np.arange(300)[:, None] / 60 + np.arange(3))
    good = align([z], [60])
    for wrong in ({"samples": 1}, {"samples": 10.5}, {"channels": ["a"]}, {"subjects": ["a", "b"]}):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            to_reference([z], good, 100, **wrong)
    with pytest.raises(MotionError, match="fps"):
        to_reference([z], good, 0)
    with pytest.raises(MotionError, match="must match the alignment"):
        to_reference([z, z], good, 100)
    with pytest.raises(MotionError, match="frame rate is too low"):
        to_reference([np.ones((12, 1))], placed([3], [0.5]), 3, samples=5)
    with pytest.raises(MotionError, match=r"sequence 1: no period"):
        segment([z, np.random.default_rng(0).normal(size=(300, 3))], 100)
    with pytest.raises(GapError, match=r"sequence 0: fewer than two"):
        segment([z[:40]], 100)
