"""A walker's prior with help of constant velocity: shares, densities against draws, and what does not mix."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.models.registry import load
from motionenv.tracking import FPCAPrior, MixturePrior, Start, VelocityPrior


@pytest.fixture(scope="module")
def learned():
    return FPCAPrior("walk/fpca")


@pytest.fixture(scope="module")
def walk(learned):
    return load("walk/fpca").synthesize(seconds=2, fps=30, seed=4, height=learned.skeleton.height).poses


@pytest.fixture(scope="module")
def mixed(learned, walk):
    """A mixture, and four bodies of it."""
    prior = MixturePrior(learned, VelocityPrior(skeleton=learned.skeleton), share=0.3)
    return prior, prior.initial(Start.at(walk[20], walk[19]), 4, np.random.default_rng(5))


def test_a_mixture_moves_its_share_by_the_general_prior(learned, walk):
    general = VelocityPrior(skeleton=learned.skeleton, change=np.full(25, 30.0))
    mixture = MixturePrior(learned, general, share=0.2)
    start = Start.at(walk[30], walk[29])
    state = mixture.initial(start, 3000, np.random.default_rng(9))
    np.testing.assert_allclose(np.median(state.general.velocities[:, 0]), 30 * (walk[30] - walk[29])[0], atol=3.0)
    after = mixture.propagate(state, np.random.default_rng(10))
    alone = learned.propagate(state.learned, np.random.default_rng(10))
    helped = np.abs(after.poses - alone.poses).max(1) > 0.1
    assert helped.mean() == pytest.approx(0.2, abs=0.03)
    np.testing.assert_allclose(after.poses[~helped], alone.poses[~helped], atol=1e-9)
    np.testing.assert_allclose(after.general.velocities, 30 * (after.poses - state.poses), atol=1e-9)
    np.testing.assert_array_equal(after.general.poses, after.poses)
    stirred = mixture.diffuse(after, 0.5, np.random.default_rng(11)).take(np.arange(7))
    np.testing.assert_array_equal(stirred.general.poses, stirred.poses)
    for share, same in ((0.0, True), (1.0, False)):
        other = MixturePrior(learned, general, share).propagate(state, np.random.default_rng(10))
        assert np.allclose(other.poses, alone.poses) == same


def test_both_states_stay_one_body_through_everything(mixed):
    prior, states = mixed
    rng = np.random.default_rng(1)
    after = prior.propagate(states, rng)
    told = prior.moved(after, after.poses + 0.05)
    np.testing.assert_allclose(told.poses, after.poses + 0.05, atol=1e-9)
    for each in (states, after, told, prior.diffuse(after, 0.5, rng), after.take(np.array([2, 2, 0]))):
        np.testing.assert_array_equal(each.learned.poses, each.general.poses)
    np.testing.assert_array_equal(after.take(np.array([2, 0])).poses, after.poses[[2, 0]])


def test_an_unknown_velocity_stays_unknown_and_a_known_one_is_that_of_the_nearest_candidate(learned, walk):
    prior = MixturePrior(learned, VelocityPrior(skeleton=learned.skeleton))
    start = Start(walk[[10, 40]], np.zeros(2), walk[[9, 38]], np.full(25, 1e-4))
    state = prior.initial(start, 400, np.random.default_rng(2))
    near = np.abs(state.poses[:, 0] - walk[40, 0]) < np.abs(state.poses[:, 0] - walk[10, 0])
    assert 0.3 < near.mean() < 0.7
    for which, t, before in ((near, 40, 38), (~near, 10, 9)):  # the second as if twice as fast
        velocity = np.median(state.general.velocities[which], axis=0)
        np.testing.assert_allclose(velocity[:3], 30 * (walk[t] - walk[before])[:3], atol=0.3)


def test_priors_that_do_not_go_together_are_refused(learned):
    body = learned.skeleton
    with pytest.raises(MotionError, match=r"share must be a number from 0 to 1, got 1\.5"):
        MixturePrior(learned, VelocityPrior(skeleton=body), share=1.5)
    with pytest.raises(MotionError, match="both priors must have the same fps, got 30 and 60"):
        MixturePrior(learned, VelocityPrior(skeleton=body, fps=60))
    with pytest.raises(MotionError, match="both priors must have the same skeleton"):
        MixturePrior(learned, VelocityPrior(skeleton=from_height(1.2)))
