"""Local refinement: Metropolis' rule keeps the posterior, and finds it again from few particles."""

from dataclasses import dataclass

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.estimation.tracking import ParticleFilter, Start
from motionenv.estimation.tracking.refinement import chosen, refined

WIDTH, Y = 0.4, 1.2  # y = x + WIDTH ε, with x ~ N(0, 1) a priori
VARIANCE = 1 / (1 + 1 / WIDTH**2)
MEAN = VARIANCE * Y / WIDTH**2


@dataclass(frozen=True, eq=False)
class Spot:
    poses: np.ndarray
    name: np.ndarray

    def take(self, which):
        return Spot(self.poses[which], self.name[which])


class Still:
    """x ~ N(0, 1) that stays; noise is an Ornstein-Uhlenbeck process, which keeps that as it is."""

    skeleton, fps = from_height(), 30.0

    def initial(self, start, n, rng):
        poses = np.zeros((n, 25))
        poses[:, 0] = rng.standard_normal(n)
        return Spot(poses, np.arange(n))

    def propagate(self, state, rng):
        return state

    def diffuse(self, state, share, rng):
        poses = state.poses.copy()
        poses[:, 0] = np.sqrt(1 - share**2) * poses[:, 0] + share * rng.standard_normal(len(poses))
        return Spot(poses, state.name)


class Seen:
    def observe(self, *, y):
        self.y = y

    def log_likelihood(self, poses):
        return -0.5 * ((self.y - poses[:, 0]) / WIDTH) ** 2


def scored(state):
    return -0.5 * ((Y - state.poses[:, 0]) / WIDTH) ** 2


@pytest.mark.parametrize("rounds", [1, 4, 20])
def test_keeps_the_posterior(rounds):
    rng = np.random.default_rng(0)
    state = Still().initial(None, 40_000, rng)
    state.poses[:, 0] = MEAN + np.sqrt(VARIANCE) * state.poses[:, 0]
    state, scores = refined(Still(), scored, state, scored(state), rounds, rng)
    assert state.poses[:, 0].mean() == pytest.approx(MEAN, abs=0.01)
    assert state.poses[:, 0].var() == pytest.approx(VARIANCE, rel=0.03)
    assert np.array_equal(scores, scored(state))


def test_finds_the_posterior_from_one_place():
    rng = np.random.default_rng(0)
    state = Spot(np.zeros((20_000, 25)), np.arange(20_000))
    state, _ = refined(Still(), scored, state, scored(state), 25, rng)
    assert state.poses[:, 0].mean() == pytest.approx(MEAN, abs=0.02)
    assert state.poses[:, 0].var() == pytest.approx(VARIANCE, rel=0.1)


def test_leaves_what_cannot_be_scored():
    state = Spot(np.zeros((2000, 25)), np.arange(2000))
    nothing = np.full(2000, -np.inf)
    state, scores = refined(Still(), scored, state, nothing, 1, np.random.default_rng(0))
    assert np.isfinite(scores).all()
    state, again = refined(Still(), lambda _: nothing, state, scores, 3, np.random.default_rng(0))
    assert np.array_equal(scores, again)


def test_few_particles_of_a_filter_get_closer():
    errors = {}
    for refine in (0, 6):
        errors[refine] = []
        for seed in range(60):
            tracker = ParticleFilter(Still(), Seen(), 10, refine=refine, hidden=0.0, seed=seed)
            tracker.start(Start.at(np.zeros(25)))
            belief = tracker.step(y=Y)
            errors[refine].append(belief.mean[0] - MEAN)
            assert (belief.effective == pytest.approx(10)) == bool(refine)  # all alike after refinement
    assert np.square(errors[6]).mean() < 0.6 * np.square(errors[0]).mean()


def test_chosen_takes_each_particle_whole():
    first, second = Spot(np.ones((3, 25)), np.arange(3)), Spot(np.zeros((3, 25)), -np.arange(3))
    mixed = chosen(np.array([True, False, True]), first, second)
    assert mixed.poses[:, 0].tolist() == [1, 0, 1]
    assert mixed.name.tolist() == [0, -1, 2]
