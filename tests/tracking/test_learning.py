"""Filters that teach their likelihoods while they follow: colours of limbs, and the background beside the body."""

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height, markers, mirror
from motionenv.envs.agents import TrackingAgent, evaluate, truth_start
from motionenv.envs.walker import WalkerTracking
from motionenv.likelihoods import AppearanceLikelihood, Likelihood, ProductLikelihood, SilhouetteLikelihood
from motionenv.models.registry import load
from motionenv.render import Raycaster
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.tracking.initialization import automatic_start
from motionenv.types import MARKERS

BODY, CAMERA = from_height(), view(0.0, width=64, height=64, distance=6.5)
SIDE = np.array([0, *({"left": 1, "right": 2}.get(limb.split("_")[0], 3) for limb in LIMBS)])
CLOTHES = np.array([[110, 120, 130], [200, 60, 60], [40, 60, 160], [120, 160, 90]])  # of background, left, right, trunk
LEFT, RIGHT = ([MARKERS.index(f"{side}_{joint}") for joint in ("knee", "ankle")] for side in ("left", "right"))


def crossing(seed, frames):
    """Somebody in two colours walks past: poses (frames, 25), masks, pictures."""
    rng = np.random.default_rng(seed)
    poses = np.array(load("walk/fpca").walks(frames / 30, 30.0, n=1, seed=rng, height=1.75).poses).reshape(-1, 25)
    poses[:, :2] -= poses[:, :2].mean(axis=0)
    limbs = Raycaster().render(poses, BODY, CAMERA, rgb=False).limbs
    rgb = CLOTHES[SIDE[limbs]] + rng.normal(0, 8, (*limbs.shape, 3))
    return poses, limbs > 0, rgb.clip(0, 255).astype(np.uint8)


def exchanged(seed, weight, known=12, frames=24):
    """Share of the belief that takes left for right, twelve frames after half of it was made to."""
    poses, masks, pictures = crossing(seed, frames)
    likelihood = ProductLikelihood(
        [SilhouetteLikelihood(CAMERA, threads=1), AppearanceLikelihood(CAMERA, threads=1)], [1.0, weight]
    )
    tracker = ParticleFilter(FPCAPrior(), likelihood, 400, seed=seed)
    tracker.start(Start.at(poses[0]))
    for t, (mask, rgb) in enumerate(zip(masks, pictures, strict=True)):
        if t == known:
            both, before = (np.stack([pose, mirror(pose)]) for pose in (poses[t], poses[t - 1]))
            tracker.start(Start(both, np.zeros(2), before, np.full(25, 0.03)))
        belief = tracker.step(mask=mask, rgb=rgb)
    said, truth = markers(belief.poses, BODY), markers(poses[-1], BODY)
    right = np.linalg.norm(said[:, LEFT + RIGHT] - truth[LEFT + RIGHT], axis=-1).sum(axis=1)
    wrong = np.linalg.norm(said[:, LEFT + RIGHT] - truth[RIGHT + LEFT], axis=-1).sum(axis=1)
    return np.exp(belief.log_weights) @ (wrong < right)


@pytest.mark.slow
def test_colours_that_were_learned_tell_left_from_right():
    """Seen from the side, where silhouettes hardly do."""
    by_outline, by_colours = ([exchanged(seed, weight) for seed in range(5)] for weight in (0.0, 1.0))
    assert np.mean(by_outline) > 0.05
    assert np.max(by_colours) < 0.02


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


def test_a_new_start_keeps_the_colours_and_teaches_nothing_in_that_frame():
    pupil, pose = Pupil(), np.r_[0.0, 0.0, 0.93, np.zeros(22)]
    there = np.r_[50.0, pose[1:]]
    tracker = ParticleFilter(FPCAPrior(), pupil, 100, seed=0, restart=lambda seen: Start.at(there))
    tracker.start(Start.at(pose))
    beliefs = [tracker.step(at=50.0) for _ in range(30)]
    when = [b.recovered for b in beliefs].index(True)
    assert len(pupil.taught) == sum(not b.lost for b in beliefs[when + 1 :])


def test_looking_for_a_start_teaches_nothing():
    _, _, pictures = crossing(0, 3)
    likelihood = ProductLikelihood([SilhouetteLikelihood(CAMERA), AppearanceLikelihood(CAMERA)])
    automatic_start(likelihood, [{"rgb": rgb} for rgb in pictures], n=100, seed=0)
    likelihood.observe(rgb=pictures[0])
    np.testing.assert_array_equal(likelihood.models[1].log_likelihood(np.zeros((4, 25))), 0.0)


def test_each_episode_learns_colours_anew():
    env, made = WalkerTracking(size=48, observation=["rgb", "mask"], horizon=4), []

    def likelihood(camera, skeleton):
        made.append(AppearanceLikelihood(camera, skeleton, threads=1))
        return ProductLikelihood([SilhouetteLikelihood(camera, skeleton, threads=1), made[-1]])

    evaluate(env, TrackingAgent(env, n=100, likelihood=likelihood, seed=0), 2, seed=1)
    assert len(made) == 2
    assert made[0] is not made[1]
    assert made[0].log_likelihood(np.array([env.truth()["pose"]]))[0] != 0.0


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
