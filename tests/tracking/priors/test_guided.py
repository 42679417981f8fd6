"""The prior about a known motion: a stationary normal distribution there, and another prior in its gaps."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.synthesis import synthesize
from motionenv.tracking import FPCAPrior, VelocityPrior
from motionenv.tracking.priors.base import Start
from motionenv.tracking.priors.guided import GuidedPrior

DEVIATION = np.linspace(0.01, 0.1, 25)


@pytest.fixture(scope="module")
def walk():
    return synthesize("walk/fpca", 1.0, 20, seed=4, height=1.75)


def test_deviations_keep_their_size_and_forget_at_the_stated_rate(walk):
    rng, n = np.random.default_rng(0), 40_000
    prior = GuidedPrior(VelocityPrior(skeleton=walk.skeleton, fps=20.0), walk.poses, DEVIATION, memory=0.3)
    state = prior.initial(Start.at(walk.poses[0], spread=DEVIATION), n, rng)
    first = state.poses - walk.poses[0]
    for t in range(1, 7):
        state = prior.propagate(state, rng)
        off = state.poses - walk.poses[t]
        np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=5 * DEVIATION.max() / np.sqrt(n))
        np.testing.assert_allclose(off.std(axis=0), DEVIATION, rtol=0.02)
    correlation = (first * off).mean(axis=0) / DEVIATION**2
    np.testing.assert_allclose(correlation, np.exp(-0.3 / 0.3), atol=5 / np.sqrt(n))  # six frames are 0.3 s


@pytest.mark.parametrize("step", [1, -1])
def test_a_gap_is_walked_on_by_the_other_prior_and_its_end_finds_the_motion_again(walk, step):
    rng = np.random.default_rng(1)
    guide = walk.poses.copy()
    guide[8:12] = np.nan
    other = FPCAPrior(skeleton=walk.skeleton, fps=20.0, backwards=step < 0)
    prior = GuidedPrior(other, guide, np.full(25, 0.001), first=0 if step > 0 else 19, step=step)
    order = range(20)[::step]
    state = prior.initial(Start.at(guide[order[0]], spread=0.001), 300, rng)
    for t in order[1:]:
        state = prior.propagate(state, rng)
        assert state.frame == t
        bound = 0.01 if np.isfinite(guide[t, 0]) else 0.35  # people go on as fast as they were
        assert np.abs(state.poses.mean(axis=0) - walk.poses[t])[:2].max() < bound
    assert state.other is None


def test_particles_are_taken_moved_and_perturbed_in_both_states(walk):
    rng = np.random.default_rng(2)
    for guide in (walk.poses, np.full((20, 25), np.nan)):
        prior = GuidedPrior(VelocityPrior(skeleton=walk.skeleton, fps=20.0), guide, DEVIATION)
        state = prior.initial(Start.at(walk.poses[0]), 50, rng)
        np.testing.assert_array_equal(state.take(np.array([3, 3])).poses, state.poses[[3, 3]])
        other = state.poses + 0.1
        np.testing.assert_allclose(prior.moved(state, other).poses, other)
        shaken = prior.diffuse(state, 0.5, rng).poses - state.poses
        assert (shaken.std(axis=0) > 0).all()
        assert np.isfinite(prior.propagate(prior.moved(state, other), rng).poses).all()


def test_what_is_refused(walk):
    other = VelocityPrior(skeleton=walk.skeleton, fps=20.0)
    for guide, deviation in ((walk.poses[:, :24], DEVIATION), (walk.poses, DEVIATION[:3]), (walk.poses, -DEVIATION)):
        with pytest.raises(MotionError):
            GuidedPrior(other, guide, deviation)
    with pytest.raises(MotionError, match="memory"):
        GuidedPrior(other, walk.poses, DEVIATION, memory=0)
