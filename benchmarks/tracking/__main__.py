"""Accuracy of trackers on people left out, by tracker and number of particles.

    motionenv bench tracking [--mocap FOLDER] [--only arm] [--out FOLDER] [--episodes 20] [--processes 16]

Each person in a folder of straight walks (CMU's, in AMC) is left out in turn: the functional model and the trees are
fitted to the others. A fixed camera from the side sees pieces of the person's walks, 128 pixels wide, with clutter and
noise of 8 grey levels. The camera and the empty scene are known and, unless stated otherwise, the first pose, the pose
before it and the body. Settings are the library's defaults, except for the number of pixels counted as independent: 15
for annealed filters, 100 for arms.

The error of a limb (upper arm, forearm, thigh, shank) is the distance of its far end from the truth, in limb lengths. A
track is "kept" if, over the last ten frames, the mean error of the limbs is below half a length; "every limb" requires
this of each limb. Absolute and relative (to the pelvis) errors are mean distances of the 15 joints (for the arm, of
elbow and wrist) of the mean over particles. Coverage is the share of truths inside the joints' 90 % regions. Intervals
are 95 % intervals: Wilson's for shares of episodes, otherwise a bootstrap over episodes. Frames per second are those of
the filter alone on one thread, while the other processes run.
"""

import argparse
import json
import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks import Arguments, headline, scratch
from benchmarks.tracking.episode import TRACKERS, Task, play
from benchmarks.tracking.people import People, read_people
from benchmarks.tracking.tables import COLUMNS, head, line, row

PARTICLES = (100, 300, 1000, 3000, 10_000)
HIDDEN = (20, 30)  # frames without the person
LEARNED, GENERAL = "tree", "constant velocity"


@dataclass(frozen=True)
class Row:
    """A row of a table: its name and its episodes."""

    name: str
    tasks: list[Task]


Make = Callable[[People, int], list[Row]]


def episodes(people: People, count: int, estimates: int, **options) -> list[Task]:
    """`count` episodes of `estimates` frames, the same for every tracker."""
    cuts = people.cuts(count, estimates + 1, seed=0)
    return [Task("fpca", 1000, cut, seed, **options) for seed, cut in enumerate(cuts)]


def compared(tasks: list[Task], trackers: list[tuple[str, int]]) -> list[Row]:
    """Rows of trackers with numbers of particles, on the same episodes."""
    return [Row(f"{name}, N = {n:,}", [replace(task, tracker=name, n=n) for task in tasks]) for name, n in trackers]


def arm(people: People, count: int) -> list[Row]:
    """An arm, 30 frames (paper C, fig. 6), swinging in walks of people left out, or reaching (synthetic)."""
    swings = episodes(people, count, 30, arm=True)
    reaches = [Task("tree", 300, cut, seed, arm=True) for seed, cut in enumerate(people.reaches(count, 31))]
    compare = [(LEARNED, 100), (LEARNED, 300), *((GENERAL, n) for n in (30, 100, 300, 1000, 3000))]
    seen = [replace(task, sees="depth") for task in swings]
    rows = [("swinging", swings), ("swinging, depth", seen), ("reaching", reaches)]
    return [replace(row, name=f"{name}, {row.name}") for name, tasks in rows for row in compared(tasks, compare)]


def body(people: People, count: int) -> list[Row]:
    """30 frames, full body (paper C, fig. 7)."""
    trackers = [(LEARNED, 300), ("fpca", 300), (GENERAL, 300), (GENERAL, 3000), (GENERAL, 10_000)]
    return compared(episodes(people, count, 30), trackers)


def occlusion(people: People, count: int) -> list[Row]:
    """60 frames, nobody in frames 20 to 29, or three occluders, also with rates that doubt (paper A, fig. 11)."""
    hidden, behind = episodes(people, count, 60, hidden=HIDDEN), episodes(people, count, 60, occluders=3)
    trackers, doubts = [("fpca", 10_000), ("annealed", 1000)], [replace(task, doubts=True) for task in behind]
    kinds = [("hidden for 10 frames", hidden, trackers), ("three occluders", behind, trackers),
             ("three occluders, doubting", doubts, [("fpca", 10_000), ("fpca", 1000)])]  # fmt: skip
    return [replace(row, name=f"{row.name}, {name}") for name, tasks, of in kinds for row in compared(tasks, of)]


def accuracy(people: People, count: int) -> list[Row]:
    """100 frames, N = 1,000: all trackers, and variants of the annealed one."""
    tasks = episodes(people, count, 100)
    rows = compared(tasks, [(name, 1000) for name in TRACKERS])
    other = [
        ("exact silhouettes", {"sees": "mask"}),
        ("average proportions, true height", {"body": "average"}),
        ("random views", {"camera": "random"}),
    ]
    for name, change in other:
        rows.append(Row(f"annealed, N = 1,000, {name}", [replace(t, tracker="annealed", **change) for t in tasks]))
    return rows


def start(people: People, count: int) -> list[Row]:
    """60 frames, given only the camera and the true body; the first pose is found from the first ten pictures."""
    tasks = episodes(people, count, 60, start="automatic")
    return compared(tasks, [("fpca", 1000), ("annealed", 1000), ("fpca", 10_000)])


def trackers(people: People, count: int) -> list[Row]:
    """60 frames, all trackers and numbers of particles."""
    return compared(episodes(people, count, 60), [(name, n) for name in TRACKERS for n in PARTICLES])


EXPERIMENTS: dict[str, Make] = {
    "arm": arm, "body": body, "occlusion": occlusion, "accuracy": accuracy, "start": start, "trackers": trackers,
}  # fmt: skip


def options() -> argparse.Namespace:
    """Parse the command line."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    parser.add_argument("--out", type=Path, quick=scratch(), help="folder for all numbers, episode by episode (JSON)")
    parser.add_argument("--episodes", type=int, default=20, quick=1, help="episodes per row (20)")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), help="number of processes (one per core)")
    parser.add_argument("--only", choices=EXPERIMENTS, action="append", help="run only this table; repeatable")
    return parser.parse_args()


def main() -> None:
    """Print the tables."""
    asked = options()
    began = time.perf_counter()
    people = read_people(asked.mocap, *(("06", 22) if asked.quick else ()))
    numbers = {}
    # Processes are spawned: forked ones would inherit the state of threads started by numba's kernels.
    with ProcessPoolExecutor(asked.processes, multiprocessing.get_context("spawn")) as pool:
        people.fit(pool)
        print(f"{len(people.walks)} walks read, and priors fitted without each of {len(people.names)} people, in "
              f"{time.perf_counter() - began:.0f} s; {asked.processes} processes.", flush=True)  # fmt: skip
        for name in asked.only or EXPERIMENTS:
            began = time.perf_counter()
            rows = EXPERIMENTS[name](people, asked.episodes)
            if asked.quick:
                rows = [Row(r.name, [replace(t, n=min(t.n, 100)) for t in r.tasks]) for r in rows]
            columns = (*COLUMNS, "after / before") if name == "occlusion" else COLUMNS
            print(f"\n### {name}: {EXPERIMENTS[name].__doc__}\n\n{head(columns)}", flush=True)
            played, found = pool.map(play, [task for r in rows for task in r.tasks]), []
            for r in rows:
                found.append(row(r.name, [next(played) for _ in r.tasks]))
                print(line(found[-1], columns), flush=True)
            print(f"\n{asked.episodes} episodes a row, {time.perf_counter() - began:.0f} s.", flush=True)
            numbers[name] = found
    if "trackers" in numbers:
        ours, peer = (next(r for r in numbers["trackers"] if r["name"] == f"{n}, N = 1,000") for n in ("fpca", GENERAL))
        headline(error=ours["absolute [mm]"][0], kept=100 * ours["kept"][0], peer_kept=100 * peer["kept"][0])
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
        (asked.out / "tracking.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
