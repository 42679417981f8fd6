"""Poses of clusters that are known to be rigid, with markers missing and mistaken."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.mocap.clinical.clusters import cluster_pose

SHAPE = np.array([[0.0, 0, 0], [0.08, 0.01, 0], [0.02, 0.09, 0.02], [0.07, 0.06, -0.03]])


@pytest.fixture
def moved():
    """A cluster (60, 4, 3) in known poses."""
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(rng.normal(0, 1, (60, 3)))
    origins = rng.normal(0, 1, (60, 3))
    return turns, np.einsum("tij,mj->tmi", turns.as_matrix(), SHAPE) + origins[:, None]


def relative(rotations) -> np.ndarray:
    """Rotation of each frame against the first, in the world."""
    return rotations @ rotations[0].T


def test_the_pose_turns_as_the_cluster_does_also_with_a_marker_missing(moved):
    turns, markers = moved
    whole = cluster_pose(markers)
    np.testing.assert_allclose(relative(whole.rotation), relative(turns.as_matrix()), atol=1e-9)
    holed = markers.copy()
    holed[20:40, 3] = np.nan
    some = cluster_pose(holed)
    np.testing.assert_allclose(relative(some.rotation), relative(turns.as_matrix()), atol=1e-9)


def test_frames_with_two_markers_or_a_mistaken_one_have_no_pose(moved):
    _, markers = moved
    markers = markers.copy()
    markers[5, :2] = np.nan
    markers[9, [0, 3]] = markers[9, [3, 0]]
    pose = cluster_pose(markers)
    assert set(np.flatnonzero(np.isnan(pose.origin[:, 0]))) == {5, 9}


def test_two_markers_or_a_line_are_no_cluster(moved):
    _, markers = moved
    assert cluster_pose(markers[:, :2]) is None
    line = markers[:, :1] + np.linspace(0, 0.2, 4)[:, None] * (markers[:, 1:2] - markers[:, :1])
    assert cluster_pose(line) is None
    assert cluster_pose(np.full((4, 3, 3), np.nan)) is None
