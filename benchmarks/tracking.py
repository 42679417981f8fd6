"""Trackers of people whose capture no prior has seen: how well each follows them, from how many particles.

Run: motionenv bench tracking --mocap ../shared/mocap [--only arm] [--out FOLDER] [--episodes 20] [--processes 16]

Every person of a folder of straight walks (CMU's, in AMC) is left out in turn: functional model and trees are fitted to
the others alone. Pieces of the person's walks are seen by a camera that stands still, is known, and looks from the
side, 128 pixels wide, before clutter and with noise of 8 grey levels; the scene without the person is known too, and so
are, unless said otherwise, the first pose, the one before it and the body. Settings are the library's own,
but for how many pixels count as independent: 15 for annealed filters, 100 for arms.

A limb (upper arm, forearm, thigh, shank) is off by the distance of its far end from the truth, in lengths of the limb.
A track is kept if over the last ten frames limbs are off by less than half a length on average; "every limb" asks that
of each limb by itself. Absolute and relative (to the pelvis) errors are mean distances of the 15 joints, of the arm
those of elbow and wrist, of the mean over particles; coverage is the share of truths inside the joints' 90 % regions.
Intervals hold 95 %: Wilson's for shares of episodes, else a bootstrap over episodes. Frames per second are those of
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

from tracking_episode import TRACKERS, Task, play
from tracking_people import People, read_people
from tracking_tables import COLUMNS, head, line, row

PARTICLES = (100, 300, 1000, 3000, 10_000)
HIDDEN = (20, 30)  # frames without the person
LEARNED, GENERAL = "tree", "constant velocity"


@dataclass(frozen=True)
class Row:
    """A row of a table: what to call it, and its episodes."""

    name: str
    tasks: list[Task]


Make = Callable[[People, int], list[Row]]


def episodes(people: People, count: int, estimates: int, **options) -> list[Task]:
    """`count` episodes of so many estimates; the same ones for every tracker, by person and trial."""
    cuts = people.cuts(count, estimates + 1, seed=0)
    return [Task("fpca", 1000, cut, seed, **options) for seed, cut in enumerate(cuts)]


def compared(tasks: list[Task], trackers: list[tuple[str, int]]) -> list[Row]:
    """Trackers with so many particles in the same episodes."""
    return [Row(f"{name}, N = {n:,}", [replace(task, tracker=name, n=n) for task in tasks]) for name, n in trackers]


def arm(people: People, count: int) -> list[Row]:
    """An arm, 30 frames (paper C, fig. 6): swinging in walks of people left out, or reaching (made up)."""
    swings = episodes(people, count, 30, arm=True)
    reaches = [Task("tree", 300, cut, seed, arm=True) for seed, cut in enumerate(people.reaches(count, 31))]
    compare = [(LEARNED, 100), (LEARNED, 300), *((GENERAL, n) for n in (30, 100, 300, 1000, 3000))]
    seen = [replace(task, sees="depth") for task in swings]
    rows = [("swinging", swings), ("swinging, depth", seen), ("reaching", reaches)]
    return [replace(row, name=f"{name}, {row.name}") for name, tasks in rows for row in compared(tasks, compare)]


def body(people: People, count: int) -> list[Row]:
    """Somebody who walks, 30 frames (paper C, fig. 7)."""
    trackers = [(LEARNED, 300), ("fpca", 300), (GENERAL, 300), (GENERAL, 3000), (GENERAL, 10_000)]
    return compared(episodes(people, count, 30), trackers)


def occlusion(people: People, count: int) -> list[Row]:
    """60 frames, nobody to be seen in frames 20 to 29; or things in the way (paper A, fig. 11)."""
    hidden, behind = episodes(people, count, 60, hidden=HIDDEN), episodes(people, count, 60, occluders=3)
    trackers = [("fpca", 10_000), ("annealed", 1000)]
    rows = [("hidden for 10 frames", hidden), ("three things in the way", behind)]
    return [replace(row, name=f"{row.name}, {name}") for name, tasks in rows for row in compared(tasks, trackers)]


def accuracy(people: People, count: int) -> list[Row]:
    """100 frames, N = 1,000: every tracker, and the best one when less is known, or when it sees otherwise."""
    tasks = episodes(people, count, 100)
    rows = compared(tasks, [(name, 1000) for name in TRACKERS])
    other = [
        ("exact silhouettes", {"sees": "mask"}),
        ("body of average proportions, of the true height", {"body": "average"}),
        ("views from everywhere", {"camera": "random"}),
    ]
    for name, change in other:
        rows.append(Row(f"annealed, N = 1,000, {name}", [replace(t, tracker="annealed", **change) for t in tasks]))
    return rows


def start(people: People, count: int) -> list[Row]:
    """60 frames, nothing given: the track begins by itself, from the first ten pictures."""
    tasks = episodes(people, count, 60, start="automatic")
    return compared(tasks, [("fpca", 1000), ("annealed", 1000), ("fpca", 10_000)])


def trackers(people: People, count: int) -> list[Row]:
    """60 frames: every tracker with every number of particles."""
    return compared(episodes(people, count, 60), [(name, n) for name in TRACKERS for n in PARTICLES])


EXPERIMENTS: dict[str, Make] = {
    "arm": arm, "body": body, "occlusion": occlusion, "accuracy": accuracy, "start": start, "trackers": trackers,
}  # fmt: skip


def options() -> argparse.Namespace:
    """The command line's."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    beside = Path(__file__).parents[2] / "shared" / "mocap"
    default = Path(os.environ.get("MOTIONENV_MOCAP", beside))
    parser.add_argument("--mocap", type=Path, default=default, help="folder of AMC, or the one above cmu_asfamc")
    parser.add_argument("--out", type=Path, help="write all numbers, episode by episode, to this folder (JSON)")
    parser.add_argument("--episodes", type=int, default=20, help="of each row (20)")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), help="at a time (one per core)")
    parser.add_argument("--only", choices=EXPERIMENTS, action="append", help="this table; may be given again")
    parser.add_argument("--quick", action="store_true", help="three people and few particles: does the script run?")
    return parser.parse_args()


def main() -> None:
    """Print the tables."""
    asked = options()
    began = time.perf_counter()
    people = read_people(asked.mocap, 3 if asked.quick else None)
    numbers = {}
    # Processes are spawned: forked ones would share the state of threads that numba's kernels have started.
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
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
        (asked.out / "tracking.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
