"""SCoRE and SARA: joints that are known exactly are found exactly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.errors import GapError
from motionenv.mocap.clinical.functional import functional_joint
from motionenv.mocap.clinical.gait_model import Segment

AXIS = np.array([0.2, 0.95, -0.1]) / np.linalg.norm([0.2, 0.95, -0.1])
IN_PROXIMAL, IN_DISTAL = np.array([0.03, 0.1, -0.3]), np.array([-0.02, 0.05, 0.25])


def joined(relative: Rotation, noise: float = 0.0):
    """Two segments that turn against each other by `relative`, and the joint's centre (frames, 3)."""
    rng = np.random.default_rng(1)
    frames = len(relative)
    r = Rotation.from_rotvec(rng.normal(0, 0.3, (frames, 3)))
    t = rng.normal(0, 1.0, (frames, 3))
    centre = r.apply(IN_PROXIMAL) + t
    s = r * relative
    d = centre - s.apply(IN_DISTAL)
    shake = rng.normal(0, noise, (2, frames, 3))
    return Segment(t + shake[0], r.as_matrix()), Segment(d + shake[1], s.as_matrix()), centre


def ball(frames: int = 300) -> Rotation:
    return Rotation.from_rotvec(np.random.default_rng(2).normal(0, 0.3, (frames, 3)))


def hinge(frames: int = 300) -> Rotation:
    return Rotation.from_rotvec(np.linspace(0, 1.0, frames)[:, None] * AXIS)


def test_the_centre_of_a_ball_joint_is_exact():
    proximal, distal, centre = joined(ball())
    np.testing.assert_allclose(functional_joint(proximal, distal).centre, centre, atol=1e-9)


def test_noise_of_a_millimetre_leaves_it_within_a_millimetre():
    """The centre in the segments averages over 300 frames; in the world the frame's own noise stays."""
    proximal, distal, centre = joined(ball(), noise=0.001)
    away = functional_joint(proximal, distal).centre - centre
    assert np.sqrt((away**2).mean()) < 0.001
    assert np.linalg.norm(away.mean(0)) < 0.0005


@pytest.mark.parametrize("told", [True, False])
def test_a_hinge_has_its_axis_exactly_and_its_centre_on_it(told):
    proximal, distal, centre = joined(hinge())
    joint = functional_joint(proximal, distal, hinge=told)
    axis = proximal.rotation @ AXIS
    np.testing.assert_allclose(np.abs((joint.axis * axis).sum(-1)), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(joint.centre - centre, axis), 0.0, atol=1e-9)
    assert joint.swings[2] < 1e-6
    np.testing.assert_allclose(joint.swings[:2], np.std(np.linspace(0, 1.0, 300)), rtol=0.02)


def test_what_one_segment_shows_places_the_centre_where_the_other_is_hidden():
    proximal, distal, centre = joined(ball())
    origin = distal.origin.copy()
    origin[5:9] = np.nan
    joint = functional_joint(proximal, Segment(origin, distal.rotation))
    np.testing.assert_allclose(joint.centre, centre, atol=1e-9)


def test_too_few_frames_are_refused():
    proximal, distal, _ = joined(ball(9))
    with pytest.raises(GapError, match="needs 10 frames that show both segments; there are 9"):
        functional_joint(proximal, distal)
