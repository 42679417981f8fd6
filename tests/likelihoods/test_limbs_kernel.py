"""Limbs' ends of many bodies at a time: against the kinematics that go body by body."""

import numpy as np
import pytest

from motionenv.body import from_height, limb_segments
from motionenv.likelihoods.silhouette import fast_limb_segments


@pytest.mark.parametrize("n", [1, 31, 32, 33, 500])
@pytest.mark.parametrize("height", [1.2, 1.9])
def test_limbs_are_where_kinematics_put_them(n, height):
    """Angles of several turns, feet above and below the ground, turned up and down: every branch of the foot."""
    poses = np.random.default_rng(n).normal(size=(n, 25))
    poses[:, 5] *= 5
    poses[:, 2] += 0.9
    body = from_height(height)
    np.testing.assert_allclose(fast_limb_segments(poses, body), limb_segments(poses, body), atol=1e-13)


def test_limbs_at_rest_and_with_shins_level():
    """All angles zero, and shins whose lateral axis points up, where a foot can't be levelled."""
    body, poses = from_height(), np.zeros((3, 25))
    poses[:, 2] = 0.93
    poses[1, 4] = np.pi / 2
    poses[2, [17, 21]] = -np.pi / 2
    np.testing.assert_allclose(fast_limb_segments(poses, body), limb_segments(poses, body), atol=1e-13)
