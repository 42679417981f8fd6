"""Products of likelihoods: sums of logs, robust part, misuse."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods import AppearanceLikelihood, Likelihood, ProductLikelihood, SilhouetteLikelihood
from motionenv.render import Raycaster
from motionenv.render.cameras import view


def walking(n, seed=0):
    poses = 0.3 * np.random.default_rng(seed).normal(size=(n, 25))
    poses[:, 2] = 0.93
    return poses


class Constant(Likelihood):
    """A likelihood that says what it is told."""

    def observe(self, *, said):
        self.said = np.asarray(said, dtype=np.float64)

    def log_likelihood(self, poses):
        return self.said


class Place(Likelihood):
    """A likelihood that is a function of how far ahead a body is; far away it is -3."""

    def observe(self, *, at):
        self.at = at

    def log_likelihood(self, poses):
        ahead = np.asarray(poses)[:, 0]
        return np.where(np.abs(ahead) < 1e3, -0.5 * (ahead - self.at) ** 2, -3.0)


def test_logs_are_weighted_and_summed():
    product = ProductLikelihood([Constant(), Place()], [0.5, 2.0])
    product.observe(said=[-1.0, -2.0], at=0.0)
    poses = walking(2)
    poses[:, 0] = 1.0, 3.0
    np.testing.assert_allclose(product.log_likelihood(poses), [-0.5 - 1.0, -1.0 - 9.0])


def test_the_outlier_part_bounds_what_a_frame_can_rule_out():
    product = ProductLikelihood([Place()], [2.0], outliers=0.01)
    product.observe(at=0.0)
    poses = walking(4)
    poses[:, 0] = 0.0, 1.0, 10.0, 500.0
    expected = np.log(0.99 * np.exp([0.0, -1.0, -100.0, -np.inf]) + 0.01 * np.exp(-6.0))
    np.testing.assert_allclose(product.log_likelihood(poses), expected, atol=1e-12)
    # Each pose by itself says the same: the level doesn't hang on the company.
    alone = np.concatenate([product.log_likelihood(pose[None]) for pose in poses])
    np.testing.assert_array_equal(product.log_likelihood(poses), alone)


def test_each_model_gets_the_form_of_the_picture_that_says_most_to_it():
    camera = view(0.0, width=64, height=64, distance=4.0)
    frame = Raycaster().render(walking(1)[0], from_height(), camera)
    observation = {"rgb": frame.rgb, "mask": frame.limbs, "depth": frame.depth}
    product = ProductLikelihood([SilhouetteLikelihood(camera), AppearanceLikelihood(camera)])
    product.observe(**observation)
    alone = SilhouetteLikelihood(camera)
    alone.observe(mask=frame.limbs)
    np.testing.assert_array_equal(product.log_likelihood(walking(5)), alone.log_likelihood(walking(5)))
    product.learn(walking(1))
    assert not np.array_equal(product.log_likelihood(walking(5)), alone.log_likelihood(walking(5)))
    np.testing.assert_array_equal(product.foreground, alone.foreground)
    assert product.camera is camera
    assert product.skeleton.height == alone.skeleton.height
    assert product.accepted(["mask", "rgb", "sound", "depth"]) == ["mask", "rgb"]
    nested = ProductLikelihood([product, Place()])
    assert nested.accepted(["rgb", "mask", "at", "sound"]) == ["rgb", "mask", "at"]
    nested.observe(**observation, at=0.0)
    np.testing.assert_array_equal(nested.foreground, alone.foreground)
    bodiless = ProductLikelihood([Constant()])
    assert bodiless.camera is bodiless.skeleton is None
    with pytest.raises(MotionError, match="none of the product's models has a foreground"):
        _ = bodiless.foreground


def test_misuse():
    with pytest.raises(MotionError, match="no"):
        ProductLikelihood([])
    with pytest.raises(MotionError, match="weights"):
        ProductLikelihood([Constant()], [1.0, 2.0])
    with pytest.raises(MotionError, match="weights"):
        ProductLikelihood([Constant()], [-1.0])
    with pytest.raises(MotionError, match="outliers"):
        ProductLikelihood([Constant()], outliers=1.0)
    with pytest.raises(MotionError, match="sound"):
        ProductLikelihood([Constant()]).observe(sound=1)
    product = ProductLikelihood([SilhouetteLikelihood(view(0.0)), AppearanceLikelihood(view(0.0))])
    with pytest.raises(MotionError, match="observe"):
        product.log_likelihood(walking(1))
    product.forget()
