"""What a whole film tells about its frames: smoothed tracks beside filtered ones, on people left out.

    motionenv bench tracking.smoothing [--episodes 20] [--particles 1000]

CMU's walkers as in `benchmarks.tracking`, 60 frames, first pose and body given, tracked by an `FPCAPrior` fitted to the
other people, and then smoothed to 200 trajectories (`ParticleFilter.smoothed`). Rows: the person in full view, without
the person in frames 20 to 29, and behind three occluders (there with misses 0.49 and false alarms 0.02, the rates of
`TrackingAgent` for people behind things). Errors are mean distances of the 15 joints; in brackets behind ratios are
95 % intervals over episodes. "Steady" is what of the filter's error is alike in all frames, the norm of each joint's
mean error, and "varying" compares what remains of both without it. Bands are shares of truths in central 90 % bands: of
the distance from the camera, and of the coordinates of the joints.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks import Arguments, headline
from benchmarks.tracking.episode import TRACKERS, Task, first, rates, seen
from benchmarks.tracking.people import read_people
from benchmarks.tracking.tables import cell, ratio
from motionenv.body import markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.tracking import ParticleFilter
from motionenv.tracking.priors.base import systematic

FRAMES, DRAWN = 60, 200
ROWS = {
    "in full view": {},
    "hidden for 10 frames": {"hidden": (20, 30)},
    "three occluders": {"occluders": 3, "doubts": True},
}

HEAD = (
    "| person | filtered [mm] | smoothed [mm] | smoothed / filtered | steady [mm] | varying: smoothed / filtered | "
    "distance in its band: filtered, smoothed | coordinates: filtered, smoothed |\n|-|-|-|-|-|-|-|-|"
)


def play(task: Task) -> np.ndarray:
    """Filtered and smoothed (2, 5): `_measured`."""
    episode = seen(task)
    body, camera = episode.truths[0]["skeleton"], episode.truths[0]["camera"]
    likelihood = SilhouetteLikelihood(camera, body, threads=1, **rates(task))
    tracker = ParticleFilter(TRACKERS["fpca"].prior(task, body), likelihood, task.n, keep=True, seed=task.seed)
    tracker.start(first(task, episode, likelihood))
    filtered = [tracker.step(**observation) for observation in episode.observations]
    rng = np.random.default_rng(task.seed)
    drawn = [b.poses[systematic(np.exp(b.log_weights), DRAWN, rng)] for b in filtered]
    smoothed = [b.poses for b in tracker.smoothed(DRAWN)]
    true = np.array([truth["joints"] for truth in episode.truths])
    roots = np.array([truth["pose"][:2] for truth in episode.truths])
    return np.array([_measured(np.array(poses), body, camera.centre[:2], true, roots) for poses in (drawn, smoothed)])


def _measured(poses: np.ndarray, body, centre: np.ndarray, true: np.ndarray, roots: np.ndarray) -> list[float]:
    """Error, its steady and its varying part [m], and shares of distances and of coordinates in their bands (5,)."""
    joints = markers(poses, body)  # (frames, draws, 15, 3)
    off = joints.mean(axis=1) - true
    steady = off.mean(axis=0)
    errors = [np.linalg.norm(some, axis=-1).mean() for some in (off, steady, off - steady)]
    far = np.linalg.norm(poses[..., :2] - centre, axis=-1)
    bands = [_held(far, np.linalg.norm(roots - centre, axis=-1)), _held(joints, true)]
    return [*map(float, errors), *bands]


def _held(drawn: np.ndarray, true: np.ndarray) -> float:
    low, high = np.quantile(drawn, [0.05, 0.95], axis=1)
    return float(((low <= true) & (true <= high)).mean())


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    parser.add_argument("--episodes", type=int, default=20, quick=1)
    parser.add_argument("--particles", type=int, default=1000, quick=100)
    parser.add_argument("--processes", type=int, default=1)
    asked = parser.parse_args()
    people = read_people(asked.mocap, *(("06", 22) if asked.quick else ()))
    with ProcessPoolExecutor(asked.processes, multiprocessing.get_context("spawn")) as pool:
        people.fit(pool)
        print(HEAD, flush=True)
        ratios = []
        for name, options in ROWS.items():
            cuts = people.cuts(asked.episodes, FRAMES + 1, seed=0)
            tasks = [Task("fpca", asked.particles, cut, seed, **options) for seed, cut in enumerate(cuts)]
            found = np.array(list(pool.map(play, tasks)))  # (episodes, 2, 5)
            (before, steady, _, depth, joints), (after, _, _, depths, all_joints) = found.mean(axis=0)
            less, varying = (ratio(found[:, 1, i], found[:, 0, i]) for i in (0, 2))
            ratios.append(less[0])
            cells = [f"{1e3 * before:.0f}", f"{1e3 * after:.0f}", cell(less, "{:.2f}"), f"{1e3 * steady:.0f}"]
            cells += [cell(varying, "{:.2f}"), f"{depth:.0%}, {depths:.0%}", f"{joints:.0%}, {all_joints:.0%}"]
            print(f"| {name} |", " | ".join(cells), "|", flush=True)
    headline(full_view=ratios[0], behind=ratios[2])


if __name__ == "__main__":
    main()
