"""CPU time of the first commands after installation, and time of `import motionenv`.

The first run of a command compiles its kernels into an empty cache; the second one loads them. Goals for the first
demo, environment step and lift: 20, 10 and 10 s; for the import: under 0.03 s.

    motionenv bench startup [--imports]
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks import Arguments

IMPORTS = {"an empty script": "pass", "import numpy": "import numpy", "import motionenv": "import motionenv"}
STEP = """
import gymnasium, motionenv.envs
env = gymnasium.make("motionenv/WalkerTracking-v1")
env.reset(seed=0)
env.step(env.action_space.sample())
"""
POINTS = """
import numpy as np, motionenv
from motionenv.lifting import project_markers
from motionenv.mocap.keypoints.points2d import write_points
from motionenv.types import MARKERS, Markers
walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=7)
points = motionenv.markers(walk.poses, walk.skeleton)
write_points(project_markers(Markers(MARKERS, points, walk.fps), alpha=np.radians(40)), "points.csv")
"""
MOTIONENV = [sys.executable, "-m", "motionenv"]
COMMANDS = {
    "`motionenv demo`": [*MOTIONENV, "demo"],
    "one step of WalkerTracking": [sys.executable, "-c", STEP],
    "`motionenv lift`, unknown view": [*MOTIONENV, "lift", "points.csv", "--view", "unknown", "--out", "walk.npz"],
}


def cpu_and_wall(command: list[str], folder: Path, kernels: dict[str, str]) -> tuple[float, float]:
    """CPU and wall time of `command`, run in `folder` on one thread; `kernels` says where these are cached."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = os.environ | kernels | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.perf_counter() - start


def first_and_second_runs(quick: bool) -> None:
    """Print a row for each command, each with an empty cache of its own; if `quick`, with the usual one, and once."""
    print("| command | first run, CPU s | wall s | second run, CPU s | wall s |\n|-|-|-|-|-|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([sys.executable, "-c", POINTS], cwd=folder, check=True, capture_output=True)
        for number, (title, command) in enumerate(COMMANDS.items()):
            kernels = {} if quick else {"NUMBA_CACHE_DIR": str(folder / f"kernels-{number}")}
            cold = cpu_and_wall(command, folder, kernels)
            warm = cold if quick else cpu_and_wall(command, folder, kernels)
            print(f"| {title} | {cold[0]:.1f} | {cold[1]:.1f} | {warm[0]:.1f} | {warm[1]:.1f} |", flush=True)


def wall(statement: str) -> float:
    """Wall time of a fresh interpreter that runs `statement`."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], check=True)
    return time.perf_counter() - start


def imports(rounds: int) -> None:
    """Print the median time of each import, less that of an empty script. Statements take turns, so noise hits all."""
    times: dict[str, list[float]] = {name: [] for name in IMPORTS}
    for statement in IMPORTS.values():  # warm up bytecode and page cache
        wall(statement)
    for _ in range(rounds):
        for name, statement in IMPORTS.items():
            times[name].append(wall(statement))
    median = {name: statistics.median(values) for name, values in times.items()}
    empty = median.pop("an empty script")
    print(f"| above an empty script's {empty:.3f} s, median of {rounds} | s | relative to `import numpy` |\n|-|-|-|")
    for name, value in median.items():
        print(f"| `{name}` | {value - empty:.3f} | {(value - empty) / (median['import numpy'] - empty):.2f}× |")


def main() -> None:
    """Print both tables, or that of imports only."""
    parser = Arguments(__doc__)
    parser.add_argument("--imports", action="store_true", help="time only the imports")
    asked = parser.parse_args()
    imports(1 if asked.quick else 15)
    if not asked.imports:
        print()
        first_and_second_runs(asked.quick)


if __name__ == "__main__":
    main()
