"""Backward simulation with the priors of motion: against exact Gaussians, and densities against draws."""

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.errors import MotionError
from motionenv.models.motion_tree.model import PARTS
from motionenv.models.registry import load
from motionenv.tracking import (
    Belief,
    FPCAPrior,
    MixturePrior,
    ParticleFilter,
    Start,
    TreePrior,
    VelocityPrior,
    reaching_tree,
    smooth,
)  # fmt: skip
from motionenv.tracking.priors.velocity import MovingState

ARM, FPS, T = list(RIGHT_ARM), 30.0, 12
ELBOW = ARM[-1]
CHANGE, VELOCITY, BEGINS, MEASURES = 3.0, 2.0, 0.2, 0.15  # [rad/s], [rad/s], [rad], [rad]


class ElbowMeasured:
    def observe(self, *, y):
        self.y = y

    def log_likelihood(self, poses):
        return -0.5 * ((self.y - poses[:, ELBOW]) / MEASURES) ** 2


@pytest.fixture(scope="module")
def elbow():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PARTS, "elbow", (ELBOW,))  # one angle, as few particles say much of that only
        return VelocityPrior(part="elbow", change=np.full(25, CHANGE), velocity=np.full(25, VELOCITY))


@pytest.fixture(scope="module")
def measured():
    rng = np.random.default_rng(0)
    truth = np.cumsum(np.cumsum(CHANGE / FPS * rng.standard_normal(T)))
    return truth + MEASURES * rng.standard_normal(T)


@pytest.fixture(scope="module")
def beliefs(elbow, measured):
    tracker = ParticleFilter(elbow, ElbowMeasured(), 4000, hidden=0.0, seed=1)
    tracker.start(Start.at(np.zeros(25), spread=BEGINS))
    return [tracker.step(y=y) for y in measured]


def exact(y):
    """Means and covariance of the poses (frames,) of one angle given measurements `y`, by one big Gaussian."""
    frames = len(y)
    effects = np.zeros((frames, frames + 1))  # of the first pose, the first velocity, and each frame's change
    effects[:, 0] = BEGINS
    effects[:, 1] = VELOCITY * np.arange(frames) / FPS
    for t in range(1, frames):
        effects[t:, t + 1] = CHANGE / FPS * np.arange(1, frames - t + 1)
    prior = effects @ effects.T
    gain = prior @ np.linalg.inv(prior + MEASURES**2 * np.eye(frames))
    return gain @ y, prior - gain @ prior


def test_constant_velocity_agrees_with_the_exact_smoother(elbow, measured, beliefs):
    mean, covariance = exact(measured)
    drawn = smooth(beliefs, elbow, 1000, seed=2)
    x = drawn[:, :, ELBOW]
    assert np.abs(x.mean(0) - mean).max() < 0.02
    np.testing.assert_allclose(x.std(0), np.sqrt(np.diag(covariance)), rtol=0.12)
    np.testing.assert_allclose(np.corrcoef(x.T), covariance / np.outer(*2 * [np.sqrt(np.diag(covariance))]), atol=0.12)
    filtered = [np.exp(b.log_weights) @ b.poses[:, ELBOW] for b in beliefs]
    assert np.abs(mean - filtered).max() > 0.1  # so that what the filter says wouldn't do
    others = np.delete(drawn, ELBOW, axis=-1)
    np.testing.assert_array_equal(others, np.broadcast_to(others[:, :1], others.shape))
    assert len(np.unique(x[:, 0])) > 300  # motions are not lines of descent


def test_the_density_of_constant_velocity_is_that_of_two_steps():
    arm, rng = VelocityPrior(part="right_arm", change=np.full(25, CHANGE)), np.random.default_rng(3)
    before = arm.initial(Start.at(np.full(25, 9.0), spread=BEGINS), 5, rng)
    after = arm.propagate(before.take(np.arange(4)), rng)
    later = arm.propagate(after, rng)
    got = arm.log_transition(before, after, later)
    x0, x1, x2 = (s.poses[:, ARM] for s in (before, after, later))
    one = norm.logpdf(x1, x0[:, None] + before.velocities[:, None, ARM] / FPS, CHANGE / FPS)
    two = norm.logpdf(x2, 2 * x1 - x0[:, None], CHANGE / FPS)
    np.testing.assert_allclose(got, (one + two).sum(-1), rtol=1e-9)
    np.testing.assert_allclose(arm.log_transition(before, after), one.sum(-1), rtol=1e-9)
    elsewhere = MovingState(after.poses + np.where(np.isin(np.arange(25), ARM), 0.0, 0.1), after.velocities)
    assert (arm.log_transition(before, elsewhere) == -np.inf).all()


def test_a_new_start_cuts_motions(elbow, beliefs):
    cut = [Belief(b.state, b.log_weights, b.effective, 0.0, False, t == 6) for t, b in enumerate(beliefs)]
    whole, x = (smooth(b, elbow, 400, seed=2)[:, :, ELBOW] for b in (beliefs, cut))
    rough, smoothly = (np.diff(m, axis=1).std(axis=0) for m in (x, whole))
    assert rough[5] > 1.2 * smoothly[5]
    np.testing.assert_array_equal(x[:, 6:], whole[:, 6:])


@pytest.fixture(scope="module")
def mixed():
    learned = FPCAPrior("walk/fpca")
    prior = MixturePrior(learned, VelocityPrior(skeleton=learned.skeleton), share=0.3)
    walk = load("walk/fpca").synthesize(seconds=2, fps=30, seed=4, height=learned.skeleton.height).poses
    rng = np.random.default_rng(5)
    return prior, prior.initial(Start.at(walk[20], walk[19]), 4, rng)


def test_motions_of_a_mixture_hang_together(mixed):
    prior, _ = mixed
    tracker = ParticleFilter(prior, ElbowMeasured(), 300, hidden=0.0, seed=1)
    tracker.start(Start.at(load("walk/fpca").synthesize(seconds=1, fps=30, seed=4).poses[10]))
    beliefs = [tracker.step(y=0.1 * t) for t in range(8)]
    drawn = smooth(beliefs, prior, 50, seed=0)
    assert all(np.isin(drawn[:, t, 0], b.poses[:, 0]).all() for t, b in enumerate(beliefs))
    rng = np.random.default_rng(0)
    apart = np.stack([b.poses[rng.choice(300, 50, p=np.exp(b.log_weights))] for b in beliefs], axis=1)
    assert np.abs(np.diff(drawn, 2, axis=1)).mean() < 0.8 * np.abs(np.diff(apart, 2, axis=1)).mean()


def test_what_has_no_density_is_told(beliefs):
    walker, body = FPCAPrior(), FPCAPrior().skeleton
    arm = TreePrior(reaching_tree(clips=5), skeleton=body)
    with pytest.raises(MotionError, match="TreePrior can't be smoothed"):
        smooth(beliefs, arm)
    for prior in (
        MixturePrior(arm, VelocityPrior(skeleton=body)),
        MixturePrior(walker, VelocityPrior(skeleton=body, part="right_arm")),
    ):
        with pytest.raises(MotionError, match="mixture"):
            smooth(beliefs, prior)
    with pytest.raises(MotionError, match="change above 0"):
        smooth(beliefs, VelocityPrior(part="right_arm", change=np.zeros(25)))
