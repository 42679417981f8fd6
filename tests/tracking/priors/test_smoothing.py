"""Smoothed walkers: an exact smoother where there is one, and walks behind something."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods.base import Likelihood
from motionenv.models.registry import load
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, ParticleFilter, Start, VelocityPrior
from motionenv.tracking.priors._walk_kernel import CHANGING, EASE, TURN, TURNING
from motionenv.tracking.priors.fpca import _WANDER

BLUR = 0.03  # [m] of measured positions


class Positions(Likelihood):
    """Measures x."""

    def observe(self, *, x: float) -> None:
        self.x = x

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        return -0.5 * ((poses[:, 0] - self.x) / BLUR) ** 2


class Standing(FPCAPrior):
    """Walkers who stand, and are moved by noise alone: along x, a random walk."""

    def initial(self, start, n, rng):
        state = super().initial(start, n, rng)
        state.gait[:, [TURN, TURNING, CHANGING, EASE]] = 0.0
        self._step[[8, *range(17, 21)]] = 0.0
        return self.posed(state.gait, state.scores, state.rest)


def exact(xs: np.ndarray, first: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Means and variances of a random walk by the smoother of Rauch, Tung and Striebel."""
    means, variances, predicted = [], [], [first**2]
    mean = 0.0
    for x in xs:
        gain = predicted[-1] / (predicted[-1] + BLUR**2)
        mean += gain * (x - mean)
        means.append(mean)
        variances.append((1 - gain) * predicted[-1])
        predicted.append(variances[-1] + step**2)
    for t in range(len(xs) - 2, -1, -1):
        back = variances[t] / predicted[t + 1]
        means[t] += back * (means[t + 1] - means[t])
        variances[t] += back**2 * (variances[t + 1] - predicted[t + 1])
    return np.array(means), np.array(variances)


def test_positions_of_who_stands_are_those_of_the_exact_smoother():
    rng, first = np.random.default_rng(0), 0.05
    spread = np.zeros(25)
    spread[0] = first
    xs = np.cumsum(np.concatenate([[0.0], _WANDER[0] * rng.standard_normal(29)])) + BLUR * rng.standard_normal(30)
    pose = np.zeros(25)
    pose[2] = 0.9
    tracker = ParticleFilter(Standing(), Positions(), 4000, hidden=0.0, keep=True, seed=1)
    tracker.start(Start.at(pose, spread=spread))
    for x in xs:
        tracker.step(x=x)
    means, variances = exact(xs, first, _WANDER[0])
    found = np.array([belief.poses[:, 0] for belief in tracker.smoothed(2000)])
    np.testing.assert_allclose(found.mean(axis=1), means, atol=0.25 * np.sqrt(variances.min()))
    assert np.abs(found.std(axis=1) / np.sqrt(variances) - 1).mean() < 0.1


def test_the_future_tells_where_somebody_was_who_could_not_be_seen():
    """Over ten pictures without anybody, smoothed joints are nearer to the truth than those that were filtered."""
    model = load("walk/fpca")
    walks = model.walks(2.0, 30.0, n=4, seed=5, skeleton=model.skeleton())
    camera = view(np.pi / 2, width=96, height=64, distance=6.0, fov_degrees=40.0)
    errors = []
    for k, walk in enumerate(np.asarray(walks.poses)):
        walk = walk - np.eye(25)[0] * walk[:, 0].mean()
        prior = FPCAPrior(model, skeleton=model.skeleton())
        tracker = ParticleFilter(
            prior, SilhouetteLikelihood(camera, prior.skeleton, threads=1), 1000, keep=True, seed=k
        )
        tracker.start(Start.at(walk[1], walk[0]))
        for t, pose in enumerate(walk[1:]):
            mask = render(pose, prior.skeleton, camera).limbs > 0
            tracker.step(mask=mask & (not 20 <= t < 30))
        for beliefs in (tracker.beliefs, tracker.smoothed()):
            joints = np.array([belief.expected_joints(prior.skeleton) for belief in beliefs[20:30]])
            errors.append(np.linalg.norm(joints - markers(walk[21:31], prior.skeleton), axis=-1).mean())
    filtered, smoothed = np.reshape(errors, (-1, 2)).T
    assert smoothed.mean() < 0.9 * filtered.mean()


def test_the_same_seed_smooths_to_the_same_bytes_and_what_cannot_be_smoothed_is_refused():
    def followed(prior, keep=True):
        tracker = ParticleFilter(prior, Positions(), 50, keep=keep, seed=2)
        tracker.start(Start.at(np.zeros(25)))
        for x in (0.0, 0.1, 0.2):
            tracker.step(x=x)
        return tracker

    one, other = (followed(FPCAPrior()).smoothed(20) for _ in range(2))
    assert [b.poses.tobytes() for b in one] == [b.poses.tobytes() for b in other]
    with pytest.raises(MotionError, match="keep=True"):
        followed(FPCAPrior(), keep=False).smoothed()
    with pytest.raises(MotionError, match="FPCAPrior"):
        followed(VelocityPrior())
    with pytest.raises(MotionError, match="n must"):
        followed(FPCAPrior()).smoothed(0)
