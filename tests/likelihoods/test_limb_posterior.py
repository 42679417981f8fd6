"""Shares of limbs against pictures that are drawn."""

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.limb_posterior import LimbPosterior
from motionenv.render import Raycaster
from motionenv.render.cameras import view

BODY = from_height(1.7)
CAMERA = view(0.3, width=40, height=60, distance=4.0)


@pytest.fixture(scope="module")
def poses():
    poses = 0.3 * np.random.default_rng(0).normal(size=(3, 25))
    poses[:, 2] += 0.9
    return poses


def drawn(poses) -> np.ndarray:
    """One picture (1 + limbs, height, width) of zeros and ones for each pose."""
    labels = Raycaster().render(poses, BODY, CAMERA, rgb=False).limbs
    return (labels[:, None] == np.arange(1 + len(LIMBS))[:, None, None]).astype(float)


def test_of_one_pose_it_is_the_picture(poses):
    posterior = LimbPosterior(BODY)
    expected = drawn(poses[:1])[0]
    np.testing.assert_array_equal(posterior.shares(poses[0], None, CAMERA), expected)
    np.testing.assert_array_equal(posterior.shares(poses, [-np.inf, -np.inf, 0.0][::-1], CAMERA), expected)


@pytest.mark.parametrize("shift", [0.0, 700.0, -700.0])
def test_of_several_it_is_their_mean_by_weight(poses, shift):
    """Weights of whole 24ths, of which as many pictures are drawn."""
    weights = np.array([3, 9, 12]) / 24
    shares = LimbPosterior(BODY).shares(poses, np.log(weights) + shift, CAMERA)
    np.testing.assert_allclose(shares, np.tensordot(weights, drawn(poses), axes=1), atol=1e-12)
    np.testing.assert_allclose(shares.sum(axis=0), 1)


def test_equal_weights_are_the_default_and_nothing_is_left_to_chance(poses):
    posterior = LimbPosterior(BODY)
    shares = posterior.shares(poses, None, CAMERA)
    np.testing.assert_array_equal(shares, posterior.shares(poses, np.full(3, -5.0), CAMERA))
    np.testing.assert_allclose(shares, drawn(poses).mean(axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("n", "weights"), [(3, np.zeros(2)), (3, np.full(3, -np.inf)), (3, [0, np.nan, 0]), (0, np.zeros(0))]
)
def test_weights_that_do_not_belong_to_the_poses_are_refused(poses, n, weights):
    with pytest.raises(MotionError, match=rf"log_weights must be \({n},\), at least one above -inf, got"):
        LimbPosterior(BODY).shares(poses[:n], weights, CAMERA)
