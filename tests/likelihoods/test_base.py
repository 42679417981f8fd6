"""What likelihoods are asked for: a picture without anybody, and the observations that they take."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.likelihoods import Likelihood, SilhouetteLikelihood
from motionenv.likelihoods.base import apparent, log_nobody
from motionenv.render import Raycaster
from motionenv.render.cameras import view

CAMERA = view(0.3, width=48, height=48, distance=4.0)
STANDING = np.eye(25)[2] * 0.93


class Sound(Likelihood):
    """A likelihood that hears something, at any place or nowhere."""

    def __init__(self, level):
        self.level = level

    def observe(self, *, sound, loud=None):
        self.heard = sound

    def log_likelihood(self, poses):
        return np.full(len(poses), self.level)


class Anything(Sound):
    def observe(self, **observation):
        self.heard = observation


def test_nobody_explains_an_empty_picture_best_and_one_of_somebody_worst():
    model = SilhouetteLikelihood(CAMERA)
    model.observe(mask=np.zeros((48, 48)))
    assert log_nobody(model, STANDING) > model.log_likelihood(STANDING[None])[0]
    model.observe(mask=Raycaster().render(STANDING, from_height(), CAMERA, rgb=False).limbs)
    before = STANDING.copy()
    assert log_nobody(model, STANDING) < model.log_likelihood(STANDING[None])[0]
    np.testing.assert_array_equal(STANDING, before)
    elsewhere = STANDING + np.eye(25)[1] * 500
    assert log_nobody(model, STANDING) == pytest.approx(model.log_likelihood(elsewhere[None])[0])


@pytest.mark.parametrize("level", [np.nan, np.inf, -np.inf])
def test_what_says_nothing_of_nobody_rules_it_out(level):
    assert log_nobody(Sound(level), STANDING) == -np.inf
    assert log_nobody(Sound(-2.0), STANDING) == -2.0


def test_observations_are_accepted_by_name_in_the_order_in_which_they_are_given():
    assert Sound(0).accepted(["mask", "loud", "sound"]) == ["loud", "sound"]
    assert Anything(0).accepted(["mask", "sound"]) == ["mask", "sound"]
    assert SilhouetteLikelihood(CAMERA).accepted(["rgb", "camera", "sound", "depth"]) == ["camera", "depth"]


def test_what_is_not_defined_does_nothing():
    hearing = Sound(1.0)
    hearing.observe(sound=3)
    hearing.learn(STANDING[None])
    hearing.forget()
    assert hearing.log_likelihood(STANDING[None]) == 1.0
    with pytest.raises(TypeError, match="abstract"):
        Likelihood()


@pytest.mark.parametrize("size", [0.8, 1.12])
def test_a_body_of_another_size_looks_like_one_at_another_distance(size):
    pose = STANDING * size + np.r_[0.3, 0.4, np.zeros(3), 0.7, np.zeros(19)]
    mask = Raycaster().render(STANDING[None], from_height(1.6), CAMERA, rgb=False).limbs[0] > 0
    scores = []
    for height, seen in ((1.75 * size, pose[None]), (1.75, apparent(pose[None], np.array([size]), CAMERA))):
        likelihood = SilhouetteLikelihood(CAMERA, from_height(height), effective=None, threads=1)
        likelihood.observe(mask=mask)
        scores.append(likelihood.log_likelihood(seen))
    np.testing.assert_allclose(*scores, rtol=1e-9)
