"""How well trackers that find their own start follow people who turn, slow down, stop and start again.

    motionenv bench tracking.turning [--films 20] [--split eval] [--prior fpca] [--course free] [--strips FOLDER]

WalkerTracking films a walk of four seconds (30 frames/s) with a level camera at a random angle, as near as the whole
way allows: 128² pixels, clutter, noise of 8 grey levels, clothes of random colours that are equal on both sides.
`TrackingAgent` with N = 1,000 gets the camera, the empty scene and the pictures, as in `benchmarks.tracking`'s "start",
and finds the first pose in them. With --learned it isn't given the scene, either, as in -Hard.

- Courses: "straight" at an even speed; "turning", the same along `random_path` with a least radius of 1 to 2.5 m;
  "free", also with slowing down, hurrying and stops of 0.5 to 1.2 s.
- Priors: "fpca" doesn't know the body's size; "tree" can't have an unknown one and is given the height.
- "Kept" are films whose mean error of the 15 joints over the second half is below 300 mm, the bound of
  `tracking.agent`. "Exchanged" are films over whose second half the legs, relative to the pelvis, are nearer to the
  truth with left and right exchanged. Joints and heading are median errors over films, of the second half.
- Split "train", on which the priors' settings were chosen, has walkers of walk/fpca with seeds from 0; "eval" has
  eigenwalkers, made from no prior's model, with seeds from 5,000. Intervals are 95 %: Wilson's for shares, a
  bootstrap's over films for medians.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments, scratch
from benchmarks.tracking.episode import empty_scene
from benchmarks.tracking.tables import cell, median, share
from motionenv import write
from motionenv.body import from_height
from motionenv.envs.agents import TrackingAgent
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.paths import WalkPath, random_path, walk_along
from motionenv.models.registry import load
from motionenv.render.draw2d.overlay import draw_pose, strip
from motionenv.render.video.encode import write_image
from motionenv.tracking import FPCAPrior, TreePrior
from motionenv.tracking.priors.base import Prior
from motionenv.types import MARKERS, Camera, Motion, Skeleton

FPS, SIZE, NOISE, KEPT = 30.0, 128, 8.0, 0.3
BODY = 0.07  # standard deviation of the log of an unknown body's size, as in TrackingAgent
SPLITS = {"train": ("walk/fpca", 0), "eval": ("walk/eigenwalkers", 5000)}
COURSES = ("straight", "turning", "free")
PRIORS = ("fpca", "tree")
LEGS = [MARKERS.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("knee", "ankle")]
PELVIS = MARKERS.index("pelvis")
SHOWN = 10  # pictures in a strip


def walked(model: str, course: str, seed: int, frames: int) -> Motion:
    """The walk of a film: by `model`, on a course of `COURSES`."""
    rng = np.random.default_rng([16, seed])
    fast, radius = rng.uniform(0.8, 1.5), rng.uniform(1.0, 2.5)
    seconds = frames / FPS
    speed: float | list = fast
    if course == "free":
        speed = _speeds(rng, fast, seconds)
    way = WalkPath.line(20.0) if course == "straight" else random_path(rng, 20.0, radius=max(radius, 0.5 * fast**2))
    height = float(rng.uniform(1.5, 1.95))
    return walk_along(load(model), way, seconds, FPS, seed=seed, speed=speed, height=height)


def _speeds(rng: np.random.Generator, fast: float, seconds: float) -> list[tuple[float, float]]:
    """Rows (time [s], speed [m/s]): changes to other speeds up to `fast`, of which one in three is a stop."""
    rows, now = [(0.0, fast)], rng.uniform(0.4, 1.2)
    while now < seconds:
        wanted = 0.0 if rng.random() < 1 / 3 and rows[-1][1] else float(fast * rng.uniform(0.5, 1.0))
        rows += [(now, rows[-1][1]), (now + 0.5, wanted)]
        now += 0.5 + (rng.uniform(0.5, 1.2) if wanted == 0 else rng.uniform(0.8, 1.6))
    return rows


def prior_of(name: str, height: float) -> Prior:
    """A prior of `PRIORS`; `height` [m] of the body is told to those that can't leave it open."""
    if name == "tree":
        return TreePrior(skeleton=from_height(height), fps=FPS)
    return FPCAPrior(fps=FPS, size=BODY)


class SceneLikelihood(SilhouetteLikelihood):
    """Silhouettes before an empty `scene` (height, width, 3) that is known."""

    def __init__(self, camera: Camera, skeleton: Skeleton, scene: np.ndarray):
        super().__init__(camera, skeleton, threads=1)
        self.scene = scene

    def observe(self, *, rgb) -> None:
        """Set the current picture, as of `SilhouetteLikelihood`."""
        super().observe(rgb=rgb, background=self.scene)


def played(name: str, course: str, asked: argparse.Namespace) -> Iterator[dict[str, float]]:
    """Results of each film."""
    model, first = SPLITS[asked.split]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + asked.films):
            file = Path(folder) / f"{seed}.npz"
            write(walked(model, course, seed, asked.frames), file)
            env = gymnasium.make(
                "motionenv/WalkerTracking-v1", motion=str(file), size=SIZE, start="line", camera="random", fps=FPS,
                background="clutter", noise=NOISE, horizon=asked.frames - 1, actions="metric",
            )  # fmt: skip
            frames, result = _film(env, name, seed, not asked.learned, asked.particles)
            env.close()
            if asked.strips is not None:
                asked.strips.mkdir(parents=True, exist_ok=True)
                write_image(asked.strips / f"{course}-{name}-{seed}.png", strip(frames, SHOWN))
            yield result


def _film(env, name: str, seed: int, known: bool, particles: int) -> tuple[list[np.ndarray], dict[str, float]]:
    """Pictures with the estimate above and the truth below, and the errors of one film."""
    observation, _ = env.reset(seed=seed)
    prior = prior_of(name, env.unwrapped.truth()["skeleton"].height)
    scene = empty_scene(env.unwrapped.world.stage)
    likelihood = (lambda camera, body: SceneLikelihood(camera, body, scene)) if known else None
    agent = TrackingAgent(env, prior, particles, likelihood=likelihood, seed=seed, threads=1)
    agent.reset(observation)
    frames, joints, true, turned, over, began = [], [], [], [], False, time.process_time()
    while not over:
        action = agent.act(observation)
        truth, belief = env.unwrapped.truth(), agent.beliefs[0]
        joints.append(belief.expected_joints(prior.skeleton))
        true.append(truth["joints"])
        turned.append(np.angle(np.exp(1j * (belief.mean[5] - truth["pose"][5]))))
        both = [draw_pose(observation, found, truth["camera"], width=1.0) for found in (joints[-1], true[-1])]
        frames.append(np.concatenate(both))
        observation, _, _, over, _ = env.step(action)
    return frames, scored(np.array(joints), np.array(true), np.array(turned)) | {
        "seconds": (time.process_time() - began) / len(joints)
    }


def scored(joints: np.ndarray, true: np.ndarray, turned: np.ndarray) -> dict[str, float]:
    """Errors over the second half: of joints [m], of the heading [rad], and whether left and right are exchanged.

    Args:
        joints, true: (frames, 15, 3) estimated and true [m].
        turned: (frames,) error of the heading [rad].
    """
    half = slice(len(joints) // 2, None)
    legs, right = ((p - p[:, PELVIS : PELVIS + 1])[half][:, LEGS] for p in (joints, true))
    swapped = legs[:, [2, 3, 0, 1]]
    as_is, other = (np.linalg.norm(found - right, axis=-1).mean() for found in (legs, swapped))
    return {
        "error": float(np.linalg.norm(joints - true, axis=-1)[half].mean()),
        "heading": float(np.abs(turned[half]).mean()),
        "exchanged": float(other < as_is),
    }


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--films", type=int, default=20, quick=1)
    parser.add_argument("--split", choices=SPLITS, default="eval")
    parser.add_argument("--prior", choices=PRIORS, action="append")
    parser.add_argument("--course", choices=COURSES, action="append")
    parser.add_argument("--frames", type=int, default=120, quick=20, help="of a film")
    parser.add_argument("--particles", type=int, default=1000, quick=10)
    parser.add_argument("--learned", action="store_true", help="the empty scene is learned from the pictures")
    parser.add_argument("--strips", type=Path, quick=scratch(), help="folder for a PNG of each film, the truth below")
    asked = parser.parse_args()
    print("| course | prior | kept | exchanged | joints [mm] | heading [°] | frames/s |\n|-|-|-|-|-|-|-|", flush=True)
    for course in asked.course or COURSES:
        for name in asked.prior or PRIORS:
            found = list(played(name, course, asked))
            error, heading, exchanged, seconds = (
                np.array([one[key] for one in found]) for key in ("error", "heading", "exchanged", "seconds")
            )
            cells = [cell(share(error < KEPT), "{:.0%}"), cell(share(exchanged > 0), "{:.0%}")]
            cells += [cell(median(1e3 * error), "{:.0f}"), cell(median(np.degrees(heading)), "{:.0f}")]
            print(f"| {course} | {name} |", " | ".join(cells), f"| {1 / seconds.mean():.0f} |", flush=True)
            lost = [f"{asked.split} {SPLITS[asked.split][1] + i}" for i in np.flatnonzero(error >= KEPT)]
            print(f"  lost: {', '.join(lost) or 'none'}", flush=True) if asked.strips else None


if __name__ == "__main__":
    main()
