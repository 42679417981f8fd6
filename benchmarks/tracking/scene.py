"""Heights of people and cameras estimated from half a second of silhouettes, and what a wrong height costs a tracker.

    motionenv bench tracking.scene [--people 12] [--split eval] [--tracked 300] [--only person]

A person of 1.9 m walks for a second (30 frames/s, masks of 128², a level camera at the side, oblique or in front, the
whole walk in view). `ParticleFilter` with `FPCAPrior` and --tracked particles is given the first pose, with the pelvis
as high as its body has it. The body has average proportions (`from_height`) and

- sized: 1.75 m on average, each particle's own (`FPCAPrior(size=0.06)`),
- declared: 1.75 m,
- estimated: the mean height by `estimate_scene` from the first 15 frames, N = 1,000, with a prior of 1.72 m ± 7 %,
- told: 1.9 m.

In the second table the camera is said to stand 0.2 m lower than it does; both heights are estimated (the camera's with
a prior of ± 15 % about what is said). Errors are means over joints and frames; intervals are 95 %, over people. Split
"train", on which frames, particles and steps were chosen, has walkers of walk/fpca with seeds from 0; "eval" has
eigenwalkers with seeds from 5,000.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks import Arguments
from benchmarks.tracking.heights import Scene, Unknown, estimate_scene, walker_filters
from benchmarks.tracking.tables import cell, mean, share
from motionenv import synthesize
from motionenv.body import from_height, markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render import Raycaster
from motionenv.render.cameras import fit_view
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.tracking.priors.base import SPREAD
from motionenv.types import Camera, Motion

FPS, FRAMES, SIZE, TALL, DECLARED = 30.0, 30, 128, 1.9, 1.75
ANGLES = (0.0, 0.7, 1.5)  # [rad]
CLIP, PARTICLES = 15, 1000
LOWER, UPRIGHT = 0.2, 0.1  # [m] how much lower the camera is said to be; deviation of an unknown pelvis height
HEIGHT = Unknown(1.72, 0.07, 1.2, 2.2)
SPLITS = {"train": ("walk/fpca", 0), "eval": ("walk/eigenwalkers", 5000)}


def walked(split: str, number: int) -> tuple[Motion, Camera, np.ndarray]:
    """A person, the camera, and silhouettes (frames, height, width)."""
    model, first = SPLITS[split]
    walk = synthesize(model, seconds=FRAMES / FPS, fps=FPS, seed=first + number, height=TALL)
    poses = walk.poses.copy()
    poses[:, :2] -= poses[len(poses) // 2, :2]
    camera = fit_view(markers(poses, walk.skeleton), ANGLES[number % len(ANGLES)], width=SIZE, height=SIZE)
    masks = Raycaster(threads=1).render(poses, walk.skeleton, camera, rgb=False).limbs > 0
    return Motion(poses, walk.skeleton, FPS), camera, masks


def given(walk: Motion, height: float, upright: float) -> Start:
    """The first pose, with the pelvis as high as of somebody of a height [m], give or take `upright` [m]."""
    pose, spread = walk.poses[0].copy(), SPREAD.copy()
    pose[2] *= height / TALL
    spread[2] = upright
    return Start.at(pose, spread=spread)


def error(tracker: ParticleFilter, walk: Motion, masks: np.ndarray) -> float:
    """Mean error [mm] of a started filter's joints."""
    true = markers(walk.poses, walk.skeleton)
    found = [tracker.step(mask=mask).expected_joints(tracker.prior.skeleton) for mask in masks]
    return 1e3 * float(np.linalg.norm(np.array(found) - true, axis=-1).mean())


def sized(camera: Camera, start: Start, n: int, seed: int) -> ParticleFilter:
    """A filter whose particles have sizes of their own."""
    body = from_height(DECLARED)
    tracker = ParticleFilter(
        FPCAPrior(skeleton=body, size=0.06), SilhouetteLikelihood(camera, body, threads=1), n, seed=seed
    )
    tracker.start(start)
    return tracker


def estimated(camera: Camera, start: Start, masks: np.ndarray, steps: int, seed: int, **unknown: Unknown) -> Scene:
    """Heights by their prior and a clip's first frames."""
    clip = [{"mask": mask} for mask in masks[:CLIP]]
    build = walker_filters(camera, start, n=PARTICLES, fps=FPS)
    return estimate_scene(build, clip, unknown, steps=steps, warm_up=steps // 2, seed=seed)


def interval(samples: np.ndarray, true: float) -> bool:
    """Whether the central 90 % of the samples hold the true value."""
    low, high = np.quantile(samples, [0.05, 0.95])
    return bool(low <= true <= high)


def compared(
    asked: argparse.Namespace, people: list, lower: float, unknown: Callable[[float], dict[str, Unknown]]
) -> None:
    """Print a table of a camera that is said to be `lower` [m] than it is."""
    errors, scenes, truths = [], [], []
    for number, walk, camera, masks in people:
        said = replace(camera, t=camera.t + camera.R[:, 2] * lower)
        start = given(walk, HEIGHT.median, UPRIGHT)
        scene = estimated(said, start, masks, asked.steps, number, **unknown(said.centre[2]))
        true = {"height": TALL, "camera_height": float(camera.centre[2])}
        told = {name: true[name] for name in scene.samples}
        trackers = [sized(said, given(walk, DECLARED, UPRIGHT), asked.tracked, number)]
        for heights in ({"height": DECLARED}, scene.mean, told):
            build = walker_filters(said, given(walk, heights["height"], SPREAD[2]), n=asked.tracked, fps=FPS)
            trackers.append(build(np.random.default_rng(number), **heights))
        errors.append([error(tracker, walk, masks) for tracker in trackers])
        scenes.append(scene)
        truths.append(told)
    print(
        "| sized | declared | estimated | told |",
        *(f"{name} off by | inside 90 % |" for name in told),
        "accepted |",
    )
    print("|-|-|-|-|" + "-|-|" * len(told) + "-|")
    cells = [cell(mean(column), "{:.0f}") for column in np.transpose(errors)]
    for name in told:
        off = [1e3 * abs(scene.mean[name] - true[name]) for scene, true in zip(scenes, truths, strict=True)]
        inside = [interval(scene.samples[name], true[name]) for scene, true in zip(scenes, truths, strict=True)]
        cells += [cell(mean(off), "{:.0f}") + " mm", cell(share(np.array(inside)), "{:.0%}")]
    print("|", " | ".join(cells), f"| {np.mean([scene.accepted for scene in scenes]):.0%} |", flush=True)


def main() -> None:
    """Print both tables."""
    parser = Arguments(__doc__)
    parser.add_argument("--people", type=int, default=12, quick=1)
    parser.add_argument("--split", choices=SPLITS, default="eval")
    parser.add_argument("--steps", type=int, default=120, quick=4, help="of the chains, after half as many")
    parser.add_argument("--tracked", type=int, default=300, quick=20, help="particles of the trackers")
    parser.add_argument(
        "--only", choices=("person", "both"), help="the table of the person's height, or of both heights"
    )
    asked = parser.parse_args()
    people = [(number, *walked(asked.split, number)) for number in range(asked.people)]

    if asked.only in (None, "person"):
        compared(asked, people, 0.0, lambda height: {"height": HEIGHT})
    if asked.only in (None, "both"):
        compared(asked, people, LOWER, lambda height: {"height": HEIGHT, "camera_height": Unknown(height, 0.15)})


if __name__ == "__main__":
    main()
