"""One episode of the tracking benchmark: the environment, the tracker and its errors."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks.tracking.people import FPS, Cut
from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods.silhouette import EFFECTIVE
from motionenv.metrics import credible_level
from motionenv.render.sensors.augmentation import FAR
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.tracking.initialization import automatic_start
from motionenv.tracking.priors.tree import TreePrior
from motionenv.tracking.priors.velocity import VelocityPrior
from motionenv.types import MARKERS, Skeleton

SIZE = 128
NOISE = 8.0  # grey levels
ARM_EFFECTIVE = 100.0  # independent pixels of the body; only the arm, a tenth of them, is unknown
LOOKED = 10  # pictures used by the automatic start
EVERY, DRAWS = 10, 200  # interval of frames at which coverage is evaluated, and draws from each belief
LIMBS = [(MARKERS.index(f"{side}_{a}"), MARKERS.index(f"{side}_{b}")) for side in ("right", "left")
         for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))]  # fmt: skip
PELVIS = MARKERS.index("pelvis")


@dataclass(frozen=True)
class Task:
    """An episode to run.

    Attributes:
        tracker: a key of `TRACKERS`.
        n: number of particles.
        cut: the motion.
        seed: seed of environment and tracker.
        arm: whether to track only the arm, in ArmTracking.
        sees: "rgb" with clutter, noise and a known empty scene; or the exact silhouette ("mask") or "depth".
        camera: argument of the environment.
        hidden: frames [first, last) without the person.
        occluders: number of occluders.
        doubts: whether the likelihood takes the rates that `TrackingAgent` tries for people behind things.
        body: "true", or "average" proportions with the true height.
        start: "given", or "automatic" from the first pictures.
    """

    tracker: str
    n: int
    cut: Cut
    seed: int
    arm: bool = False
    sees: str = "rgb"
    camera: str = "side"
    hidden: tuple[int, int] = (0, 0)
    occluders: int = 0
    doubts: bool = False
    body: str = "true"
    start: str = "given"


def _walk(task: Task) -> str:
    return str(Path(task.cut.folder) / f"walk_{task.cut.person}.npz")


def _fpca(task: Task, skeleton: Skeleton) -> FPCAPrior:
    return FPCAPrior(_walk(task), skeleton=skeleton)


def _tree(task: Task, skeleton: Skeleton) -> TreePrior:
    part = "arm" if task.arm else "tree"
    return TreePrior(str(Path(task.cut.folder) / f"{part}_{task.cut.person}.npz"), skeleton=skeleton)


def _constant_velocity(task: Task, skeleton: Skeleton) -> VelocityPrior:
    change = np.load(Path(task.cut.folder) / f"change_{task.cut.person}.npy")
    return VelocityPrior(skeleton=skeleton, part="right_arm" if task.arm else "body", change=change)


@dataclass(frozen=True)
class Tracker:
    """Configuration of a tracker.

    Attributes:
        prior: makes the prior from a task and a skeleton.
        effective: number of the body's pixels counted as independent if its shape is known.
        options: options of the filter.
    """

    prior: Callable[[Task, Skeleton], Any]
    effective: float = EFFECTIVE
    options: dict[str, Any] = field(default_factory=dict)


TRACKERS = {
    "fpca": Tracker(_fpca),
    "annealed": Tracker(_fpca, 15.0, {"layers": 3}),
    "tree": Tracker(_tree),
    "annealed tree": Tracker(_tree, 15.0, {"layers": 3}),
    "constant velocity": Tracker(_constant_velocity),
}


@dataclass(frozen=True)
class Episode:
    """Observations and truths of an episode.

    Attributes:
        observations: arguments of the likelihood's `observe` for each frame.
        truths: results of `WalkerTracking.truth` for each frame.
    """

    observations: list[dict[str, np.ndarray]]
    truths: list[dict[str, Any]]


def seen(task: Task) -> Episode:
    """Record a task's episode; actions don't influence observations."""
    scenery = {"background": "clutter", "noise": NOISE} if task.sees == "rgb" else {}
    name = "motionenv/ArmTracking-v1" if task.arm else "motionenv/WalkerTracking-v1"
    scenery |= {} if task.arm else {"start": "line"}
    env = gymnasium.make(
        name, motion=task.cut.motion, size=SIZE, observation=task.sees, camera=task.camera, fps=FPS, split="eval",
        horizon=task.cut.frames - 1, occluders=task.occluders, **scenery,
    )  # fmt: skip
    observation, _ = env.reset(seed=task.seed)
    empty = empty_scene(env.unwrapped.world.stage)
    nothing = np.zeros(env.action_space.shape, np.float32)
    episode, over = Episode([], []), False
    while not over:
        episode.observations.append(evidence(task, observation, empty, len(episode.truths)))
        episode.truths.append(env.unwrapped.truth())
        observation, _, _, over, _ = env.step(nothing)
    env.close()
    return episode


def play(task: Task) -> dict[str, Any]:
    """Run a tracker on an episode; returns errors, credible levels and times for `benchmarks.tracking.tables.row`."""
    episode, tracker = seen(task), TRACKERS[task.tracker]
    true = episode.truths[0]["skeleton"]
    body = true if task.body == "true" else from_height(true.height)
    effective = ARM_EFFECTIVE if task.arm else tracker.effective if task.body == "true" else EFFECTIVE
    camera = episode.truths[0]["camera"]
    likelihood = SilhouetteLikelihood(camera, body, effective=effective, threads=1, **rates(task))
    filtered = ParticleFilter(tracker.prior(task, body), likelihood, task.n, seed=task.seed, **tracker.options)
    filtered.start(first(task, episode, likelihood))
    frames, levels, seconds = [], [], []
    rng = np.random.default_rng(task.seed)
    for t, (observation, truth) in enumerate(zip(episode.observations, episode.truths, strict=True)):
        began = time.perf_counter()
        belief = filtered.step(**observation)
        seconds.append(time.perf_counter() - began)
        frames.append(errors(belief.expected_joints(body), truth["joints"], task.arm))
        if t % EVERY == EVERY - 1:
            levels.append(level(belief, body, truth["joints"], task.arm, rng))
    return {name: np.array([frame[name] for frame in frames]) for name in frames[0]} | {
        "levels": np.array(levels), "seconds": np.median(seconds), "trial": task.cut.trial,
    }  # fmt: skip


def rates(task: Task) -> dict[str, float]:
    """Rates of misses and false alarms, where they aren't the likelihood's usual ones."""
    return {"misses": 0.49, "false_alarms": 0.02} if task.doubts else {}


def first(task: Task, episode: Episode, likelihood: SilhouetteLikelihood) -> Start:
    """The tracker's start."""
    if task.start == "given":
        return given(task, episode.truths[0]["pose"])
    return automatic_start(likelihood, episode.observations[:LOOKED], fps=FPS, model=_walk(task), seed=task.seed)


def given(task: Task, pose: np.ndarray) -> Start:
    """Start with the true first pose (25,) [m, rad] and the one before it."""
    before, first = task.cut.poses
    if np.isnan(first).any():
        return Start.at(pose)
    previous = pose.copy()
    if task.arm:
        previous[list(RIGHT_ARM)] = before[list(RIGHT_ARM)]
        return Start.at(pose, previous)
    turn = pose[5] - first[5]
    c, s = np.cos(turn), np.sin(turn)
    previous += before - first
    previous[:2] = pose[:2] + np.array([[c, -s], [s, c]]) @ (before - first)[:2]
    return Start.at(pose, previous)


def empty_scene(stage) -> np.ndarray:
    """The scene without the person (size, size, 3), a mean over noisy pictures."""
    poses, now = stage.poses.copy(), stage.time.copy()
    stage.poses[:, :, :2] -= 100.0 * stage.R[:, None, 2, :2]  # behind the camera
    pictures = []
    for t in range(stage.poses.shape[1]):
        stage.time[:] = t
        pictures.append(np.asarray(stage.draw(np.arange(stage.n)).rgb)[0])
    stage.poses[:], stage.time[:] = poses, now
    return np.mean(pictures, axis=0)


def evidence(task: Task, observation: np.ndarray, empty: np.ndarray, t: int) -> dict[str, np.ndarray]:
    """Arguments of the likelihood's `observe` for frame `t`."""
    hidden = task.hidden[0] <= t < task.hidden[1]
    if task.sees == "depth":
        return {"depth": np.where(observation[..., 0] < FAR, observation[..., 0], np.inf)}
    if task.sees == "mask":
        return {"mask": np.zeros_like(observation[..., 0]) if hidden else observation[..., 0]}
    if hidden:
        noise = np.random.default_rng([task.seed, t]).normal(0.0, NOISE, empty.shape)
        observation = np.clip(np.rint(empty + noise), 0, 255).astype(np.uint8)
    return {"rgb": observation, "background": empty}


def errors(estimate: np.ndarray, truth: np.ndarray, arm: bool) -> dict[str, Any]:
    """Errors of joints: mean distance [m], mean distance relative to the pelvis [m], and limb errors [limb lengths].

    Args:
        estimate: (15, 3) estimated joints [m].
        truth: (15, 3) true joints [m].
        arm: whether only the right arm counts.
    """
    limbs = LIMBS[:2] if arm else LIMBS
    counted = [end for _, end in limbs] if arm else slice(None)
    away = np.linalg.norm(estimate - truth, axis=1)
    about = np.linalg.norm((estimate - estimate[PELVIS]) - (truth - truth[PELVIS]), axis=1)
    off = [away[end] / np.linalg.norm(truth[end] - truth[start]) for start, end in limbs]
    return {"absolute": away[counted].mean(), "relative": about[counted].mean(), "limbs": np.array(off)}


def level(belief, body: Skeleton, truth: np.ndarray, arm: bool, rng: np.random.Generator) -> np.ndarray:
    """Credible levels (15,) of the true joints; for the arm, those of elbow and wrist."""
    which = rng.choice(len(belief.poses), DRAWS, p=np.exp(belief.log_weights))
    draws = markers(belief.poses[which], body)
    levels = credible_level(draws[None], np.zeros((1, DRAWS)), truth[None], seed=rng)[0]
    return levels[[end for _, end in LIMBS[:2]]] if arm else levels
