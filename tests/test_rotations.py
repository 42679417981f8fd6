"""Rotations against scipy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv import rotations

ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]
three = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)


@pytest.mark.parametrize("order", ORDERS)
@given(angles=three)
def test_euler_angles_are_scipys(order, angles):
    matrix = rotations.from_euler(order, angles)
    assert np.allclose(matrix, Rotation.from_euler(order, angles).as_matrix(), atol=1e-12)
    assert np.allclose(rotations.from_euler(order, rotations.to_euler(order, matrix)), matrix, atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [-np.pi / 2, np.pi / 2])
def test_gimbal_lock_still_makes_the_rotation(order, middle):
    matrix = rotations.from_euler(order, np.array([0.7, middle, -0.4]))
    assert np.allclose(rotations.from_euler(order, rotations.to_euler(order, matrix)), matrix, atol=1e-7)


@given(st.integers(0, 10_000))
def test_unwrapping_changes_no_rotation_and_leaves_no_jump(seed):
    rng = np.random.default_rng(seed)
    steps = rng.normal(0, 0.08, (150, 3)).cumsum(0)
    steps[:, 1] = 1.2 * np.sin(steps[:, 1])
    steps[:, 0] += np.linspace(0, 9, 150)
    wrapped = rotations.to_euler("YXZ", rotations.from_euler("YXZ", steps))
    out = rotations.unwrap_euler(wrapped)
    assert np.allclose(rotations.from_euler("YXZ", out), rotations.from_euler("YXZ", steps), atol=1e-9)
    assert np.abs(np.diff(out, axis=0)).max() < 1.0


def test_unwrapping_steps_over_gaps():
    angles = np.linspace(0, 6, 60)[:, None] * [1.0, 0.0, 0.0]
    wrapped = rotations.to_euler("YXZ", rotations.from_euler("YXZ", angles))
    wrapped[20:30] = np.nan
    out = rotations.unwrap_euler(wrapped)
    assert np.isnan(out[20:30]).all()
    assert np.ptp((out - angles)[np.isfinite(out[:, 0])], axis=0).max() < 1e-9


def test_nearest_rotation_is_the_orthogonal_procrustes_answer():
    rng = np.random.default_rng(0)
    turn = Rotation.random(20, rng=rng).as_matrix()
    noisy = turn + rng.normal(0, 0.05, turn.shape)
    assert np.abs(rotations.nearest(noisy) - turn).max() < 0.15
    assert np.allclose(np.linalg.det(rotations.nearest(-np.eye(3)[None])), 1)
    assert np.isnan(rotations.nearest(np.full((1, 3, 3), np.nan))).all()
