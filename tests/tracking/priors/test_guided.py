"""The prior about a known motion: a stationary normal distribution about it, whose deviations last for a while."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.synthesis import synthesize
from motionenv.tracking.priors.base import Start
from motionenv.tracking.priors.guided import GuidedPrior

DEVIATION = np.linspace(0.01, 0.1, 25)


@pytest.fixture(scope="module")
def walk():
    return synthesize("walk/fpca", 1.0, 20, seed=4, height=1.75)


def test_deviations_keep_their_size_and_forget_at_the_stated_rate(walk):
    rng, n = np.random.default_rng(0), 40_000
    guide = np.concatenate([np.full((3, 25), np.nan), walk.poses])
    prior = GuidedPrior(guide, DEVIATION, skeleton=walk.skeleton, fps=20.0, first=3, memory=0.3)
    state = prior.initial(Start.at(walk.poses[0], spread=DEVIATION), n, rng)
    first = state.poses - walk.poses[0]
    for t in range(1, 7):
        state = prior.propagate(state, rng)
        off = state.poses - walk.poses[t]
        np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=5 * DEVIATION.max() / np.sqrt(n))
        np.testing.assert_allclose(off.std(axis=0), DEVIATION, rtol=0.02)
    correlation = (first * off).mean(axis=0) / DEVIATION**2
    np.testing.assert_allclose(correlation, np.exp(-0.3 / 0.3), atol=5 / np.sqrt(n))  # six frames are 0.3 s


def test_particles_are_taken_moved_and_perturbed_in_their_frame(walk):
    rng = np.random.default_rng(2)
    prior = GuidedPrior(walk.poses, DEVIATION, skeleton=walk.skeleton, fps=20.0, first=5)
    state = prior.initial(Start.at(walk.poses[5]), 2000, rng)
    np.testing.assert_array_equal(state.take(np.array([3, 3])).poses, state.poses[[3, 3]])
    other = state.poses + 0.1
    np.testing.assert_allclose(prior.moved(state, other).poses, other)
    shaken = prior.diffuse(state, 0.5, rng)
    noise = 0.5 * DEVIATION * np.sqrt(1 - np.exp(-2 / (0.3 * 20)))
    np.testing.assert_allclose((shaken.poses - state.poses).std(axis=0), noise, rtol=0.1)
    assert (shaken.frame, prior.propagate(shaken, rng).frame) == (5, 6)


def test_what_is_refused(walk):
    body = {"skeleton": walk.skeleton, "fps": 20.0}
    for guide, deviation in ((walk.poses[:, :24], DEVIATION), (walk.poses, DEVIATION[:3]), (walk.poses, -DEVIATION)):
        with pytest.raises(MotionError):
            GuidedPrior(guide, deviation, **body)
    with pytest.raises(MotionError, match="memory"):
        GuidedPrior(walk.poses, DEVIATION, **body, memory=0)
    last = GuidedPrior(walk.poses, DEVIATION, **body, first=19)
    with pytest.raises(MotionError, match="ends with frame 19"):
        last.propagate(last.initial(Start.at(walk.poses[19]), 5, np.random.default_rng(0)), np.random.default_rng(0))
