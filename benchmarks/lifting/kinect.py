"""Paper B's experiments at its scale: 99 people in front of a noisy depth camera that sees only the near side.

    motionenv bench lifting.kinect [--mocap FOLDER] [--out FOLDER]

Each piece of `benchmarks/models/kinectgait.py` shows 9 markers: the side near the camera and the middle. Eigenwalkers
are fitted by EM with the other markers missing, N = 30, a column per person, in ten folds of people. Lifted is the mean
of all pieces of a left-out person ("both sides"), or of the pieces that show one side ("one side", 9 markers, the
others missing throughout). Errors are of known markers in the missing dimension.

Noise is estimated from the deviations of pieces from the mean of their person and side. It doesn't include systematic
errors of the depth camera.
"""

import json
from dataclasses import dataclass

import numpy as np

from benchmarks.lifting.walker_errors import walker_error
from benchmarks.lifting.walks import VARIANCE, VIEWS, approach_one, approach_two, options
from benchmarks.models import kinectgait
from motionenv.lifting.view_geometry import depth, project
from motionenv.lifting.views.known_view import maximum_a_posteriori
from motionenv.lifting.views.unknown_view import find_view
from motionenv.models.eigenwalkers.fourier_series import mirrored
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS
from renders.plotting import variance_curve

CANDIDATES = 1e-6 * np.array([70, 150, 300, 600, 1200, 2400])  # [m²]
SIDES = {side: [i for i, m in enumerate(MARKERS) if m.startswith(side)] for side in ("left", "right")}
POWER = np.array([1.0, 0.5, 0.5, 0.5, 0.5])  # mean square over a cycle of the five functions of eq. 3.1
FACING = {"right": 0.0, "left": np.pi}  # the view that shows this side


@dataclass(frozen=True)
class Capture:
    """All pieces: coefficients (n, 5, 15, 3) [m], NaN on the far side; person, side and fold of each (n,)."""

    walkers: list
    w: np.ndarray
    person: np.ndarray
    side: np.ndarray
    fold: np.ndarray

    def means(self, fold: int, side: str | None = None) -> np.ndarray:
        """Mean pieces (people, 5, 15, 3) of the people of a fold, of one side, or of both if both were captured."""
        mine = (self.fold == fold) & (True if side is None else self.side == side)
        found = [known_mean(self.w[mine & (self.person == p)]) for p in np.unique(self.person[mine])]
        return np.array([w for w in found if side or np.isfinite(w).all()])


def known_mean(w: np.ndarray) -> np.ndarray:
    """Mean of the known values over the first axis, NaN without any."""
    known = np.isfinite(w).sum(axis=0)
    return np.divide(np.nansum(w, axis=0), known, out=np.full(w.shape[1:], np.nan), where=known > 0)


def read(folder, folds: int) -> Capture:
    """Read the capture, and assign people to folds in turn."""
    walkers, persons, _ = kinectgait.pass_walkers(folder)
    w, (_, number) = np.stack([a.coefficients for a in walkers]), np.unique(persons, return_inverse=True)
    side = np.where(np.isfinite(w[:, 0, SIDES["left"][0], 0]), "left", "right")
    return Capture(walkers, w, np.array(persons), side, number % folds)


def models(capture: Capture, folds: int, n: int) -> tuple[list[Eigenwalkers], list[WalkerPrior]]:
    """The paper's models and ours, each fitted without one fold."""
    both = []
    for fold in range(folds):
        kept = np.flatnonzero(capture.fold != fold)
        given = [capture.walkers[i] for i in kept], list(capture.person[kept])
        both.append((Eigenwalkers(n).fit(*given), WalkerPrior(merge=True).fit(*given)))
    return tuple(map(list, zip(*both, strict=True)))


def noise(capture: Capture, views: np.ndarray) -> tuple[float, float]:
    """Rms noise [mm] in the missing dimension, of a piece and of the mean of a person's side."""
    pieces, means = [], []
    for key in sorted({*zip(capture.person, capture.side, strict=True)}):
        mine = capture.w[(capture.person == key[0]) & (capture.side == key[1])]
        if len(mine) > 1:
            away = depth((mine - mine.mean(axis=0))[:, None], views)
            scatter = walker_error(np.where(np.isfinite(away), 0.0, np.nan), away).sum(axis=0) / (len(mine) - 1)
            pieces.append(scatter.mean())
            means.append(scatter.mean() / len(mine))
    return millimetres(pieces), millimetres(means)


def millimetres(squares) -> float:
    """Root of the mean, in mm, of squared errors [m²]."""
    return 1e3 * float(np.sqrt(np.mean(squares)))


def known_views(tests: list[np.ndarray], paper: list, ours: list, views: np.ndarray) -> dict[str, float]:
    """Squared errors [m²] of every method; for each fold, σ² is chosen on the other folds."""

    def error(which, lift) -> np.ndarray:
        pairs = zip(tests, which, strict=True)
        return np.array([
            walker_error(lift(m, project(w[:, None], views), views).depth, depth(w[:, None], views)).mean()
            for w, m in pairs
        ])  # fmt: skip

    curve = np.array([error(paper, approach_two(variance=v)) for v in CANDIDATES])
    others = curve.sum(axis=1, keepdims=True) - curve
    return {
        "I": float(error(paper, approach_one()).mean()),
        "II, σ² = 70 mm²": float(error(paper, approach_two(variance=VARIANCE)).mean()),
        "II, σ² chosen": float(np.take_along_axis(curve, others.argmin(axis=0)[None], axis=0).mean()),
        "ours": float(error(ours, approach_two(variance=None)).mean()),
        "σ²": float(CANDIDATES[curve.mean(axis=1).argmin()]),
    }


def unknown_views(tests: list[np.ndarray], which: list, views: np.ndarray, **how) -> np.ndarray:
    """Absolute errors (people, views) [°] of views estimated on the full circle."""
    found = [find_view(m, project(w[:, None], views), **how).alpha - views for w, m in zip(tests, which, strict=True)]
    return np.rad2deg(np.abs((np.concatenate(found) + np.pi) % (2 * np.pi) - np.pi))


def completed(model: WalkerPrior, w: np.ndarray) -> np.ndarray:
    """The model's expectation of a walker (5, 15, 3), given one side in three dimensions."""
    seen = np.isfinite(w).all(axis=(0, 2))
    weights = (1 / model.noise_)[:, seen, None]
    e, deviation = model.components_[:, :, seen], (w - model.mean_)[:, seen]
    normal = np.einsum("nhmi,khmi,hmi->nk", e, e, np.broadcast_to(weights, e.shape[1:]))
    scores = np.linalg.solve(
        normal + np.diag(1 / model.explained_variance_), np.einsum("nhmi,hmi->n", e, weights * deviation)
    )
    return model.mean_ + np.tensordot(scores, model.components_, 1)


def other_side(capture: Capture, ours: list) -> dict[str, float]:
    """Rms error [mm] per coordinate of predictions of the far side, which other passes show, for each predictor."""
    squares: dict[str, list] = {name: [] for name in ("mean", "mirror", "3d", "2d", "piece", "noise")}
    for key in sorted({*zip(capture.person, strict=True)}):
        person = capture.person == key[0]
        for near, far in (("left", "right"), ("right", "left")):
            seen, unseen = (capture.w[person & (capture.side == s)] for s in (near, far))
            if len(seen) and len(unseen) > 1:
                model = ours[capture.fold[person][0]]
                for name, square in missed(model, seen, unseen, near, SIDES[far]).items():
                    squares[name].append(square)
    return {name: millimetres(values) for name, values in squares.items()} | {"sides": len(squares["mean"])}


def missed(model: WalkerPrior, seen: np.ndarray, unseen: np.ndarray, near: str, far: list[int]) -> dict[str, float]:
    """Squared errors [m²] per coordinate of predictions of the markers `far`, from pieces of the near side."""
    truth, own = unseen.mean(axis=0), seen.mean(axis=0)
    over_cycle = lambda w: float(np.tensordot(POWER, ((w - truth)[:, :, far] ** 2).mean(axis=(0, 2, 3)), 1))
    lifted = lambda w: maximum_a_posteriori(model, project(w, FACING[near]), FACING[near], variance=None).coefficients
    guesses = {
        "mean": model.mean_[None],
        "mirror": mirrored(own)[None],
        "3d": completed(model, own)[None],
        "2d": lifted(own[None]),
        "piece": lifted(seen),
    }
    found = {name: over_cycle(w) for name, w in guesses.items()}
    return found | {"noise": over_cycle(unseen) / (len(unseen) - 1)}


def known_table(tests: dict[str, list[np.ndarray]], paper: list, ours: list, views: np.ndarray) -> dict:
    """Print and return the results for known views."""
    print("| known view | walkers | I [mm] | II, σ² = 70 mm² | II, σ² chosen on the other folds | ours | (II / I)² |")
    print("|-|-|-|-|-|-|-|")
    found = {}
    for name, test in tests.items():
        found[name] = known = known_views(test, paper, ours, views)
        cells = [f"{millimetres(known[k]):.1f}" for k in ("I", "II, σ² = 70 mm²", "II, σ² chosen", "ours")]
        ratios = f"{known['II, σ² = 70 mm²'] / known['I']:.2f}, {known['II, σ² chosen'] / known['I']:.2f}"
        print(f"| {name} | {sum(map(len, test))} | {' | '.join(cells)} | {ratios} ({1e6 * known['σ²']:.0f} mm²) |")
    return found


def unknown_table(tests: dict[str, list[np.ndarray]], paper: list, ours: list, views: np.ndarray) -> dict:
    """Print and return the results for unknown views."""
    print("\n| view on the full circle | mean error [°] | median | beyond 20° |\n|-|-|-|-|")
    ways = {"I": (paper, {"approach": "ls"}), "II, σ² = 70 mm²": (paper, {}), "ours": (ours, {"variance": None})}
    found = {}
    for name, test in tests.items():
        for way, (which, how) in ways.items():
            error = unknown_views(test, which, views, **how)
            figures = float(error.mean()), float(np.median(error)), 100 * float((error > 20).mean())
            print("| {}, {} | {:.1f} | {:.1f} | {:.1f} % |".format(name, way, *figures))
            found[f"{name}, {way}"] = dict(zip(("mean", "median", "gross_percent"), figures, strict=True))
    return found


def other_side_table(far: dict[str, float]) -> None:
    """Print the errors of predictions of the far side."""
    print(f"\n| far side of left-out people ({far['sides']} sides), predicted by | rms per coordinate [mm] |\n|-|-|")
    for key, name in {
        "mean": "the average walker",
        "mirror": "the mirror image of the visible side, in 3D",
        "3d": "ours, from the visible side in 3D",
        "2d": "ours, from the picture of the visible side",
        "piece": "ours, from the picture of one piece of 3 s",
        "noise": "(noise of the reference)",
    }.items():
        print(f"| {name} | {far[key]:.1f} |")


def main() -> None:
    """Print the tables; write the numbers and figure 2."""
    asked = options(__doc__, "kinectgait").parse_args()
    folds, n, views = (2, 3, VIEWS[::90]) if asked.quick else (10, 30, VIEWS[::5])
    capture = read(asked.mocap / "kinectgait", folds)
    whole = Eigenwalkers(n).fit(capture.walkers, list(capture.person))
    paper, ours = models(capture, folds, n)
    tests = {
        "both sides": [capture.means(fold) for fold in range(folds)],
        "one side": [np.concatenate([capture.means(f, "left"), capture.means(f, "right")]) for f in range(folds)],
    }
    (piece, mean), share = noise(capture, views), 100 * np.cumsum(whole.explained_variance_ratio_)
    print(
        f"{len(capture.w):,} pieces of {whole.n_people_} people. Noise in the missing dimension: {piece:.1f} mm for a "
        f"piece, {mean:.1f} mm for the mean of one side of a person. {n} components hold {share[n - 1]:.1f} % of the "
        "variance (paper B: 95.5 %).\n"
    )
    known, unknown = (table(tests, paper, ours, views) for table in (known_table, unknown_table))
    far = other_side(capture, ours)
    other_side_table(far)
    if asked.out:
        asked.out.mkdir(parents=True, exist_ok=True)
        variance_curve(whole.explained_variance_ratio_, marked=n).savefig(asked.out / "fig2-kinectgait.png")
        numbers = {"noise_mm": {"piece": piece, "mean": mean}, "fig2_percent": list(share)}
        numbers |= {"known_m2": known, "unknown_degrees": unknown, "other_side_mm": far}
        (asked.out / "lifting_kinect.json").write_text(json.dumps(numbers, indent=1))


if __name__ == "__main__":
    main()
