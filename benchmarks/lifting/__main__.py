"""Paper B's experiments with people left out: lift 2D walks to 3D from known and unknown views.

    motionenv bench lifting --mocap FOLDER [--out FOLDER]

Each of the 54 straight CMU walks of 11 people is lifted by models fitted without its person, from 181 views of -90° to
90°. Approaches I and II are the paper's, on the paper's model: a column per walk, N = 30, σ² = 70 mm². "Ours" is
`WalkerPrior`: mirror images, and a noise for each harmonic and marker. Errors are of the missing dimension (eqs. 4.1 to
4.4). Unknown views are searched on the full circle; phase, position and size are known as in the paper, unless stated.
With --out, figures 3, 5 a to c, 6 a and b and all numbers (lifting.json) are written there.

Noise of 20 mm on points is added to each 2D point of each frame, at 30 frames per second over the steady stretch, and
the coefficients are fitted to the noisy frames. Noise of 20 mm on coefficients, which is harsher, is added to each
coefficient.
"""

import json
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import headline
from benchmarks.lifting import joints
from benchmarks.lifting.figures import error_over_variance, over_views, recovered_views
from benchmarks.lifting.walker_errors import cycle_mpjpe, missing_variance, relative_walker_error
from benchmarks.lifting.walks import (
    VARIANCE,
    VIEWS,
    Fold,
    Lifted,
    approach_one,
    approach_two,
    cmu_folds,
    from_known_views,
    noisy,
    options,
    our_models,
    paper_models,
    persons,
    true_depth,
)
from motionenv.lifting.view_geometry import project
from motionenv.lifting.views.unknown_view import find_view
from motionenv.models.eigenwalkers.fourier_series import later
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior

NOISE = 0.02  # [m]
GROSS = np.radians(20)
CANDIDATES = np.array([1, 5, 10, 20, 30, 40, 50, 60, 70, 80, 100, 125, 150, 200, 250, 300, 400, 500, 625])  # [mm²]


@dataclass(frozen=True)
class Found:
    """Estimated views: their errors [rad], the walks lifted from them in the camera's frame, and MPJPE [m]."""

    error: np.ndarray  # (walks, views), estimate minus truth, within ±π
    lifted: Lifted
    distance: np.ndarray  # (walks, views) MPJPE in the walker's frame, which includes the error of the view

    @property
    def figures(self) -> dict[str, float]:
        """Mean and largest error [°], share of gross errors [%], rms of the missing dimension and MPJPE [mm]."""
        degrees = np.rad2deg(np.abs(self.error))
        return {
            "mean_degrees": float(degrees.mean()),
            "greatest_degrees": float(degrees.max()),
            "gross_percent": 100 * float((np.abs(self.error) > GROSS).mean()),
            "rms_mm": self.lifted.rms,
            "mpjpe_mm": 1e3 * float(self.distance.mean()),
        }


def from_unknown_views(
    folds: list[Fold], models: list, views: np.ndarray, *, approach: str = "map", variance: float | None = None,
    disturb: Callable = lambda fold, w2, rng: w2, **unknown,
) -> Found:  # fmt: skip
    """Estimate the view of every left-out walk on the full circle, and lift the walk from it.

    Args:
        folds: people left out.
        models: the model of each fold.
        views: (n,) true views [rad].
        approach: "ls" or "map".
        variance: σ² [m²], None for the models' own.
        disturb: adds noise to the 2D coefficients, or shifts their phase.
        unknown: further unknowns of `find_view`.
    """
    rng, errors, estimates, distances = np.random.default_rng(0), [], [], []
    lift = approach_one(None) if approach == "ls" else approach_two(variance=variance)
    for fold, model in zip(folds, models, strict=True):
        w2 = disturb(fold, project(fold.coefficients[:, None], views), rng)
        found = find_view(model, w2, approach=approach, variance=variance, **unknown)
        walks = lift(model, found.aligned(w2), found.alpha, elevation=found.elevation)
        errors.append((found.alpha - views + np.pi) % (2 * np.pi) - np.pi)
        estimates.append(walks.depth)
        distances.append(cycle_mpjpe(walks.coefficients, fold.coefficients[:, None], samples=12))
    lifted = Lifted(np.concatenate(estimates), true_depth(folds, views), persons(folds))
    return Found(np.concatenate(errors), lifted, np.concatenate(distances))


def known_views(folds: list[Fold], paper: list, ours: list, views: np.ndarray, counts) -> dict[str, Lifted]:
    """Results of every method for known views, the paper's with each of `counts` components."""
    ways = {
        f"{name}, N = {n}": (paper, approach(n))
        for n in counts
        for name, approach in (("I", approach_one), ("II", approach_two))
    }
    ways["ours"] = (ours, approach_two(variance=None))
    return {name: from_known_views(folds, models, lift, views) for name, (models, lift) in ways.items()}


def unknown_views(folds: list[Fold], paper: list, ours: list, views: np.ndarray) -> dict[str, Found]:
    """Results of every method for unknown views."""
    on_points = {"disturb": lambda fold, w2, rng: noisy(fold, w2, NOISE, rng)}
    on_coefficients = {"disturb": lambda fold, w2, rng: w2 + NOISE * rng.standard_normal(w2.shape)}
    started = {"disturb": lambda fold, w2, rng: later(w2, rng.uniform(-np.pi, np.pi, w2.shape[:2])), "phase": "unknown"}
    anything = {**started, "offset": "unknown", "scale": "unknown", "elevation": "unknown"}
    told = [with_noise(model, NOISE**2) for model in ours]
    ways: dict[str, tuple[list, dict]] = {
        "I": (paper, {"approach": "ls", "variance": VARIANCE}),
        "II": (paper, {"variance": VARIANCE}),
        "ours": (ours, {}),
        "ours, phase unknown, too": (ours, started),
        "ours, phase, position, scale and elevation unknown": (ours, anything),
        "ours, noise of 20 mm on points": (ours, on_points),
        "ours, noise of 20 mm on coefficients": (ours, on_coefficients),
        "ours, noise of 20 mm on coefficients, given to the model": (told, on_coefficients),
    }
    return {name: from_unknown_views(folds, models, views, **how) for name, (models, how) in ways.items()}


def with_noise(model: WalkerPrior, variance: float) -> WalkerPrior:
    """The model with additional measurement noise of the given `variance` [m²] on the coefficients."""
    told = copy(model)
    told.noise_ = model.noise_ + variance
    return told


def variances(folds: list[Fold], paper: list, views: np.ndarray, counts) -> dict[str, list[float]]:
    """Fig. 3: E_a [mm²] under each candidate σ²."""
    return {
        f"N = {n}": [from_known_views(folds, paper, approach_two(n, 1e-6 * v), views).rms ** 2 for v in CANDIDATES]
        for n in counts
    }


def curves(known: dict[str, Lifted], n: int) -> dict[str, dict[str, np.ndarray]]:
    """Figs. 5 a to c: means over the walks for each view (views,)."""
    shown = {"approach I": known[f"I, N = {n}"], "approach II": known[f"II, N = {n}"], "ours": known["ours"]}
    truth = known["ours"].truth
    relative = lambda run: relative_walker_error(run.estimate, truth).mean(axis=0)
    overall = lambda run: relative_walker_error(run.estimate, truth, posture=True).mean(axis=0)
    return {
        "absolute_mm2": {name: 1e6 * run.errors.mean(axis=0) for name, run in shown.items()},
        "relative": {name: relative(run) for name, run in shown.items()},
        "relative_posture": {name: overall(run) for name, run in shown.items()},
        "variance_mm2": {"over time": 1e6 * missing_variance(truth).mean(axis=0)},
        "variance_posture_mm2": {"posture included": 1e6 * missing_variance(truth, posture=True).mean(axis=0)},
    }


def draw(out: Path, by_variance: dict, by_view: dict, found: dict[str, Found], views: np.ndarray) -> None:
    """Write the figures."""
    both = {"approach I": found["I"].error, "approach II": found["II"].error, "ours": found["ours"].error}
    spread = {**by_view["variance_mm2"], **by_view["variance_posture_mm2"]}
    figures = {
        "fig3": error_over_variance(CANDIDATES, by_variance, chosen=1e6 * VARIANCE),
        "fig5a": over_views(views, by_view["absolute_mm2"], "mean squared error [mm²]"),
        "fig5b": over_views(views, by_view["relative"], "relative error"),
        "fig5b-posture": over_views(views, by_view["relative_posture"], "relative error, posture included"),
        "fig5c": over_views(views, spread, "variance of the missing dimension [mm²]"),
        "fig6": recovered_views(views, both),
    }
    for name, figure in figures.items():
        figure.savefig(out / f"{name}.png")


def ratio(known: dict[str, Lifted], n: int) -> float:
    """Ratio of the squared errors of approaches II and I."""
    return (known[f"II, N = {n}"].rms / known[f"I, N = {n}"].rms) ** 2


def known_table(known: dict[str, Lifted]) -> None:
    """Print the results for known views."""
    print("| known view, missing dimension | rms over walks [mm] | over people | MPJPE [mm] |\n|-|-|-|-|")
    for name, run in known.items():
        print(f"| {name} | {run.rms:.1f} | {run.rms_of_people:.1f} | {run.distance:.1f} |")


def unknown_table(found: dict[str, Found]) -> None:
    """Print the results for unknown views."""
    print("\n| view on the full circle | mean error [°] | largest | beyond 20° | rms [mm] | MPJPE, walker's frame |")
    print("|-|-|-|-|-|-|")
    for name, run in found.items():
        degrees, greatest, gross, rms, distance = run.figures.values()
        print(f"| {name} | {degrees:.2f} | {greatest:.1f} | {gross:.2f} % | {rms:.1f} | {distance:.1f} |")


def goals_table(rows: list[tuple[str, str, str, str]]) -> None:
    """Print the paper's results, the goals and ours."""
    print("\n| quantity | paper B | goal | reached |\n|-|-|-|-|")
    for row in rows:
        print(f"| {' | '.join(row)} |")


def main() -> None:
    """Run everything, print the tables, write figures and numbers."""
    asked = options(__doc__, "cmu_asfamc").parse_args()
    views = VIEWS[::90] if asked.quick else VIEWS
    folds = cmu_folds(asked.mocap)
    counts = few, most = (2, 3) if asked.quick else (20, 30)
    paper, ours = paper_models(folds, most), our_models(folds)
    known = known_views(folds, paper, ours, views, counts)
    found = unknown_views(folds, paper, ours, views)
    by_variance, by_view = variances(folds, paper, views[:: 1 if asked.quick else 5], counts), curves(known, most)
    by_joint = joints.measure(folds, ours, draws=4 if asked.quick else None)
    known_table(known)
    unknown_table(found)
    joints.table(by_joint)
    own = found["ours"].figures
    headline(
        depth=known["ours"].rms, depth_ls=known[f"I, N = {most}"].rms, depth_map=known[f"II, N = {most}"].rms,
        view=own["mean_degrees"], view_map=found["II"].figures["mean_degrees"],
    )  # fmt: skip
    goals_table([
        ("MAP rms error, missing dimension, known view", "", "≤ 25 mm", f"{known['ours'].rms:.1f} mm"),
        (f"MAP / LS squared error, N = {most}", "about 0.7", "≤ 0.68", f"{ratio(known, most):.2f}"),
        (f"MAP / LS squared error, N = {few}", "", "", f"{ratio(known, few):.2f}"),
        (
            f"σ² with the smallest error (fig. 3), N = {most}",
            "70 mm²",
            "",
            f"{CANDIDATES[np.argmin(by_variance[f'N = {most}'])]} mm²",
        ),
        ("unknown view, mean error of the angle", "", "≤ 2.5°", f"{own['mean_degrees']:.2f}°"),
        ("… beyond 20°", "", "< 0.5 %", f"{own['gross_percent']:.2f} %"),
        ("3D error relative to a known view", "", "≤ 1.15", f"{own['rms_mm'] / known['ours'].rms:.3f}"),
        *joints.goals(by_joint),
        *(
            (f"unknown view, {name.removeprefix('ours, ')}", "", "≤ 4°", f"{run.figures['mean_degrees']:.2f}°")
            for name, run in found.items()
            if "20 mm" in name
        ),
    ])  # fmt: skip
    if asked.out:
        asked.out.mkdir(parents=True, exist_ok=True)
        draw(asked.out, by_variance, by_view, found, views)
        numbers = {
            "views_degrees": np.rad2deg(views),
            "known": {
                k: {"rms_mm": r.rms, "people_mm": r.rms_of_people, "mpjpe_mm": r.distance} for k, r in known.items()
            },
            "map_over_ls": {n: ratio(known, n) for n in counts},
            "unknown": {k: run.figures for k, run in found.items()},
            "fig3": {"variance_mm2": CANDIDATES, "error_mm2": by_variance},
            "fig5": by_view,
            "fig6_degrees": {
                k: {"mean": np.rad2deg(r.error.mean(0)), "deviation": np.rad2deg(r.error.std(0))}
                for k, r in found.items()
            },
            "joints": by_joint,
        }
        (asked.out / "lifting.json").write_text(json.dumps(numbers, indent=1, default=np.ndarray.tolist))


if __name__ == "__main__":
    main()
