"""Simulation-based calibration (Talts et al. 2018) of the particle filter: are its beliefs as wide as its errors?

    motionenv bench tracking.calibration [--episodes 100] [--data model] [--data sharp] [--particles 1000] [--csv FILE]

Data:

- "model": truths and pictures are drawn from what the filter believes in, so that all that can be wrong are too few
  particles. A truth is a particle of a filter that sees nothing (60 frames, 30 frames/s, unknown body size, wide
  start); its silhouette of 64² has pixels turned over with probability 0.4, and the likelihood knows so. With this rate a
  wrong pixel costs as much, on average, as by the default, tempered likelihood in a clean picture.
- "sharp": the same with 20 % misses and 10 % false alarms, and pixels that count in full: ten times the information.
- "given", "found": WalkerTracking (masks of 64²; rendered walkers of other bodies) as `TrackingAgent` sees it, with its
  first pose given or found by itself, on a split of --split.

The level u of a truth is the belief's share below it: uniform if calibrated. Tables show the share of frames in which
it is inside the central 50 % and 90 %, means over episodes with 95 % intervals, and in brackets the p-value of a χ² test
that the last frames' levels, one an episode, fill ten bins equally. Depth is along the ray through the pelvis, sideways
across it, both on the ground; joints are the 22 angles but the heading; size is the body's.

Ancestors are the effective number 1 / Σ W² of distinct ancestors one second ago, W being the weights of all particles
that descend from one. The last table shows how often depth is inside its 90 % band, by that number.
"""

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
from scipy.stats import chisquare

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from benchmarks.tracking.lineage import TracedPrior, distinct
from benchmarks.tracking.tables import cell, mean
from motionenv.envs.agents import TrackingAgent, truth_start
from motionenv.envs.agents.particle_filter import adults_prior
from motionenv.likelihoods import Likelihood, SilhouetteLikelihood
from motionenv.likelihoods.base import apparent
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkingModel
from motionenv.render import Raycaster
from motionenv.render.cameras import view
from motionenv.tracking import Belief, FPCAPrior, ParticleFilter, Start
from motionenv.tracking.initialization import SPREAD
from motionenv.types import POSE, Camera

FPS, SIZE, DISTANCE = 30.0, 64, 7.0
RATES = {"model": (0.4, 0.4), "sharp": (0.2, 0.1)}  # misses and false alarms
DATA = (*RATES, "given", "found")
PARTICLES = (100, 300, 1000, 5000)
# Of a start: number of candidates, deviations of place [m], heading [rad], and how far before the origin [m].
CANDIDATES, PLACED, TURNED, BEFORE = 512, 0.15, 0.12, 1.3
HEADING = POSE.index("root_heading")
ANGLES = [i for i in range(3, len(POSE)) if i != HEADING]
AXES = ("depth", "sideways", "height", "heading", "size", *(POSE[i] for i in ANGLES))
SHOWN = {name: [AXES.index(name)] for name in AXES[:5]} | {"joints": list(range(5, len(AXES)))}
SECOND = 30  # frames
EDGES = (0.0, 1.5, 2.5, 4.0, 6.0, 9.0, 14.0, 22.0, 40.0, 80.0, np.inf)
FIRST = {"train": 0, "eval": 5000}  # seeds of a split


class Blind(Likelihood):
    """Sees nothing; the camera is for priors of unknown size."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def observe(self) -> None:
        """Nothing."""

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        return np.zeros(len(poses))


def wide_start(prior: FPCAPrior, rng: np.random.Generator) -> Start:
    """Candidates of a walker who will pass the origin: his body's size, gait, place and heading are known roughly."""
    walks = load("walk/fpca")
    assert isinstance(walks, WalkingModel)
    poses = walks.walks(1.2, FPS, n=CANDIDATES, skeleton=prior.skeleton, seed=rng).poses[:, rng.integers(36)].copy()
    sizes, towards = np.exp(prior.size * rng.standard_normal(CANDIDATES)), rng.uniform(-np.pi, np.pi)
    poses[:, :2] = PLACED * rng.standard_normal((CANDIDATES, 2)) - BEFORE * np.array([np.cos(towards), np.sin(towards)])
    poses[:, 2] *= sizes
    poses[:, HEADING] = towards + TURNED * rng.standard_normal(CANDIDATES)
    return Start(
        poses, np.zeros(CANDIDATES), np.full(poses.shape, np.nan), SPREAD, heights=sizes * prior.skeleton.height
    )


def drawn(data: str, n: int, frames: int, seed: int) -> Iterator[tuple[Belief, np.ndarray, float, Camera]]:
    """Beliefs of a clip whose truth is drawn from the filter's own model, with true poses (25,) and sizes."""
    rng = np.random.default_rng([38, seed])
    prior, camera = adults_prior(FPS), view(0.0, distance=DISTANCE, width=SIZE, height=SIZE)
    start, misses_alarms = wide_start(prior, rng), RATES[data]
    walker = ParticleFilter(prior, Blind(camera), 2, hidden=0.0, seed=rng)
    which = rng.integers(2)  # systematic resampling takes the first from the first half of the candidates
    misses, alarms = misses_alarms
    likelihood = SilhouetteLikelihood(
        camera, prior.skeleton, misses=misses, false_alarms=alarms, effective=None, threads=1
    )
    tracker = ParticleFilter(TracedPrior(prior, SECOND), likelihood, n, hidden=0.0, seed=rng)
    walker.start(start)
    tracker.start(start)
    for _ in range(frames):
        truth = walker.step().state.take(np.array([which]))
        body = Raycaster(threads=1).render(apparent(truth.poses, truth.sizes, camera)[0], prior.skeleton, camera).limbs
        shown = np.where(body > 0, 1 - misses, alarms)
        belief = tracker.step(mask=rng.random(shown.shape) < shown)
        yield belief, truth.poses[0], float(truth.sizes[0]), camera


def rendered(data: str, n: int, frames: int, split: str, seed: int) -> Iterator[tuple[Belief, np.ndarray, float, Camera]]:
    """Beliefs of `TrackingAgent` in an episode of WalkerTracking, as of `drawn`."""
    env = gymnasium.make(
        "motionenv/WalkerTracking-v1", split=split, observation="mask", actions="metric", horizon=frames - 1
    )
    prior, start = TracedPrior(adults_prior(FPS), SECOND), truth_start if data == "given" else None
    agent, over = TrackingAgent(env, prior, n, start=start, seed=seed, threads=1), False
    observation, _ = env.reset(seed=seed)
    agent.reset(observation)
    while not over:
        action = agent.act(observation)
        truth = env.unwrapped.truth()
        yield agent.beliefs[0], truth["pose"], truth["skeleton"].height / prior.skeleton.height, truth["camera"]
        observation, _, _, over, _ = env.step(action)


def levels(belief: Belief, pose: np.ndarray, size: float, camera: Camera) -> np.ndarray:
    """Share of a belief below the truth, by `AXES`; half of what equals it."""
    ray = pose[:2] - camera.centre[:2]
    ray /= np.hypot(*ray)
    off = belief.poses - pose
    turned = np.remainder(off[:, 3:] + np.pi, 2 * np.pi) - np.pi
    off[:, 3:] = turned
    sizes = np.ones(len(off)) if belief.state.sizes is None else belief.state.sizes
    axes = [off[:, :2] @ ray, off[:, :2] @ [-ray[1], ray[0]], off[:, 2], off[:, HEADING], np.log(sizes / size)]
    below = np.stack([*axes, *off[:, ANGLES].T])
    return (0.5 * (np.sign(-below) + 1)) @ np.exp(belief.log_weights)


def record(data: str, n: int, episodes: int, frames: int, split: str) -> dict[str, np.ndarray]:
    """Levels (episodes, frames, axes) of truths, and ancestors and effective sample sizes (episodes, frames)."""
    found: dict[str, Any] = {"levels": [], "ancestors": [], "half": [], "count": [], "effective": []}
    for seed in range(episodes):
        clip = drawn(data, n, frames, seed) if data in RATES else rendered(data, n, frames, split, FIRST[split] + seed)
        rows = [
            (levels(belief, *truth), distinct(belief, SECOND), [distinct(belief, k) for k in (3, 5, 10, 15, 20)],
             len(np.unique(belief.state.ancestors[:, -1])), belief.effective)
            for belief, *truth in clip
        ]  # fmt: skip
        for name, column in zip(found, zip(*rows, strict=True), strict=True):
            found[name].append(np.array(column))
    return {name: np.array(values) for name, values in found.items()}
