"""Motion synthesised by the motion tree: stride time, dead ends, foot skate, velocity jumps and speed.

    motionenv bench tree.synthesis [--mocap FOLDER]

Motions of 60 s start from a walking or running window of the capture.

- stride: cycle length of the longest stretch at a walking or running pace (at least 0.5 or 1.2 m/s), relative to the
  mean cycle length of the source clips, weighted by their share. Median and 5th to 95th percentile.
- time at a walking or running pace: share of the time. The capture's clips of an activity also stand, turn and stop.
- dead ends: number of 100 seeds, 20 s each, with 3 s in which no marker leaves a sphere of 5 cm.
- skate: distance of the ball of a stance foot from its first position in the stance, by the labels of the drawn
  windows; and for "low feet", within half a centimetre of the ground for at least four frames, regardless of labels.
- velocity jumps: share of changes in velocity between frames (22 angles each) above the capture's 99.5th percentile for
  that angle, at changes of clip and overall. The capture has 0.5 %.
- steering, with `mixed/tree`: motions of which the mean heading over a second comes within 15° of the wanted one in
  20 s, after 10 s straight on; the time that this takes; and how far off the heading is on average in the last 5 s.
"""

import numpy as np

from benchmarks import shortest
from benchmarks.tree.capture import bounds, capture, options
from motionenv.body.kinematics import feet, markers
from motionenv.cycles import estimate_period
from motionenv.errors import MotionError
from motionenv.models import load
from motionenv.models.motion_tree.database import Database, build_database
from motionenv.models.motion_tree.features import FPS, WINDOW
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.motion_tree.synthesis.future_cost import BALL_HEIGHT
from motionenv.models.motion_tree.synthesis.generator import (
    MotionGenerator,
    Options,
    Target,
    future_cost_of,
)

LEGS = slice(17, 25)
PACE = {"walk": 0.5, "run": 1.2}  # [m/s]
LOW = BALL_HEIGHT + 0.003  # [body heights] greatest height of the ball of a foot on the ground
RANGE = (0.4, 1.9)  # range of cycle lengths [s]
TURN = 2 * np.pi
WAYS = {
    "default": {},
    "steered to the activity": {"target": True},
    "tree instead of exact": {"method": "tree"},
    "without blending": {"blend": 0.0},
    "without contact": {"contact": False},
    "without persistence": {"persistence": 0.0},
    "as in the paper: none of these, tree": {
        "method": "tree", "persistence": 0.0, "candidates": 1, "blend": 0.0, "future": False, "contact": False,
    },
}  # fmt: skip


def paced(poses: np.ndarray, pace: float) -> np.ndarray:
    """Whether the pelvis moves at `pace` [m/s] or faster, over 1/3 s around each of `poses` (frames, 25)."""
    moved = np.linalg.norm(poses[10:, :2] - poses[:-10, :2], axis=1) * FPS / 10
    return np.concatenate([[False] * 5, moved > pace, [False] * 5])


def spans(flags: np.ndarray) -> np.ndarray:
    """First and past-the-last index (n, 2) of each run of True in `flags` (frames,)."""
    return np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]]))).reshape(-1, 2)


def longest(poses: np.ndarray, pace: float) -> np.ndarray:
    """The longest stretch of poses (frames, 25) at `pace`."""
    found = spans(paced(poses, pace)) if len(poses) > 10 else np.empty((0, 2), int)
    first, last = found[np.diff(found)[:, 0].argmax()] if len(found) else (0, 0)
    return poses[first:last]


def cycle(poses: np.ndarray) -> float:
    """Cycle length [s] of the legs, or NaN without a period."""
    try:
        return estimate_period(poses[:, LEGS], FPS, range_seconds=RANGE).seconds if len(poses) > 30 else np.nan
    except MotionError:
        return np.nan


def grown(model: MotionTree, activity: str, frames: int, seed: int, ways: dict) -> tuple[np.ndarray, np.ndarray]:
    """Synthesised poses (frames, 25), and the database frame (frames,) of each."""
    ways = dict(ways)
    target = Target(activity=activity) if ways.pop("target", False) else None
    growth = MotionGenerator(model, activity, seed=seed, options=Options(**ways), target=target)
    poses, source = np.empty((frames, 25)), np.empty(frames, int)
    for i in range(frames):
        poses[i : i + 1] = growth.step(1)
        source[i] = model.frames_[growth.windows[0]] + 1
    return poses, source


def changes(poses: np.ndarray) -> np.ndarray:
    """Changes of each angle's velocity between frames (frames - 2, 22) [rad/s], modulo whole turns."""
    steps = np.diff(poses[:, 3:], axis=0)
    return np.abs(np.diff(steps - TURN * np.round(steps / TURN), axis=0)) * FPS


def usual_changes(database: Database) -> np.ndarray:
    """The 99.5th percentile (22,) of `changes` over the capture."""
    every = [changes(database.poses[a:b].astype(float)) for a, b in zip(*bounds(database), strict=True)]
    return np.percentile(np.concatenate(every), 99.5, axis=0)


def skates(balls: np.ndarray, stands: np.ndarray, least: int) -> list[float]:
    """Drift [m] of the balls of the feet (frames, 2, 3) in each stance of at least `least` frames."""
    runs = [(foot, a, b) for foot in (0, 1) for a, b in spans(stands[:, foot]) if b - a >= least]
    return [np.linalg.norm(balls[a:b, foot, :2] - balls[a, foot, :2], axis=1).max() for foot, a, b in runs]


def stuck(poses: np.ndarray, skeleton) -> bool:
    """Whether there are 3 s in which no marker moves further than 5 cm."""
    points, span = markers(poses, skeleton), round(3 * FPS)
    for first in range(0, len(points) - span, 10):
        if np.linalg.norm(points[first : first + span] - points[first], axis=-1).max() < 0.05:
            return True
    return False


def spread(drift: list[float]) -> str:
    """Median, 99th percentile and maximum of lengths [m], in centimetres; a dash without any."""
    return " / ".join(f"{100 * x:.1f}" for x in np.percentile(drift, [50, 99, 100])) if drift else "–"


def row(model: MotionTree, activity: str, ways: dict, seeds: int, length: float, usual, cycles) -> list[str]:
    """Cells of a row, of motions of so many seconds; `cycles` (sequences,) are the clips' cycle lengths [s]."""
    database, stands = model.database_, future_cost_of(model).stands
    ratios, along, drift, low, at_jumps, overall, changed = [], [], [], [], [], [], []
    for seed in range(seeds):
        poses, source = grown(model, activity, round(length * FPS), seed, ways)
        stretch = longest(poses, PACE[activity])
        ratios.append(cycle(stretch) / np.nanmean(cycles[database.sequence_of(source)]))
        along.append(paced(poses, PACE[activity]).mean())
        balls = feet(poses, database.skeleton)[1]
        drift += skates(balls, stands[source], 3)
        low += skates(balls, balls[..., 2] < LOW * database.skeleton.height, 4)
        above = changes(poses) > usual
        jumps = np.flatnonzero(np.diff(source) != 1) + 1  # the first frame of a clip; two velocity changes involve it
        inside = jumps[(jumps >= 2) & (jumps < len(poses) - 1)]
        at_jumps.append((above[inside - 2] | above[inside - 1]).ravel())
        overall.append(above.ravel())
        changed.append(len(jumps) / length)
    least, middle, most = np.nanpercentile(ratios, [5, 50, 95])
    return [
        f"{middle:.3f} ({least:.3f} to {most:.3f})",
        f"{np.mean(along):.0%}",
        spread(drift),
        spread(low),
        f"{np.mean(np.concatenate(at_jumps)):.2%}",
        f"{np.mean(np.concatenate(overall)):.2%}",
        f"{np.mean(changed):.1f}",
    ]


def captured(model: MotionTree, activity: str, usual: np.ndarray) -> list[str]:
    """The same cells for the captured clips."""
    database, outlook, every = model.database_, future_cost_of(model), []
    drift, low = [], []
    for i, (a, b) in enumerate(zip(*bounds(database), strict=True)):
        if database.activities[i] != activity:
            continue
        poses = database.poses[a:b].astype(float)
        poses[:, 2] += outlook.ground[outlook.place[a + WINDOW - 1], 0]
        balls = feet(poses, database.skeleton)[1]
        drift += skates(balls, outlook.stands[a:b], 3)
        low += skates(balls, balls[..., 2] < LOW * database.skeleton.height, 4)
        every.append((paced(poses, PACE[activity]), (changes(poses) > usual).ravel()))
    along, above = (np.concatenate(e) for e in zip(*every, strict=True))
    return ["1", f"{along.mean():.0%}", spread(drift), spread(low), "", f"{above.mean():.2%}", "0"]


def quality(model: MotionTree, seeds: int, length: float) -> None:
    """Print the quality of synthesised walking and running, with and without each extension of the paper."""
    database = model.database_
    usual = usual_changes(database)
    print("| | stride | time at a walking or running pace | skate, cm: median / 99 % / max | … of low feet", end="")
    print(f" | velocity jumps at changes | overall | changes/s |\n|{'-|' * 8}")
    for activity in PACE:
        cycles = np.full(len(database.clips), np.nan)
        for i, (a, b) in enumerate(zip(*bounds(database), strict=True)):
            if database.activities[i] == activity:
                cycles[i] = cycle(longest(database.poses[a:b].astype(float), PACE[activity]))
        print(f"| {activity}, the capture | {' | '.join(captured(model, activity, usual))} |", flush=True)
        for name, ways in WAYS.items():
            cells = row(model, activity, ways, seeds, length, usual, cycles)
            print(f"| {activity}, {name} | {' | '.join(cells)} |", flush=True)


def dead_ends(model: MotionTree, seeds: int, length: float) -> None:
    """Print the number of motions that get stuck."""
    print(f"\n| dead ends in {seeds} seeds | {' | '.join(PACE)} |\n|-|-|-|")
    for name, ways in (("default", {}), ("without avoiding dead ends", {"future": False})):
        counts = []
        for activity in PACE:
            motions = (model.generator(activity, seed=seed, **ways).motion(length) for seed in range(seeds))
            counts.append(sum(stuck(m.poses, m.skeleton) for m in motions))
        print(f"| {name} | {' | '.join(map(str, counts))} |", flush=True)


def speed(model: MotionTree, length: float) -> None:
    """Print frames per second of one motion, one thread."""
    print(f"\n| {length:g} s of walking, one motion, one thread | frames/s |\n|-|-|")
    for method in ("exact", "tree"):
        for name, ways in (("default", {}), ("no contact, no blending", {"contact": False, "blend": 0.0})):
            call = lambda m=method, w=ways: model.generator("walk", seed=0, method=m, **w).motion(length)
            call()
            print(f"| {method}, {name} | {length * FPS / shortest(call):,.0f} |", flush=True)


def steering(seeds: range) -> None:
    """Print how soon a wanted heading is reached from a straight walk."""
    print("\n| turn | reached | after, s: median / max | off in the last 5 s, °: median / max |\n|-|-|-|-|")
    for degrees in (90, -90, 180):
        after, last = [], []
        for seed in seeds:
            growth = load("mixed/tree").generator("walk", seed=seed, target=Target(heading=0.0, speed=1.2))
            growth.step(300)
            growth.target = Target(heading=np.radians(degrees), speed=1.2)
            away = np.degrees(growth.step(600)[:, 5]) - degrees
            off = np.convolve(np.abs((away + 180) % 360 - 180), np.full(30, 1 / 30), "valid")
            after += [np.argmax(off < 15) / FPS] if off.min() < 15 else []
            last.append(off[-150:].mean())
        soon = f"{np.median(after):.1f} / {np.max(after):.1f}" if after else "–"
        off = f"{np.median(last):.0f} / {np.max(last):.0f}"
        print(f"| {degrees}° | {len(after)} of {len(seeds)} | {soon} | {off} |", flush=True)


def main() -> None:
    """Print the tables."""
    asked = options(__doc__).parse_args()
    model = MotionTree().fit_database(build_database(capture(asked)))
    seeds, length = (1, 2.0) if asked.quick else (10, 60.0)
    quality(model, seeds, length)
    dead_ends(model, 10 * seeds, 4.0 if asked.quick else 20.0)
    speed(model, length)
    steering(range(100, 101 if asked.quick else 124))


if __name__ == "__main__":
    main()
