"""Lift raw 2D points in metres to 3D, as `motionenv lift` does, for various pictures and corruptions.

    motionenv bench lifting.raw [--mocap FOLDER] [--out FOLDER]

One walk of each of 11 CMU people. Captured frames at 30 per second, without starts and stops, are projected from four
directions; each row is one kind of picture or corruption. The joints of every frame are compared with the captured ones
after aligning the pelvis. "Inside band" is the share of joint coordinates inside their 90 % bands, "way" the length of
the way relative to the true one. The shipped network has seen these people: people of Bandai-Namco's, whose acted walks
it hasn't seen, are the last row.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.captured_walks import cmu_markers
from benchmarks.free_walking import bandai
from benchmarks.lifting.walks import CURVED, cmu_folds, options
from motionenv.lifting import Lifted, lift, project_markers
from motionenv.lifting.view_geometry import turned_to_x
from motionenv.metrics import aligned_mpjpe, pelvis_mpjpe
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.types import MARKERS, Markers, Points

FPS = 30.0
VIEWS = np.radians(np.arange(-180, 180, 90) + 37)
PELVIS = MARKERS.index("pelvis")
TILTED = np.radians(15)


@dataclass(frozen=True)
class Case:
    """A kind of picture: the function that makes points from a walk and a view, and arguments of `lift`."""

    name: str
    points: Callable[[Markers, float, np.random.Generator], Points]
    told: dict = field(default_factory=dict)


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
    Case("unchanged", plain),
    Case("20 mm noise", noisy),
    Case("30 % of points missing", gappy),
    Case("5 markers missing throughout", lacking),
    Case("5 % outliers", wild),
    Case("elevation 15°, known", tilted, {"elevation": TILTED}),
    Case("elevation 15°, unknown", tilted, {"elevation": None}),
)


def steady_walk(markers: Markers) -> Markers:
    """The steady stretch of a walk, along x, at 30 frames per second."""
    cut = steady_stretch(markers)
    step = round(markers.fps / FPS)
    positions = markers.positions[cut][::step]
    return turned_to_x(Markers(MARKERS, positions, markers.fps / step, name=markers.name))


def figures(lifted: Lifted) -> dict:
    """Errors of one lifted sequence."""
    truth = lifted.points.truth.positions
    about = lambda positions: positions - positions[:, [PELVIS]]
    inside = np.abs(about(lifted.positions) - about(truth)) < lifted.band
    told = np.isfinite(lifted.band) & (np.arange(len(MARKERS)) != PELVIS)[:, None]
    way = lambda positions: np.linalg.norm(positions[-1, PELVIS, :2] - positions[0, PELVIS, :2])
    return {
        "joint_mm": 1e3 * float(pelvis_mpjpe(lifted.positions, truth).mean()),
        "aligned_mm": 1e3 * float(aligned_mpjpe(lifted.positions, truth).mean()),
        "in_band": float(inside[told].mean()) if told.any() else np.nan,
        "way": float(way(lifted.positions) / way(truth)),
    }


def row(case: Case, walks, views) -> dict:
    """Means over people and views of one case."""
    rng = np.random.default_rng(0)
    each = [figures(lift(case.points(walk, alpha, rng), **case.told)) for walk in walks for alpha in views]
    return {"case": case.name} | {key: float(np.mean([one[key] for one in each])) for key in each[0]}


def longest(mocap: Path, most: int | None = None) -> list[Markers]:
    """The longest walk of each CMU person (of `most` at most), without starts and stops."""
    folds = cmu_folds(mocap)[:most]
    captured = {m.name: m for m in cmu_markers(mocap)[0] if m.name != CURVED}
    return [steady_walk(captured[max(fold.test, key=lambda w: w.strides).name]) for fold in folds]


def acted(mocap: Path, most: int | None = None) -> list[Markers]:
    """Acted walks of Bandai-Namco's, straight ahead along x."""
    found = []
    for clip in bandai.clips(mocap, "forward walks", most or bandai.CLIPS):
        way = clip.positions[-1, PELVIS] - clip.positions[0, PELVIS]
        found.append(turned_to_x(clip, float(np.arctan2(way[1], way[0]))))
    return found


def main() -> None:
    """Print the table."""
    args = options(__doc__, "cmu_asfamc", "bandai_namco").parse_args()
    views, most = (VIEWS[:1], 1) if args.quick else (VIEWS, None)
    walks = longest(args.mocap, most)
    print("| picture | joints [mm] | aligned [mm] | inside band | way |\n|-|-|-|-|-|")
    rows = []
    cases = [(case, walks) for case in CASES]
    cases.append((Case("acted walks of people not seen", plain), acted(args.mocap, most)))
    for case, people in cases:
        r = row(case, people, views)
        rows.append(r)
        in_band = "–" if np.isnan(r["in_band"]) else f"{r['in_band']:.1%}"  # where some have no band at all
        figures_ = f"{r['joint_mm']:.1f} | {r['aligned_mm']:.1f} | {in_band} | {r['way']:.2f}"
        print(f"| {r['case']} | {figures_} |", flush=True)
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        (args.out / "lifting_raw.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
