"""CPU time of this checkout relative to another one, in alternating runs: does a change make something slower?

    git worktree add --detach ../before HEAD~20
    motionenv bench versions ../before [--rounds 3]

Each round runs every call below in a fresh process of each checkout, first once to compile and then some times. The
table shows the best time of all rounds. Both checkouts need the functions that are called here.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

PARTICLES = 3000


def calls() -> dict[str, Callable[[], object]]:
    """What is timed, by name."""
    import gymnasium

    import motionenv
    import motionenv.envs
    from motionenv.body import limb_segments
    from motionenv.envs.agents import TrackingAgent, evaluate, truth_start
    from motionenv.lifting import project_markers
    from motionenv.render import render
    from motionenv.render.cameras import view
    from motionenv.types import MARKERS, Markers

    walk = motionenv.synthesize("walk/fpca", 4, 30, seed=1)
    points = Markers(MARKERS, motionenv.markers(walk.poses, walk.skeleton), walk.fps)
    seen = project_markers(points, alpha=np.radians(40))
    cameras = {size: view(0.3, width=size, height=size) for size in (64, 256)}
    poses = np.repeat(walk.poses, 4, axis=0)
    native = {"num_envs": 64, "vectorization_mode": "vector_entry_point"}
    envs = gymnasium.make_vec("motionenv/WalkerTracking-v1", **native)
    envs.reset(seed=0)
    action = envs.action_space.sample()
    env = gymnasium.make("motionenv/WalkerTracking-v1", observation="mask", horizon=30)
    agent = TrackingAgent(env, n=PARTICLES, start=truth_start, seed=1)
    tree = motionenv.load("mixed/tree")
    starts = np.random.default_rng(0).integers(0, len(tree.database_.poses) - 12, 500)
    histories = np.stack([tree.database_.poses[i : i + 12] for i in starts])
    return {
        "480 pictures, 64×64": lambda: render(poses, walk.skeleton, cameras[64]),
        "30 pictures, 256×256": lambda: render(walk.poses[:30], walk.skeleton, cameras[256]),
        "60 walks": lambda: [motionenv.synthesize("walk/fpca", 4, 30, seed=i) for i in range(60)],
        "60 walks of a given speed": lambda: [
            motionenv.synthesize("walk/fpca", 4, 30, seed=i, speed=1.4) for i in range(60)
        ],
        "40 steps of 64 environments": lambda: [envs.step(action) for _ in range(40)],
        "lift": lambda: motionenv.lift(seen),
        f"track 30 frames, {PARTICLES} particles": lambda: evaluate(env, agent, 1, seed=7),
        "5,000 draws of the tree": lambda: tree.sample(histories, 10, seed=1, method="tree"),
        "5,000 exact draws": lambda: tree.sample(histories, 10, seed=1, method="exact"),
        "10 s of the tree": lambda: motionenv.synthesize(tree, 10, 30, seed=1),
        "limb_segments of 480 poses": lambda: limb_segments(poses, walk.skeleton),
    }


def timed(repeats: int) -> dict[str, float]:
    """The least CPU time of each call, after one that compiles."""
    found = {}
    for name, call in calls().items():
        call()
        times = []
        for _ in range(repeats):
            start = time.process_time()
            call()
            times.append(time.process_time() - start)
        found[name] = min(times)
    return found


def measured(checkout: Path, repeats: int) -> dict[str, float]:
    """`timed` in a fresh process that imports `checkout`."""
    environment = os.environ | {"PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-P", __file__, str(repeats)]  # -P: this folder has modules with names of others
    done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print a row for each call."""
    from benchmarks import ROOT, Arguments  # not above: the other checkout's may lack them

    parser = Arguments(__doc__)
    told = "folder of the other checkout; without it, this one: how noisy is it?"
    parser.add_argument("other", type=Path, nargs="?", default=ROOT, help=told)
    parser.add_argument("--rounds", type=int, default=3, quick=1, help="alternating runs of both")
    asked = parser.parse_args()
    checkouts = {"other": asked.other.resolve(), "this": ROOT}
    best: dict[str, dict[str, float]] = {name: {} for name in checkouts}
    for _ in range(asked.rounds):
        for name, checkout in checkouts.items():
            for call, value in measured(checkout, 1 if asked.quick else 7).items():
                best[name][call] = min(value, best[name].get(call, value))
    print("| CPU time, ms | other | this | ratio |\n|-|-|-|-|")
    for call, value in best["this"].items():
        before = best["other"][call]
        print(f"| {call} | {1e3 * before:.2f} | {1e3 * value:.2f} | {value / before:.2f}× |")


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1].isdigit():
        print(json.dumps(timed(int(sys.argv[1]))))
    else:
        main()
