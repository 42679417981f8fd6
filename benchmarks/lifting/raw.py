"""Lift raw 2D points to 3D, as `motionenv lift` does, for left-out people and various pictures and corruptions.

    motionenv bench lifting.raw [--mocap FOLDER] [--out FOLDER]

One walk of each of 11 CMU people is lifted with a prior of the ten others. Captured frames at 30 per second, without
starts and stops, are projected from twelve directions; each row is one kind of picture or corruption. The joints of
every frame are compared with the captured ones after aligning the pelvis, so errors include what the Fourier series
can't represent. "Inside band" is the share of joint coordinates inside their 90 % bands.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.captured_walks import cmu_markers
from benchmarks.lifting.walks import CURVED, cmu_folds, options, our_models
from motionenv.lifting import Lifted, lift, project_markers
from motionenv.lifting.view_geometry import turned_to_x
from motionenv.metrics import pelvis_mpjpe
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS, Markers, Points

FPS = 30.0
VIEWS = np.radians(np.arange(-180, 180, 30) + 7)
PELVIS = MARKERS.index("pelvis")
TILTED = np.radians(15)


@dataclass(frozen=True)
class Case:
    """A kind of picture: the function that makes points from a walk and a view, and the arguments of `lift`."""

    name: str
    points: Callable[[Markers, float, np.random.Generator], Points]
    told: Callable[[Markers, float], dict] = lambda walk, alpha: {}


def plain(walk: Markers, alpha: float, rng) -> Points:
    """Points without perspective or corruption, in metres."""
    return project_markers(walk, alpha, heading=0.0)


def damaged(points: Points, change: Callable[[np.ndarray], None]) -> Points:
    """The points after applying `change` to their positions."""
    positions = points.positions.copy()
    change(positions)
    return Points(positions, points.fps, points.unit, points.truth)


def noisy(walk, alpha, rng) -> Points:
    """Noise of 20 mm on every coordinate."""
    return damaged(plain(walk, alpha, rng), lambda p: np.add(p, 0.02 * rng.standard_normal(p.shape), out=p))


def gappy(walk, alpha, rng) -> Points:
    """30 % of all points missing."""
    return damaged(
        plain(walk, alpha, rng), lambda p: np.putmask(p, np.repeat(rng.random(p.shape[:2]) < 0.3, 2), np.nan)
    )


def lacking(walk, alpha, rng) -> Points:
    """Five of 15 markers never seen."""
    return damaged(plain(walk, alpha, rng), lambda p: p.__setitem__((slice(None), rng.choice(15, 5, False)), np.nan))


def wild(walk, alpha, rng) -> Points:
    """5 % of all points displaced by half a metre."""

    def change(p):
        some = rng.random(p.shape[:2]) < 0.05
        p[some] += 0.5 * rng.standard_normal((some.sum(), 2))

    return damaged(plain(walk, alpha, rng), change)


def tilted(walk, alpha, rng) -> Points:
    """From 15° above, without perspective, in metres."""
    return project_markers(walk, alpha, elevation=TILTED, heading=0.0)


CASES = (
    Case("unchanged, view known", plain, lambda walk, alpha: {"alpha": alpha}),
    Case("unchanged", plain),
    Case("20 mm noise", noisy),
    Case("30 % of points missing", gappy),
    Case("5 markers missing throughout", lacking),
    Case("5 % outliers", wild),
    Case("elevation 15°, unknown", tilted, lambda walk, alpha: {"elevation": None}),
)


def steady_walk(markers: Markers) -> Markers:
    """The steady stretch of a walk, along x, at 30 frames per second."""
    cut = steady_stretch(markers)
    step = round(markers.fps / FPS)
    positions = markers.positions[cut][::step]
    return turned_to_x(Markers(MARKERS, positions, markers.fps / step, name=markers.name))


def figures(lifted: Lifted, alpha: float) -> dict:
    """Errors of one lifted sequence."""
    found, truth = lifted.posterior, lifted.points.truth.positions
    off = (found.alpha - alpha + np.pi) % (2 * np.pi) - np.pi
    about = lambda positions: positions - positions[:, [PELVIS]]
    inside = np.abs(about(found.positions) - about(truth)) < lifted.band
    return {
        "degrees": abs(float(np.degrees(off))),
        "standard": float(off / found.standard_deviation("alpha")),
        "joint_mm": 1e3 * float(pelvis_mpjpe(found.positions, truth).mean()),
        "in_band": float(np.delete(inside, PELVIS, axis=1).mean()),
    }


def row(case: Case, walks, models, views) -> dict:
    """Means over people and views of one case."""
    rng = np.random.default_rng(0)
    each = []
    for walk, model in zip(walks, models, strict=True):
        for alpha in views:
            lifted = lift(case.points(walk, alpha, rng), prior=model, method="steady", **case.told(walk, alpha))
            each.append(figures(lifted, alpha))
    columns = {key: np.array([one[key] for one in each]) for key in each[0]}
    return {
        "case": case.name,
        "mean_degrees": float(columns["degrees"].mean()),
        "greatest_degrees": float(columns["degrees"].max()),
        "view_in_band": float((np.abs(columns["standard"]) < 1.645).mean()),
        "joint_mm": float(columns["joint_mm"].mean()),
        "in_band": float(columns["in_band"].mean()),
    }


def left_out(mocap: Path, most: int | None = None) -> tuple[list[Markers], list[WalkerPrior]]:
    """The longest walk of each person (of `most` at most), without starts and stops, and priors of all others."""
    folds = cmu_folds(mocap)[:most]
    captured = {m.name: m for m in cmu_markers(mocap)[0] if m.name != CURVED}
    return [steady_walk(captured[max(fold.test, key=lambda w: w.strides).name]) for fold in folds], our_models(folds)


def main() -> None:
    """Print the table."""
    args = options(__doc__, "cmu_asfamc").parse_args()
    views = VIEWS[:1] if args.quick else VIEWS
    walks, models = left_out(args.mocap, 1 if args.quick else None)
    head = "| picture | view, mean error [°] | largest | inside its 90 % band | joints [mm] | inside band "
    print(f"{head}|\n|-|-|-|-|-|-|")
    rows = []
    for case in CASES:
        r = row(case, walks, models, views)
        rows.append(r)
        known = "alpha" in case.told(walks[0], 0.0)
        view = "| | " if known else f"{r['mean_degrees']:.1f} | {r['greatest_degrees']:.1f} | {r['view_in_band']:.0%}"
        print(f"| {r['case']} | {view} | {r['joint_mm']:.1f} | {r['in_band']:.1%} |", flush=True)
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        (args.out / "lifting_raw.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
