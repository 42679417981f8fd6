"""Parameters of a scene against exact posteriors, and against evidences on a grid."""

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

import motionenv
from benchmarks.tracking.heights import Unknown, estimate_scene, walker_filters
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods import Likelihood
from motionenv.render import Raycaster
from motionenv.render.cameras import view
from motionenv.tracking import ParticleFilter, Start
from motionenv.tracking.priors.base import SPREAD
from motionenv.tracking.priors.guided import GuidedPrior

FPS, MEMORY = 30.0, 0.2
KEEP = np.exp(-1 / (MEMORY * FPS))


class Measured(Likelihood):
    """The first entry of the pose is measured with Gaussian noise."""

    def __init__(self, noise):
        self.noise = noise

    def observe(self, *, y):
        self.y = y

    def log_likelihood(self, poses):
        return -0.5 * ((self.y - poses[:, 0]) / self.noise) ** 2 - np.log(self.noise * np.sqrt(2 * np.pi))


def world(rng, wide, noise, n=100):
    """A filter of an autoregression with stationary deviation `wide`."""
    deviation = np.zeros(25)
    deviation[0] = wide
    prior = GuidedPrior(np.zeros((40, 25)), deviation, skeleton=from_height(), fps=FPS, memory=MEMORY)
    tracker = ParticleFilter(prior, Measured(noise), n, hidden=0.0, seed=rng)
    tracker.start(Start.at(np.zeros(25), spread=deviation))
    return tracker


def covariance(wide, noise, frames):
    """Of the measurements (frames,): they are jointly Gaussian."""
    apart = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
    return wide**2 * KEEP**apart + noise**2 * np.eye(frames)


def exact_log(ys, a, b):
    """Log posterior, up to a constant, of parameters a and b standard deviations from their medians."""
    cov = covariance(0.4 * np.exp(0.5 * a), 0.4 * np.exp(0.5 * b), len(ys))
    return multivariate_normal.logpdf(ys, cov=cov) - 0.5 * (a * a + b * b)


def test_posterior_is_the_exact_one():
    ys = np.random.default_rng(1).multivariate_normal(np.zeros(15), covariance(0.6, 0.3, 15))
    unknown = {"wide": Unknown(0.4, 0.5), "noise": Unknown(0.4, 0.5)}
    done = []
    scene = estimate_scene(
        world, [{"y": y} for y in ys], unknown, steps=1000, warm_up=200, seed=2, on_progress=done.append
    )
    assert done == list(range(1, 1201))
    grid = np.linspace(-3, 3, 61)
    logs = np.array([[exact_log(ys, a, b) for b in grid] for a in grid])
    exact = np.exp(logs - logs.max())
    exact /= exact.sum()
    for axis, name in ((1, "wide"), (0, "noise")):
        weights, x = exact.sum(axis=axis), 0.4 * np.exp(0.5 * grid)
        mean = weights @ x
        deviation = np.sqrt(weights @ (x - mean) ** 2)
        assert abs(scene.mean[name] - mean) < 0.4 * deviation  # the chain is worth about a hundred draws
        assert abs(np.log(scene.samples[name].std() / deviation)) < 0.4
    assert 0.1 < scene.accepted < 0.6
    assert "wide" in repr(scene)


def clip(height, frames=8):
    """Silhouettes of a walker, the camera, and a start that doesn't say how high the pelvis is."""
    walk = motionenv.synthesize("walk/fpca", seconds=frames / FPS, fps=FPS, seed=5, height=height)
    camera = view(0.3, distance=5.0, width=96, height=96)
    masks = Raycaster(threads=1).render(walk.poses, walk.skeleton, camera, rgb=False).limbs > 0
    spread = SPREAD.copy()
    spread[2] = 0.1
    pose = walk.poses[0].copy()
    pose[2] = 0.93
    return [{"mask": mask} for mask in masks], camera, Start.at(pose, spread=spread)


@pytest.mark.slow
def test_height_is_distributed_as_evidences_on_a_grid_say():
    seen, camera, start = clip(1.9)
    build, prior = walker_filters(camera, start, n=500, fps=FPS), Unknown(1.72, 0.07, 1.2, 2.3)
    scene = estimate_scene(build, seen, {"height": prior}, steps=200, warm_up=60, seed=0)
    grid = np.linspace(1.7, 2.1, 15)
    logs = []
    for i, height in enumerate(grid):
        trackers = [build(np.random.default_rng([i, k]), height=height) for k in range(4)]
        evidence = logsumexp([sum(t.step(**one).log_evidence for one in seen) for t in trackers])
        logs.append(evidence - 0.5 * (np.log(height / prior.median) / prior.spread) ** 2 - np.log(height))
    weights = np.exp(logs - logsumexp(logs))
    mean = weights @ grid
    deviation = np.sqrt(weights @ (grid - mean) ** 2)
    assert abs(scene.mean["height"] - mean) < 0.7 * deviation
    assert abs(scene.mean["height"] - 1.9) < 0.06
    assert 0.5 < scene.samples["height"].std() / deviation < 2


def test_same_seed_same_chain_within_bounds():
    ys = [{"y": y} for y in np.random.default_rng(0).standard_normal(6)]
    unknown = {"wide": Unknown(0.4, 1.0), "noise": Unknown(0.4, 0.5, low=0.35, high=0.5)}
    a, b = (estimate_scene(world, ys, unknown, steps=60, warm_up=30, seed=7) for _ in range(2))
    assert a.accepted > 0
    for name in unknown:
        np.testing.assert_array_equal(a.samples[name], b.samples[name])
    assert ((a.samples["noise"] >= 0.35) & (a.samples["noise"] <= 0.5)).all()


def test_heights_and_cameras_change_what_is_compared_but_not_its_weight():
    _, camera, start = clip(1.75, frames=2)
    found = Start(start.poses, start.log_weights, start.previous, np.zeros(25), heights=np.array([1.75]))
    build = walker_filters(camera, found, n=4, fps=FPS)
    trackers = {h: build(np.random.default_rng(0), height=h, camera_height=1.6) for h in (1.75, 2.0)}
    stout = build(np.random.default_rng(0), height=1.75, girth=1.2)
    stouter = stout.likelihood.skeleton.radii / trackers[1.75].likelihood.skeleton.radii
    assert np.median(stouter) == pytest.approx(1.2)  # arms and legs; a head stays as it is
    assert trackers[2.0].likelihood.camera.centre[2] == pytest.approx(1.6)
    tempers = [t.likelihood.temper for t in trackers.values()]
    assert tempers == pytest.approx(
        [walker_filters(camera, start, n=4)(np.random.default_rng(0), 1.5).likelihood.temper] * 2
    )
    seen = np.zeros((96, 96), bool)
    away = {
        h: np.linalg.norm(t.step(mask=seen).poses[:, :2] - camera.centre[:2], axis=1).mean()
        for h, t in trackers.items()
    }
    assert away[2.0] / away[1.75] == pytest.approx(2.0 / 1.75)


def test_what_cannot_be_estimated_is_refused():
    seen, unknown = [{"y": 0.0}], {"wide": Unknown(1.0, 0.1), "noise": Unknown(1.0, 0.1)}
    with pytest.raises(MotionError, match="at least one observation"):
        estimate_scene(world, [], unknown)
    with pytest.raises(MotionError, match="one unknown parameter"):
        estimate_scene(world, seen, {})
    with pytest.raises(MotionError, match="steps"):
        estimate_scene(world, seen, unknown, steps=0)
    with pytest.raises(MotionError, match="spread"):
        Unknown(1.0, 0.0)
    with pytest.raises(MotionError, match="median"):
        Unknown(1.0, 0.1, low=1.2)
