"""How step length and stride time change with speed: 25 captured people beside drawn ones.

    motionenv bench models.speeds [--mocap FOLDER] [--model walk/fpca]

The people are those of santos25, whom no model has seen: markers from pelvis to shank of one leg, four straight walks
each, at the pace that they liked; their statures aren't told. Speed is that of the pelvis' marker over the middle
half of a walk, since people start and stop in it; stride time is that between extremes of the leg's angles. Drawn
people walk at the same speeds, one for each walk. Cells are medians, 10th and 90th percentiles. Slopes are of
logarithms on that of the speed, with the 95 % interval of 1,000 draws of people with replacement: who is faster by 1
% takes steps that are longer by the first slope in percent.
"""

import re
import warnings
from pathlib import Path

import numpy as np

import motionenv
from benchmarks import Arguments
from benchmarks.captured_walks import read_santos, stride_time
from motionenv.errors import ExtrapolationWarning
from motionenv.types import POSE

FPS, OURS = 100.0, 100.0
SECONDS = 8.0
LEG = [POSE.index(f"left_{joint}_flexion") for joint in ("hip", "knee")]
NAMES = ("speed [m/s]", "stride time [s]", "step length [m]", "walk ratio [m/(steps/min)]")


def row_of(speed: float, seconds: float) -> tuple[float, ...]:
    """`NAMES` of a walk."""
    return speed, seconds, 0.5 * speed * seconds, 0.5 * speed * seconds**2 / 120


def captured(mocap: Path) -> tuple[np.ndarray, list[str]]:
    """Rows (walks, 4) of `NAMES`, and the walks' people."""
    rows, people = [], []
    for walk in read_santos(mocap):
        person, trial = walk.name.split("_")
        name = next((mocap / "santos25" / person).glob(f"*_{trial}_ias_*"))
        pelvis = np.loadtxt(name, delimiter=",")[:, :2] / 1000
        quarter = len(pelvis) // 4
        way = pelvis[-quarter] - pelvis[quarter]
        speed = float(np.hypot(*way)) * FPS / (len(pelvis) - 2 * quarter)
        rows.append(row_of(speed, stride_time(walk.legs, FPS)))
        people.append(re.sub(r"\D", "", person))
    return np.array(rows), people


def drawn(name: str, speeds: np.ndarray) -> np.ndarray:
    """Rows (n, 4) of people drawn at `speeds` (n,) [m/s]."""
    model, rows = motionenv.load(name), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        for seed, speed in enumerate(speeds):
            poses = model.synthesize(SECONDS, OURS, seed=seed, speed=float(speed)).poses
            seconds = stride_time(list(poses[:, LEG].T), OURS)
            rows.append(row_of(poses[-1, 0] * OURS / (len(poses) - 1), seconds))
    return np.array(rows)


def slopes(rows: np.ndarray, people: list[str]) -> list[str]:
    """Slopes of log step length and of log stride time on log speed, with intervals by people."""
    rng, names = np.random.default_rng(0), np.array(people)
    who = np.unique(names)
    draws = [np.concatenate([np.flatnonzero(names == p) for p in rng.choice(who, len(who))]) for _ in range(1000)]
    fit = lambda which, column: np.polyfit(np.log(rows[which, 0]), np.log(rows[which, column]), 1)[0]
    told = []
    for column in (2, 1):
        low, high = np.percentile([fit(which, column) for which in draws], [2.5, 97.5])
        told.append(f"{fit(np.arange(len(rows)), column):.2f} ({low:.2f} to {high:.2f})")
    return told


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("santos25",))
    parser.add_argument("--model", default="walk/fpca", help="name of a walking model")
    asked = parser.parse_args()
    real, people = captured(asked.mocap)
    ours = drawn(asked.model, real[:, 0])
    print("| |", " | ".join(NAMES), "| slope of step length | slope of stride time |\n|-|-|-|-|-|-|-|")
    for label, rows in (("santos25", real), (f"{asked.model}, drawn", ours)):
        middle = [f"{np.median(c):.3g} ({np.quantile(c, 0.1):.3g}–{np.quantile(c, 0.9):.3g})" for c in rows.T]
        print(f"| {label} |", " | ".join([*middle, *slopes(rows, people)]), "|")


if __name__ == "__main__":
    main()
