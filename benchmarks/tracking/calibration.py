"""Simulation-based calibration (Talts et al. 2018) of the particle filter: are its beliefs as wide as its errors?

    motionenv bench tracking.calibration [--episodes 40] [--data found] [--particles 1000] [--split eval]

Data, 60 frames at 30 frames/s:

- "model": truths and pictures are drawn from what the filter believes in, so that only too few particles can be wrong.
  A truth is a particle of a filter that sees nothing, of unknown size and from a rough start. Each pixel of its
  silhouette (64²) is turned over with probability 0.4, and the likelihood says so, without tempering: a wrong pixel
  tells about half as much as one of a clean picture does to the default, tempered likelihood.
- "faint", "sharp": the same with probability 0.48, a twenty-fifth as much, and with 20 % misses and 10 % false alarms,
  fifteen times as much.
- "given", "found": WalkerTracking (masks of 64², people whose bodies no prior knows, --split) as `TrackingAgent` sees
  it, with its first pose given, or found by itself.

The level of a truth is the belief's share below it: uniform if beliefs are calibrated. Tables have the share of frames
in which truths are inside the central 50 % and 90 %, with 95 % intervals over episodes, and the p-value of a χ² test
that the last frames' levels, one an episode, fill ten bins equally. Depth is along the ray to the pelvis and sideways
across it, both on the ground; joints are the 21 angles but the heading; size is the body's.

The last table has the share of frames, after the first second and with any N, whose depth is inside its 90 % band, by
`Belief.ancestors`, of which `Belief.reliable` needs three.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import gymnasium
import numpy as np
from scipy.stats import chisquare

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
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
RATES = {"faint": (0.48, 0.48), "model": (0.4, 0.4), "sharp": (0.2, 0.1)}  # misses and false alarms
DATA = (*RATES, "given", "found")
PARTICLES = (100, 300, 1000, 5000)
# Of a start: number of candidates, deviations of place [m], heading [rad], and how far before the origin [m].
CANDIDATES, PLACED, TURNED, BEFORE = 512, 0.15, 0.12, 1.3
HEADING = POSE.index("root_heading")
ANGLES = [i for i in range(3, len(POSE)) if i != HEADING]
AXES = ("depth", "sideways", "height", "heading", "size", *(POSE[i] for i in ANGLES))
SHOWN = {name: [AXES.index(name)] for name in AXES[:5]} | {"joints": list(range(5, len(AXES)))}
SECOND = 30  # frames
EDGES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 22.0, 40.0, np.inf)
RANKS, LEAST = 10, 50  # bins of levels, and least number of frames of which a share is told
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
    tracker = ParticleFilter(prior, likelihood, n, hidden=0.0, seed=rng)
    walker.start(start)
    tracker.start(start)
    for _ in range(frames):
        truth = walker.step().state.take(np.array([which]))
        body = Raycaster(threads=1).render(apparent(truth.poses, truth.sizes, camera)[0], prior.skeleton, camera).limbs
        shown = np.where(body > 0, 1 - misses, alarms)
        belief = tracker.step(mask=rng.random(shown.shape) < shown)
        yield belief, truth.poses[0], float(truth.sizes[0]), camera


def rendered(
    data: str, n: int, frames: int, split: str, seed: int
) -> Iterator[tuple[Belief, np.ndarray, float, Camera]]:
    """Beliefs of `TrackingAgent` in an episode of WalkerTracking, as of `drawn`."""
    env = gymnasium.make(
        "motionenv/WalkerTracking-v1", split=split, observation="mask", actions="metric", horizon=frames - 1
    )
    prior, start = adults_prior(FPS), truth_start if data == "given" else None
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


@dataclass(frozen=True, eq=False)
class Clips:
    """Levels (episodes, frames, axes) of truths, and the beliefs' ancestors (episodes, frames)."""

    levels: np.ndarray
    ancestors: np.ndarray

    def share(self, axis: str, width: float) -> np.ndarray:
        """Share (episodes,) of truths inside the central bands of a width."""
        return (np.abs(self.levels[..., SHOWN[axis]] - 0.5) < 0.5 * width).mean(axis=(1, 2))

    def uniform(self, axis: str) -> float:
        """p-value of the last frames' levels; one angle per episode where there are many."""
        which = np.arange(len(self.levels)) % len(SHOWN[axis])
        last = self.levels[np.arange(len(self.levels)), -1, np.array(SHOWN[axis])[which]]
        return float(chisquare(np.histogram(last, RANKS, (0, 1))[0]).pvalue)


def record(data: str, n: int, episodes: int, frames: int, split: str) -> Clips:
    """Follow some episodes with `n` particles."""
    found, ancestors = [], []
    for seed in range(episodes):
        clip = drawn(data, n, frames, seed) if data in RATES else rendered(data, n, frames, split, FIRST[split] + seed)
        beliefs = [(levels(belief, *truth), belief.ancestors) for belief, *truth in clip]
        found.append([one for one, _ in beliefs])
        ancestors.append([number for _, number in beliefs])
    return Clips(np.array(found), np.array(ancestors))


def inside(some: list[Clips], low: float, high: float) -> str:
    """Share of frames after the first second whose depth is inside its 90 % band, and their number."""
    ancestors = np.concatenate([clips.ancestors[:, SECOND:].ravel() for clips in some])
    depth = np.concatenate([clips.levels[:, SECOND:, 0].ravel() for clips in some])
    chosen = (ancestors >= low) & (ancestors < high)
    return f"{(np.abs(depth[chosen] - 0.5) < 0.45).mean():.0%} of {chosen.sum():,}" if chosen.sum() >= LEAST else "–"


def main() -> None:
    """Print tables of coverage, and of coverage by ancestors."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=40, quick=2)
    parser.add_argument("--frames", type=int, default=60, quick=SECOND + 2)
    parser.add_argument("--split", choices=FIRST, default="eval")
    parser.add_argument("--data", choices=DATA, action="append", help="by default all of them")
    parser.add_argument("--particles", type=int, action="append", help="by default 100, 300, 1,000 and 5,000")
    asked = parser.parse_args()
    print("| data | N | band |", " | ".join(SHOWN), "|\n|-|-|-|" + "-|" * len(SHOWN), flush=True)
    by_data: dict[str, list[Clips]] = {}
    for data in asked.data or DATA:
        for n in asked.particles or ((20,) if asked.quick else PARTICLES):
            clips = record(data, n, asked.episodes, asked.frames, asked.split)
            by_data.setdefault(data, []).append(clips)
            for width in (0.5, 0.9):
                cells = [cell(mean(clips.share(axis, width)), "{:.0%}") for axis in SHOWN]
                print(f"| {data} | {n:,} | {width:.0%} |", " | ".join(cells), "|", flush=True)
            print(
                f"| {data} | {n:,} | p |", " | ".join(f"{clips.uniform(axis):.2g}" for axis in SHOWN), "|", flush=True
            )
    print("\n| data |", *(f"{low:g} to {high:g} |" for low, high in pairwise(EDGES)))
    print("|-|" + "-|" * (len(EDGES) - 1))
    for data, some in by_data.items():
        print(f"| {data} |", *(inside(some, *edges) + " |" for edges in pairwise(EDGES)), flush=True)


if __name__ == "__main__":
    main()
