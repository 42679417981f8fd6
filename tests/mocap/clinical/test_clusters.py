"""Poses of clusters: exact ones are recovered, through gaps and mistaken markers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.mocap.clinical.clusters import carried, cluster_pose

SHAPE = np.array([[0.06, 0.01, 0.0], [-0.05, 0.03, 0.02], [0.0, -0.06, 0.01], [-0.01, 0.02, -0.07]])


@pytest.fixture
def cluster():
    """True rotations (60, 3, 3) and markers (60, 4, 3)."""
    rng = np.random.default_rng(3)
    turns = Rotation.from_rotvec(rng.normal(0, 0.5, (60, 3))).as_matrix()
    return turns, SHAPE @ turns.swapaxes(-1, -2) + rng.normal(0, 1.0, (60, 1, 3))


def assert_rigid(pose, turns, markers, frames):
    """The pose turns as the truth does, but for a constant, and carries the middle of the markers."""
    fixed = np.einsum("tji,tjk->tik", turns, pose.rotation)[frames]
    np.testing.assert_allclose(fixed, np.broadcast_to(fixed[0], fixed.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(pose.rotation[frames]), 1.0)
    np.testing.assert_allclose(pose.origin[frames], markers.mean(1)[frames], atol=1e-6)


def test_rigid_markers_give_their_rotation_and_middle(cluster):
    turns, markers = cluster
    assert_rigid(cluster_pose(markers), turns, markers, slice(None))


def test_three_of_four_markers_suffice_and_two_do_not(cluster):
    turns, markers = cluster
    seen = markers.copy()
    seen[10:20, 1] = np.nan
    seen[40:50, :2] = np.nan
    pose = cluster_pose(seen)
    assert np.isnan(pose.origin[40:50]).all()
    assert_rigid(pose, turns, markers, np.r_[0:40, 50:60])


def test_a_frame_with_two_markers_mistaken_for_each_other_is_left_out(cluster):
    turns, markers = cluster
    mistaken = markers.copy()
    mistaken[30, [0, 1]] = markers[30, [1, 0]]
    pose = cluster_pose(mistaken)
    assert np.isnan(pose.rotation[30]).all()
    assert_rigid(pose, turns, markers, np.r_[0:30, 31:60])


def test_markers_on_a_line_or_never_together_have_no_pose(cluster):
    turns, markers = cluster
    line = np.array([[-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0]]) @ turns.swapaxes(-1, -2)
    assert cluster_pose(line) is None
    assert cluster_pose(np.where(np.arange(4)[:, None] < 2, markers, np.nan)) is None


def test_clusters_carry_the_joints_of_a_standing_trial(cluster):
    turns, markers = cluster
    standing = {f"left_thigh_cluster_{i}": point for i, point in enumerate(SHAPE, 1)}
    standing |= {"left_knee_lateral": np.array([0.02, 0.05, -0.2]), "right_knee_lateral": np.zeros(3)}
    walk = {f"left_thigh_cluster_{i}": markers[:, i - 1] for i in range(1, 5)}
    found = carried(walk, standing)
    assert list(found) == ["left_knee_lateral"]
    expected = turns @ (standing["left_knee_lateral"] - SHAPE.mean(0)) + markers.mean(1)
    np.testing.assert_allclose(found["left_knee_lateral"], expected, atol=1e-9)
    assert carried(walk | found, standing) == {}
