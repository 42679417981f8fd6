"""Proposed postures: turned, mirrored and shifted as their rays are, for sequences of any length."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.lifting.free.proposal import BODY_UNIT, propose, shipped_network
from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE
from motionenv.models.synthesis import synthesize

MOTION = synthesize("walk/eigenwalkers", 4, 30, seed=3)
PLACES = markers(MOTION.poses, MOTION.skeleton) - [0, 4.5, 1.2]
RAYS = PLACES / np.linalg.norm(PLACES, axis=-1, keepdims=True)
NETWORK = shipped_network()


def test_postures_turn_with_the_rays():
    c, s = np.cos(2.5), np.sin(2.5)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    one, other = propose(NETWORK, RAYS, 30), propose(NETWORK, RAYS @ turn, 30)
    np.testing.assert_allclose(other.posture, one.posture @ turn, atol=2e-4)
    np.testing.assert_allclose(other.spread, one.spread, atol=2e-4)


def test_mirror_images_give_mirror_images():
    one, other = propose(NETWORK, RAYS, 30), propose(NETWORK, RAYS[:, OTHER_SIDE] * [1, -1, 1], 30)
    np.testing.assert_allclose(other.posture[:, OTHER_SIDE] * [1, -1, 1], one.posture, atol=2e-4)


def test_they_are_near_the_truth():
    truth = PLACES - PLACES[:, [2]]
    off = np.linalg.norm(propose(NETWORK, RAYS, 30).posture * BODY_UNIT - truth, axis=-1)
    assert off.mean() < 0.06


@pytest.mark.parametrize(("frames", "fps"), [(8, 15.0), (15, 60.0), (120, 30.0), (700, 30.0), (50, 9.0)])
def test_any_length_and_rate_will_do(frames, fps):
    rays = np.tile(RAYS, (6, 1, 1))[:frames]
    rays[1:3] = np.nan
    made = propose(NETWORK, rays, fps)
    assert made.posture.shape == (frames, 15, 3)
    assert np.isfinite(made.posture).all()
    assert (made.spread > 0).all()
