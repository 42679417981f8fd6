"""Errors of smoothing compared with filtering on captured walks, and particle degeneracy at the first frame.

Example: motionenv bench tracking.smoothing --mocap ../shared/mocap

A known camera from the side sees exact silhouettes of 64 × 64 pixels of one walk of each of six CMU people, 30 frames
from its middle. The first pose, the pose before it and the body are given. Priors are fitted to all other people.
Errors are mean distances of the 15 joints, of the mean over particles (filtered) or over drawn motions (smoothed). The
last column counts the distinct particles of the first frame from which the drawn motions start. Intervals are 95 %
bootstrap intervals over the walks; "smoothed / filtered" compares the same walks.
"""

import argparse
import os
from pathlib import Path

import numpy as np

from benchmarks import MOCAP
from benchmarks.tracking.tables import mean, ratio
from motionenv.body import markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.motion_tree.features import resample
from motionenv.models.training import read_walks
from motionenv.models.walking.model import WalkingModel
from motionenv.render import Raycaster
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, MixturePrior, ParticleFilter, Start, VelocityPrior, smooth
from motionenv.tracking.priors.velocity import velocity_change
from motionenv.types import Motion

CMU_FPS, FPS = 120.0, 30.0
FRAMES, SIZE = 30, 64
PARTICLES = (1000, 10_000)
DRAWN = 200  # motions
PRIORS = ("FPCAPrior", "VelocityPrior", "MixturePrior")


def folds(mocap: Path, people: int):
    """Yield walks at `FPS`, each with the functional model and change of velocities of all other people.

    Args:
        mocap: folder of CMU's AMC files, or the one above cmu_asfamc.
        people: number of people to leave out, one walk each.
    """
    inside = mocap / "cmu_asfamc"
    found = read_walks(inside if inside.is_dir() else mocap, fps=CMU_FPS)
    motions, subjects = list(found.motions), list(found.subjects)
    for name in list(dict.fromkeys(subjects))[:people]:
        others = [i for i, subject in enumerate(subjects) if subject != name]
        walks = [motions[i] for i in others]
        learned = WalkingModel().fit(walks, [subjects[i] for i in others])
        slow = [Motion(resample(walk, FPS)[0], walk.skeleton, FPS) for walk in walks]
        walk = motions[subjects.index(name)]
        yield Motion(resample(walk, FPS)[0], walk.skeleton, FPS), learned, velocity_change(slow)[0]


def prior(name: str, skeleton, learned: WalkingModel, change: np.ndarray):
    """The prior `name` for a body, from a functional model and changes of velocity (25,)."""
    if name == "FPCAPrior":
        return FPCAPrior(learned, skeleton=skeleton)
    general = VelocityPrior(skeleton=skeleton, change=change)
    return general if name == "VelocityPrior" else MixturePrior(FPCAPrior(learned, skeleton=skeleton), general)


def play(walk: Motion, made, n: int) -> tuple[float, float, int]:
    """Errors [mm] before and after smoothing with `n` particles, and the number of distinct first-frame particles."""
    first = (len(walk.poses) - FRAMES) // 2
    poses = walk.poses[first - 1 : first + FRAMES].copy()
    poses[:, :2] -= poses[:, :2].mean(axis=0)
    camera = view(0.0, width=SIZE, height=SIZE)
    masks = Raycaster().render(poses[1:], walk.skeleton, camera, rgb=False).limbs > 0
    tracker = ParticleFilter(made, SilhouetteLikelihood(camera, walk.skeleton, threads=1), n, seed=0)
    tracker.start(Start.at(poses[1], poses[0]))
    beliefs = [tracker.step(mask=mask) for mask in masks]
    motions = smooth(beliefs, made, DRAWN, seed=0)
    true = markers(poses[1:], walk.skeleton)
    filtered = np.stack([belief.expected_joints(walk.skeleton) for belief in beliefs])
    smoothed = markers(motions, walk.skeleton).mean(axis=0)
    before, after = (1000 * np.linalg.norm(joints - true, axis=-1).mean() for joints in (filtered, smoothed))
    return before, after, len(np.unique(motions[:, 0], axis=0))


def cell(values: np.ndarray, form: str = "{:.0f}") -> str:
    """A mean with its interval."""
    value, low, high = map(form.format, mean(values))
    return f"{value} ({low}–{high})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = Path(os.environ.get("MOTIONENV_MOCAP", MOCAP))
    parser.add_argument("--mocap", type=Path, default=default, help="folder of AMC, or the one above cmu_asfamc")
    parser.add_argument("--people", type=int, default=6, help="number of people, one walk each (6)")
    parser.add_argument("--quick", action="store_true", help="few particles: does the script run?")
    asked = parser.parse_args()
    walks = list(folds(asked.mocap, asked.people))
    print(
        "| prior | N | filtered [mm] | smoothed [mm] | smoothed / filtered | distinct particles of the first frame |\n"
        "|-|-|-|-|-|-|"
    )
    for name in PRIORS:
        for n in (50, 100) if asked.quick else PARTICLES:
            played = [play(walk, prior(name, walk.skeleton, *fitted), n) for walk, *fitted in walks]
            before, after, left = np.array(played).T
            change = "{:.2f} ({:.2f}–{:.2f})".format(*ratio(after, before))
            print(f"| {name} | {n:,} | {cell(before)} | {cell(after)} | {change} | {cell(left)} |", flush=True)


if __name__ == "__main__":
    main()
