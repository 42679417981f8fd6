"""How often `Lifted.plausible` is wrong: false alarms on people left out, and what it tells of motions that don't hold.

    motionenv bench lifting.misfit [--mocap FOLDER]

As in `lifting.raw`, one walk of each of 11 people is lifted with a prior of the ten others. A false alarm is a walk
whose misfit exceeds the limit. For each person the limit is chosen on the other ten, as
the 99 % quantile of their misfits over all pictures: nobody's own walk is in the limit that judges it, and none in its
prior. "Told" is whatever doesn't hold and is refused with an error, or isn't plausible by `MISFIT_LIMIT`. The last row
of the second table are acted walks of three other people, whose joint centres are placed differently.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.lifting import raw
from benchmarks.lifting.raw import CASES, VIEWS, Case, damaged, left_out, plain
from benchmarks.lifting.walks import options
from motionenv.errors import MotionError
from motionenv.lifting import MISFIT_LIMIT, lift, project_markers
from motionenv.mocap import read, to_markers
from motionenv.models.registry import load
from motionenv.types import MARKERS, Points

QUANTILE = 0.99
PIXELS = 300.0  # per metre
CLIPS = {
    "waving, bowing, raising hands, calling": ("wave-", "bow", "bye", "raise-", "call", "guide", "respond"),
    "punching, kicking, slashing, dancing": ("punch", "kick", "slash", "dance"),
    "running": ("run", "dash"),
    "walking backwards or sideways": ("walk-back", "walk-left", "walk-right"),
    "(acted walks straight ahead)": ("walk_",),
}


def misfit_of(points: Points, **told) -> float:
    """The misfit of lifted `points`; NaN if they are refused."""
    try:
        return lift(points, method="steady", **told).misfit
    except MotionError:
        return np.nan


def pixels(make: Callable) -> Callable:
    """Points of `make` in pixels, with an unknown scale."""

    def points(walk, alpha, rng) -> Points:
        metres = make(walk, alpha, rng)
        return Points(metres.positions * [PIXELS, -PIXELS] + [400, 300], metres.fps, "px")

    return points


def backwards(walk, alpha, rng) -> Points:
    """Played backwards in time."""
    return damaged(plain(walk, alpha, rng), lambda p: np.copyto(p, p[::-1].copy()))


def standing(walk, alpha, rng) -> Points:
    """The mean posture with 100 mm of noise."""
    return damaged(plain(walk, alpha, rng), lambda p: np.copyto(p, p.mean(axis=0) + 0.1 * rng.standard_normal(p.shape)))


def mislabelled(walk, alpha, rng) -> Points:
    """Elbows named wrists, and wrists elbows."""
    elbows, wrists = ([MARKERS.index(f"{side}_{n}") for side in ("left", "right")] for n in ("elbow", "wrist"))

    def change(p):
        p[:, elbows + wrists] = p[:, wrists + elbows]

    return damaged(plain(walk, alpha, rng), change)


HOLDING = (*CASES, Case("pixels, scale unknown", pixels(plain)), Case("the same with noise", pixels(raw.noisy)))
FAILING = (
    Case("walks played backwards", backwards),
    Case("100 mm of noise about the mean posture", standing),
    Case("elbows and wrists exchanged", mislabelled),
    Case("known view, 40° off", plain, lambda walk, alpha: {"alpha": alpha + np.radians(40)}),
)


def results(case: Case, walks, models, views) -> list[list[float]]:
    """Misfits (people, views) of one case."""
    rng = np.random.default_rng(0)
    return [
        [misfit_of(case.points(walk, a, rng), prior=model, **case.told(walk, a)) for a in views]
        for walk, model in zip(walks, models, strict=True)
    ]


def false_alarms(misfits: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Shares of false alarms per case, the limits (people,), and the limit chosen on everybody.

    Args:
        misfits: (cases, people, views) of walks that hold.
    """
    people = range(misfits.shape[1])
    limits = np.array([np.nanquantile(np.delete(misfits, p, axis=1), QUANTILE) for p in people])
    alarms = ~(misfits <= limits[:, None])
    return alarms.mean(axis=(1, 2)), limits, float(np.nanquantile(misfits, QUANTILE))


def clips(folder: Path, starts: tuple[str, ...], quick: bool) -> list[float]:
    """Misfits of the Bandai-Namco clips whose activity begins with one of `starts`."""
    found = sorted(p for p in folder.rglob("*.bvh") if p.stem.split("_", 1)[1].startswith(starts))
    prior = load("walk/prior")
    shortest = min(found, key=lambda path: path.stat().st_size)
    kept = [to_markers(read(path, unit="cm")) for path in ([shortest] if quick else found[::2])]
    return [misfit_of(project_markers(m, 0.5 + i, heading=0.0), prior=prior) for i, m in enumerate(kept)]


def main() -> None:
    """Print the tables."""
    args = options(__doc__, "cmu_asfamc", "bandai_namco").parse_args()
    views = VIEWS[:1] if args.quick else VIEWS[::4]
    walks, models = left_out(args.mocap, 2 if args.quick else None)
    table = np.array([results(case, walks, models, views) for case in HOLDING])
    shares, limits, everybody = false_alarms(table)
    print("| people left out | misfit, median | largest | false alarms |\n|-|-|-|-|")
    for case, rows, share in zip(HOLDING, table, shares, strict=True):
        print(f"| {case.name} | {np.median(rows):.2f} | {np.max(rows):.2f} | {share:.1%} |")
    print(f"| all {table.size} | | | {shares.mean():.1%} |")
    print(
        f"\nLimits chosen without each person {limits.min():.2f} to {limits.max():.2f}; on everybody {everybody:.2f}.\n"
    )
    print("| doesn't hold | pictures | refused | told | misfit, smallest |\n|-|-|-|-|-|", flush=True)
    for case in FAILING:
        print_told(case.name, np.ravel(results(case, walks, models, views)))
    for name, starts in CLIPS.items():
        print_told(name, np.array(clips(args.mocap / "bandai_namco", starts, args.quick)))


def print_told(name: str, misfits: np.ndarray) -> None:
    """Print a row of the second table."""
    refused, told = np.isnan(misfits).mean(), np.mean(~(misfits <= MISFIT_LIMIT))
    least = f"{np.nanmin(misfits):.2f}" if refused < 1 else ""
    print(f"| {name} | {len(misfits)} | {refused:.0%} | {told:.0%} | {least} |", flush=True)


if __name__ == "__main__":
    main()
