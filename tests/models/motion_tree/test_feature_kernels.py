"""Poses seen from the frame before, and placed again: each way undoes the other."""

import numpy as np
import pytest

from motionenv.models.motion_tree.feature_kernels import (
    MIDDLE,
    local_poses_after,
    parameters_at,
    parameters_of,
    placed_poses,
    projected,
)  # fmt: skip

FPS = 30.0


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    """Two sequences, of 20 and 12 frames, that wander and turn."""
    rng = np.random.default_rng(1)
    return np.cumsum(rng.normal(0, 0.05, (32, 25)), axis=0)


STARTS = np.array([0, 20])


def test_what_is_seen_from_a_frame_is_placed_where_it_was(poses):
    frames = np.array([0, 5, 18, 25])
    local = np.empty((4, 25))
    local_poses_after(poses, frames, local)
    placed = np.empty((4, 1, 25))
    placed_poses(poses[frames], local[:, None], placed)
    np.testing.assert_allclose(placed[:, 0], poses[frames + 1], atol=1e-12)


def test_increments_are_those_of_a_complex_number_turned_back(poses):
    local = np.empty((1, 25))
    local_poses_after(poses, np.array([7]), local)
    step = (poses[8, 0] - poses[7, 0] + 1j * (poses[8, 1] - poses[7, 1])) * np.exp(-1j * poses[7, 5])
    np.testing.assert_allclose(local[0, 0] + 1j * local[0, 1], step, rtol=1e-12)


def test_turns_of_a_pose_are_those_of_the_one_before():
    before, local = np.zeros((1, 25)), np.zeros((1, 1, 25))
    before[0, 5] = before[0, 3] = 7 * np.pi
    local[0, 0, 3], local[0, 0, 5] = 0.9 * np.pi, 0.1
    placed = np.empty((1, 1, 25))
    placed_poses(before, local, placed)
    assert placed[0, 0, 3] == pytest.approx(6.9 * np.pi)
    assert placed[0, 0, 5] == pytest.approx(7 * np.pi + 0.1)


def test_parameters_are_the_pose_and_how_fast_it_changes(poses):
    whole, some = np.empty((32, 50)), np.empty((3, 50))
    parameters_of(poses, STARTS, 0, 32, FPS, whole)
    angles = np.flatnonzero(np.isfinite(MIDDLE))
    np.testing.assert_allclose(whole[:, angles], poses[:, angles], atol=1e-12)  # small ones are told as they are
    inner = np.r_[2:20, 22:32]
    np.testing.assert_allclose(
        whole[inner][:, 25 + angles], FPS * np.diff(poses, axis=0)[inner - 1][:, angles], atol=1e-9
    )
    frames = np.array([3, 20, 31])
    parameters_at(poses, STARTS, frames, FPS, some)
    np.testing.assert_array_equal(some, whole[frames])


def test_the_first_frames_of_a_sequence_know_nothing_of_the_one_before(poses):
    """The second sequence alone has the same parameters."""
    together, alone = np.empty((12, 50)), np.empty((12, 50))
    parameters_of(poses, STARTS, 20, 32, FPS, together)
    parameters_of(poses[20:].copy(), np.array([0]), 0, 12, FPS, alone)
    np.testing.assert_array_equal(together, alone)


def test_whole_turns_of_an_angle_change_nothing_but_the_middle_it_is_told_around(poses):
    turned = poses.copy()
    angles = np.flatnonzero(np.isfinite(MIDDLE))
    turned[:, angles] += 2 * np.pi * np.random.default_rng(0).integers(-3, 4, len(angles))
    plain, got = np.empty((32, 50)), np.empty((32, 50))
    parameters_of(poses, STARTS, 0, 32, FPS, plain)
    parameters_of(turned, STARTS, 0, 32, FPS, got)
    np.testing.assert_allclose(got, plain, atol=1e-9)


def test_coefficients_are_a_sum_over_lags_and_channels():
    rng = np.random.default_rng(2)
    recent, weights, offset = rng.normal(size=(4, 10, 50)), rng.normal(size=(10, 3, 5)), rng.normal(size=5)
    channels = np.array([2, 9, 30])
    out = np.empty((4, 5))
    projected(recent, channels, weights, offset, out)
    expected = np.einsum("kfc,fcb->kb", recent[:, ::-1, channels], weights) - offset
    np.testing.assert_allclose(out, expected, rtol=1e-12)
