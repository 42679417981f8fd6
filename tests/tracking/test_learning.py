"""Filters that teach their likelihoods while they follow: the background beside the body."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.envs.agents import TrackingAgent, evaluate, truth_start
from motionenv.envs.walker import WalkerTracking
from motionenv.likelihoods import Likelihood, SilhouetteLikelihood
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, ParticleFilter, Start

BODY, CAMERA = from_height(), view(0.0, width=64, height=64, distance=6.5)


class Pupil(Likelihood):
    """A likelihood that likes bodies near a place, and remembers what it was taught."""

    def __init__(self, nobody=-4.0):
        self.nobody, self.taught, self.at = nobody, [], 0.0

    def observe(self, *, at):
        self.at = at

    def log_likelihood(self, poses):
        ahead = poses[:, 0]
        return np.where(np.abs(ahead) > 1e3, self.nobody, -0.5 * ((ahead - self.at) / 0.1) ** 2)

    def learn(self, poses, log_weights):
        self.taught.append((self.at, float(np.exp(log_weights).sum()), len(poses)))


def test_filters_teach_weighed_particles_unless_the_person_is_lost():
    pupil = Pupil()
    still = FPCAPrior()
    tracker = ParticleFilter(still, pupil, 200, seed=0)
    tracker.start(Start.at(np.r_[0.0, 0.0, 0.93, np.zeros(22)]))
    assert not tracker.step(at=0.0).lost
    assert tracker.step(at=50.0).lost
    assert [at for at, _, _ in pupil.taught] == [0.0]
    assert pupil.taught[0][1:] == (pytest.approx(1.0), 200)


def test_a_new_start_teaches_nothing_in_that_frame():
    pupil, pose = Pupil(), np.r_[0.0, 0.0, 0.93, np.zeros(22)]
    there = np.r_[50.0, pose[1:]]
    tracker = ParticleFilter(FPCAPrior(), pupil, 100, seed=0)
    tracker.start(Start.at(pose))
    assert tracker.step(at=50.0).lost
    tracker.start(Start.at(there), [])
    assert tracker.step(at=50.0).recovered
    assert not pupil.taught
    tracker.step(at=50.0)
    assert len(pupil.taught) == 1


def test_somebody_who_comes_nearer_does_not_become_background():
    """Before clutter, seen from the front: he covers the same pixels all the time."""
    env = WalkerTracking(
        size=64, observation="rgb", camera="front", background="clutter", noise=8.0, horizon=40, height=(1.74, 1.76)
    )

    class Untaught(SilhouetteLikelihood):
        """The same likelihood, that doesn't listen."""

        def learn(self, poses, log_weights=None):
            pass

    def error(made):
        agent = TrackingAgent(env, n=300, start=truth_start, seed=0, likelihood=lambda *seen: made(*seen, threads=1))
        return evaluate(env, agent, 12, seed=0).errors.mean()

    assert error(SilhouetteLikelihood) < 0.95 * error(Untaught)
