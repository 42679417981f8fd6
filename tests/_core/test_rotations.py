"""Rotations against turns about the axes, written out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv._core import rotations

ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]
three = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)


def about(axis: str, angle: float) -> np.ndarray:
    """The turn about an axis that leaves the axis and turns the next one towards the one after it."""
    i = "XYZ".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    turn = np.eye(3)
    turn[j, j] = turn[k, k] = np.cos(angle)
    turn[k, j], turn[j, k] = np.sin(angle), -np.sin(angle)
    return turn


@pytest.mark.parametrize("order", ["X", "ZY", "YXZ"])
def test_batches_of_one_to_three_angles(order):
    angles = np.random.default_rng(0).normal(size=(2, 5, len(order)))
    matrices = rotations.from_euler(order, angles)
    assert matrices.shape == (2, 5, 3, 3)
    assert np.allclose(matrices[1, 2], np.linalg.multi_dot([np.eye(3), np.eye(3), *map(about, order, angles[1, 2])]))


@pytest.mark.parametrize("order", ORDERS)
@given(angles=three)
def test_euler_angles_are_products_of_turns_about_the_axes(order, angles):
    matrix = rotations.from_euler(order, angles)
    a, b, c = (about(axis, angle) for axis, angle in zip(order, angles, strict=True))
    assert np.allclose(matrix, a @ b @ c, atol=1e-12)
    # Near ±π/2 the sine tells the middle angle to the root of the rounding error only, 1.5e-8.
    assert np.allclose(rotations.from_euler(order, rotations.to_euler(order, matrix)), matrix, atol=1e-7)


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
