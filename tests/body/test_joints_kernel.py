"""Joints of many people at once are those of each alone."""

import numpy as np

from motionenv.body import from_height, markers
from motionenv.body.joints_kernel import joints_of


def test_joints_are_the_markers_of_each_person_and_others_are_left_alone():
    rng = np.random.default_rng(0)
    bodies = [from_height(height) for height in (1.5, 1.8, 2.0)]
    poses = rng.normal(0, 0.4, (3, 4, 25))
    out = np.full((3, 4, 15, 3), np.nan)
    joints_of(1, 3, poses, np.stack([body.offsets for body in bodies]), out)
    assert np.isnan(out[0]).all()
    for i in (1, 2):
        np.testing.assert_allclose(out[i], markers(poses[i], bodies[i]), atol=1e-12)
