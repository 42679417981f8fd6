"""Functional joints of rigid segments whose joint is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.errors import GapError
from motionenv.mocap.clinical.functional import functional_joint
from motionenv.mocap.clinical.gait_model import Segment

IN_PROXIMAL, IN_DISTAL = np.array([0.1, -0.2, -0.4]), np.array([0.02, 0.05, 0.3])


def segments(turns: Rotation, rng, noise=0.0) -> tuple[Segment, Segment, np.ndarray]:
    """A distal segment that turns by `turns` about a point of a proximal one, which moves about; and that point."""
    frames = len(turns)
    proximal = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.02, (frames, 3)), axis=0))
    origin = np.cumsum(rng.normal(0, 0.01, (frames, 3)), axis=0)
    distal = proximal * turns
    centre = origin + proximal.apply(IN_PROXIMAL)
    other = centre - distal.apply(IN_DISTAL)
    shaken = [v + rng.normal(0, noise, v.shape) if noise else v for v in (origin, other)]
    return Segment(shaken[0], proximal.as_matrix()), Segment(shaken[1], distal.as_matrix()), centre


def test_a_ball_joint_is_found_exactly_and_within_noise():
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(rng.normal(0, 0.4, (200, 3)))
    proximal, distal, centre = segments(turns, rng)
    np.testing.assert_allclose(functional_joint(proximal, distal).centre, centre, atol=1e-9)
    proximal, distal, centre = segments(turns, rng, noise=0.001)
    found = functional_joint(proximal, distal).centre
    assert np.linalg.norm((found - centre).mean(0)) < 0.001


def test_a_hinge_has_its_axis_and_lies_on_it():
    rng = np.random.default_rng(1)
    direction = np.array([0.1, 0.98, -0.15]) / np.linalg.norm([0.1, 0.98, -0.15])
    proximal, distal, centre = segments(Rotation.from_rotvec(rng.uniform(0, 1.2, (150, 1)) * direction), rng)
    joint = functional_joint(proximal, distal)
    assert joint.swings[2] == pytest.approx(0, abs=1e-6)
    axis = np.einsum("tij,j->ti", proximal.rotation, direction)
    assert np.abs(np.einsum("ti,ti->t", axis, joint.axis)).min() > 1 - 1e-9
    off = joint.centre - centre
    np.testing.assert_allclose(off - axis * np.einsum("ti,ti->t", off, axis)[:, None], 0, atol=1e-8)


def test_swings_are_the_rms_rotations():
    rng = np.random.default_rng(2)
    angles = rng.normal(0, 0.05, 5000)
    proximal, distal, _ = segments(Rotation.from_rotvec(angles[:, None] * [0, 1.0, 0]), rng)
    assert functional_joint(proximal, distal).swings[:2] == pytest.approx([angles.std()] * 2, rel=0.05)


def test_frames_that_show_one_segment_still_have_a_centre():
    rng = np.random.default_rng(3)
    proximal, distal, centre = segments(Rotation.from_rotvec(rng.normal(0, 0.4, (60, 3))), rng)
    origin = proximal.origin.copy()
    origin[10:20] = np.nan
    rotation = proximal.rotation.copy()
    rotation[10:20] = np.nan
    found = functional_joint(Segment(origin, rotation), distal).centre
    np.testing.assert_allclose(found, centre, atol=1e-9)


def test_too_few_frames_are_refused():
    rng = np.random.default_rng(4)
    proximal, distal, _ = segments(Rotation.from_rotvec(rng.normal(0, 0.4, (9, 3))), rng)
    with pytest.raises(GapError, match="needs 10 frames"):
        functional_joint(proximal, distal)
