"""Errors of point estimates against definitions, invariances and scipy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import procrustes
from scipy.spatial.transform import Rotation

from motionenv.errors import MotionError
from motionenv.metrics import aligned_mpjpe, mpjpe, pelvis_mpjpe
from motionenv.types import MARKERS

SEEDS = st.integers(0, 2**32 - 1)


def bodies(seed, *shape):
    return np.random.default_rng(seed).normal(0, 0.4, (*shape, 15, 3))


def moved(points, seed, size=1.0):
    rng = np.random.default_rng(seed)
    turn = Rotation.random(rng=rng).as_matrix()
    return size * points @ turn.T + rng.normal(0, 3, 3)


def test_it_is_the_mean_distance():
    a, b = bodies(0, 4, 2), bodies(1, 4, 2)
    by_hand = [
        [np.mean([np.hypot.reduce(a[i, j, k] - b[i, j, k]) for k in range(15)]) for j in range(2)] for i in range(4)
    ]
    np.testing.assert_allclose(mpjpe(a, b), by_hand)
    assert mpjpe(a, b[0, 0]).shape == (4, 2)


def test_unknown_truth_is_left_out_and_unknown_estimates_are_not():
    a, b = bodies(0), bodies(1)
    b[3] = np.nan
    rest = np.delete(np.arange(15), 3)
    assert mpjpe(a, b) == pytest.approx(np.linalg.norm(a - b, axis=-1)[rest].mean())
    assert np.isfinite(aligned_mpjpe(a, b))
    a[5] = np.nan
    assert np.isnan(mpjpe(a, b))
    assert np.isnan(aligned_mpjpe(a, b))
    assert np.isnan([mpjpe(a, np.full_like(b, np.nan)), aligned_mpjpe(a, np.full_like(b, np.nan))]).all()


@given(SEEDS)
def test_about_the_pelvis_places_do_not_matter(seed):
    a, b = bodies(seed), bodies(seed + 1)
    shift = np.random.default_rng(seed).normal(0, 5, 3)
    assert pelvis_mpjpe(a + shift, b) == pytest.approx(pelvis_mpjpe(a, b))
    b[MARKERS.index("pelvis")] = a[MARKERS.index("pelvis")]
    assert pelvis_mpjpe(a, b) == pytest.approx(mpjpe(a, b))


@given(SEEDS, st.floats(0.2, 5))
@settings(max_examples=50)
def test_aligned_is_zero_for_the_same_shape_anywhere(seed, size):
    body = bodies(seed)
    assert aligned_mpjpe(moved(body, seed, size), body) == pytest.approx(0, abs=1e-9)
    assert aligned_mpjpe(moved(body, seed), body, scale=False) == pytest.approx(0, abs=1e-9)


@given(SEEDS)
@settings(max_examples=50)
def test_aligned_does_not_mirror(seed):
    body = bodies(seed)
    assert aligned_mpjpe(body * [1, -1, 1], body) > 0.01


def test_aligned_is_the_least_squares_optimum_of_scipy():
    a, b = bodies(3), bodies(3) + bodies(4) * 0.2
    standard_b, nearest, _ = procrustes(b, a)  # both scaled so that b has norm 1; rotations and reflections
    size = np.linalg.norm(b - b.mean(0))
    assert aligned_mpjpe(a, b) == pytest.approx(size * np.linalg.norm(nearest - standard_b, axis=-1).mean())


@given(SEEDS)
@settings(max_examples=50)
def test_no_rigid_motion_does_better_in_squares(seed):
    a, b = bodies(seed), bodies(seed + 1)
    turn, _ = Rotation.align_vectors(b - b.mean(0), a - a.mean(0))
    expected = np.linalg.norm(turn.apply(a - a.mean(0)) - (b - b.mean(0)), axis=-1).mean()
    assert aligned_mpjpe(a, b, scale=False) == pytest.approx(expected)


def test_batches_are_the_single_ones():
    a, b = bodies(5, 3, 4), bodies(6, 3, 4)
    for metric in (mpjpe, pelvis_mpjpe, aligned_mpjpe):
        np.testing.assert_allclose(metric(a, b), [[metric(a[i, j], b[i, j]) for j in range(4)] for i in range(3)])


def test_an_estimate_in_one_point_has_no_scale():
    body = bodies(0)
    centred = np.linalg.norm(body - body.mean(0), axis=-1).mean()
    assert aligned_mpjpe(np.zeros((15, 3)), body) == pytest.approx(centred)


@pytest.mark.parametrize("metric", [mpjpe, pelvis_mpjpe, aligned_mpjpe])
def test_wrong_shapes_are_refused(metric):
    with pytest.raises(MotionError, match="estimate must hold the 15 joints"):
        metric(np.zeros((14, 3)), np.zeros((15, 3)))
    with pytest.raises(MotionError, match="must broadcast"):
        metric(np.zeros((2, 15, 3)), np.zeros((3, 15, 3)))
