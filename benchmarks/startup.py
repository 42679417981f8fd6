"""The first run of each task on an empty cache and the second one, and time of `import motionenv`.

The first run compiles kernels, in as many processes as there are cores; the second one loads them. Goals for the wall
time on two idle cores: 14, 9, 7 and 35 s for the first demo, environment step, lift and tracked film, 2.5 s for the
second demo, 0.4 s for `motionenv --help`, 0.03 s for the import. Run:

    motionenv bench startup [--tasks demo env]

After a change of kernels, `--record` writes again what each task compiles (`motionenv/_core/kernels.json`).
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

from benchmarks import Arguments

IMPORTS = {
    "an empty script": "pass", "import numpy": "import numpy", "import motionenv": "import motionenv",
    "motionenv --help": "from motionenv.cli import app; app(['--help'], standalone_mode=False)",
}  # fmt: skip
RECORD = Path(__file__).parents[1] / "motionenv" / "_core" / "kernels.json"

#: Makes the files that the tasks read.
PREPARE = """
import json, numpy as np, motionenv
from motionenv.lifting import project_markers
from motionenv.mocap.keypoints.points2d import write_points
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.render import render
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Markers
walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=7, speed=1.2)
motionenv.write(walk, "walk.npz")
points = motionenv.markers(walk.poses, walk.skeleton)
write_points(project_markers(Markers(MARKERS, points, walk.fps), alpha=np.radians(40)), "points.csv")
camera = fit_view(points, 0.3, width=320, height=240)
motionenv.write_video("film.mp4", (render(pose, walk.skeleton, camera).rgb for pose in walk.poses), walk.fps)
names = [name if name in MARKERS else "head" for name in KEYPOINT_SETS["coco-17"].keypoints]
pixels = camera.project(points)[0][:, [MARKERS.index(name) for name in names]].tolist()
told = [{"image_id": t, "keypoints": [v for x, y in seen for v in (x, y, 0.9)]} for t, seen in enumerate(pixels)]
open("film.json", "w").write(json.dumps(told))
"""


def _command(text: str) -> str:
    """The script of a command line."""
    return f"from motionenv.cli import app; app({text.split()!r}, standalone_mode=False)"


#: Scripts that are whole tasks, by the name under which `motionenv._core.precompilation` knows their kernels.
TASKS = {
    "demo": _command("demo"),
    "env": """
import gymnasium, motionenv.envs
env = gymnasium.make("motionenv/WalkerTracking-v1")
env.reset(seed=0)
env.step(env.action_space.sample())
""",
    "lift": _command("lift points.csv --out lifted.npz"),
    "film": _command("track --video film.mp4 --detections film.json --out track.mp4"),
    "render": _command("render walk.npz --out rendered.mp4"),
    "report": _command("report walk.npz --out report.html"),
    "synth": _command("synth walk/eigenwalkers --out synth.npz"),
    "sample": _command("sample --seconds 4 --out sampled.npz"),
    "page": "import motionenv; [motionenv.models.cycle(f'walk/{name}') for name in ('fpca', 'eigenwalkers')]",
}


def prepare(folder: Path) -> None:
    """Write the files that the tasks read to `folder`."""
    subprocess.run([sys.executable, "-c", PREPARE], cwd=folder, check=True, capture_output=True)


def empty_caches(folder: Path, task: str) -> dict[str, str]:
    """Environment variables by which a task has caches of its own below `folder`."""
    return {"NUMBA_CACHE_DIR": str(folder / f"kernels-{task}"), "MOTIONENV_CACHE": str(folder / f"models-{task}")}


def cpu_and_wall(task: str, folder: Path, caches: dict[str, str]) -> tuple[float, float]:
    """CPU time of all processes, and wall time, of a task that is run in `folder`; `caches` says where these are."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = os.environ | caches | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-c", TASKS[task]], cwd=folder, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def first_and_second_runs(tasks: Iterable[str], quick: bool) -> None:
    """Print a row for each task, each with an empty cache of its own, or if `quick` with the usual one."""
    print("| task | first run, wall s | CPU s | second run, wall s | CPU s |\n|-|-|-|-|-|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        for task in tasks:
            caches = {} if quick else empty_caches(folder, task)
            (cpu, wall), (cpu_2, wall_2) = (cpu_and_wall(task, folder, caches) for _ in range(2))
            print(f"| {task} | {wall:.1f} | {cpu:.1f} | {wall_2:.1f} | {cpu_2:.1f} |", flush=True)


def record_all() -> None:
    """Run each task on an empty cache, and write what it compiled to `RECORD`."""
    rows: dict[str, list] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        for task, script in TASKS.items():
            environment = os.environ | empty_caches(folder, task)
            environment |= {"PYTHONPATH": str(RECORD.parents[2])}
            command = [sys.executable, "-m", "benchmarks.recording", "made.json", script]
            subprocess.run(command, cwd=folder, env=environment, check=True)
            for kernel, types, seconds in json.loads((folder / "made.json").read_text()):
                rows.setdefault(f"{kernel}{types}", [kernel, types, seconds, []])[3].append(task)
    lines = [json.dumps(row) for _, row in sorted(rows.items())]
    RECORD.write_text("[\n" + ",\n".join(lines) + "\n]\n")


def wall(statement: str) -> float:
    """Wall time of a fresh interpreter that runs `statement`."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def imports(rounds: int) -> None:
    """Print the median time of each import in `rounds` processes, less that of an empty script.

    Statements take turns, so that noise hits all.
    """
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
    """Print both tables, or that of imports only; or record what the tasks compile."""
    parser = Arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=15, quick=1, help="processes that import")
    parser.add_argument("--imports", action="store_true", help="time only the imports")
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS), quick=["env"], help="time only these")
    parser.add_argument("--record", action="store_true", help="record the kernels of all tasks instead")
    asked = parser.parse_args()
    if asked.record:
        record_all()
        return
    imports(asked.rounds)
    if not asked.imports:
        print()
        first_and_second_runs(asked.tasks, asked.quick)


if __name__ == "__main__":
    main()
