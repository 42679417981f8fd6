"""Errors by marker, of those that are seen and of those that never are.

`benchmarks.lifting` prints these tables.
"""

from itertools import combinations

import numpy as np

from benchmarks.lifting.walker_errors import joint_error
from benchmarks.lifting.walks import VIEWS, Fold
from motionenv.lifting.view_geometry import axes, project
from motionenv.lifting.views.known_view import maximum_a_posteriori
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS

SEEN_FROM = VIEWS[::30]
EVERY = np.array(list(combinations(range(len(MARKERS)), 5)))  # all 3,003 combinations of five markers


def measure(folds: list[Fold], ours: list[WalkerPrior], draws: int | None) -> dict:
    """Errors for `draws` random combinations of five missing markers, or for all."""
    ways = EVERY if draws is None else np.random.default_rng(0).permutation(EVERY)[:draws]
    people = sum(len(fold.test) for fold in folds)
    away = sum(np.array([errors(fold, model, way) for way in ways]) for fold, model in zip(folds, ours, strict=True))
    away /= people * len(SEEN_FROM)
    missing = np.zeros((len(ways), len(MARKERS)), bool)
    np.put_along_axis(missing, ways, True, axis=1)
    return {
        "ways": len(ways),
        **missing_figures(away, missing),
    }


def missing_figures(away: np.ndarray, missing: np.ndarray) -> dict:
    """Rms errors [mm] and ratios, from squared errors (ways, 15, 2) [m²] in depth and 3D; `missing` (ways, 15)."""
    mean = lambda axis, some: (away[..., axis] * some).sum(axis=1) / some.sum(axis=1)
    root = lambda squares: 1e3 * float(np.sqrt(np.mean(squares)))
    hidden, shown = mean(0, missing), mean(0, ~missing)
    ratios = np.sqrt(hidden / shown)
    when_seen = (away[..., 0] * ~missing).sum(axis=0) / (~missing).sum(axis=0)
    same = np.sqrt(hidden / ((when_seen * missing).sum(axis=1) / missing.sum(axis=1)))
    worst = int(ratios.argmax())
    return {
        "missing_depth_mm": root(hidden),
        "seen_depth_mm": root(shown),
        "missing_3d_mm": root(mean(1, missing)),
        "depth_ratio": root(hidden) / root(shown),
        "depth_ratio_95th_percentile": float(np.percentile(ratios, 95)),
        "depth_ratio_worst": float(ratios[worst]),
        "depth_ratio_to_same_joints_seen": float(np.sqrt(np.mean(same**2))),
        "depth_ratio_to_same_joints_seen_worst": float(same.max()),
        "ratio_3d": root(mean(1, missing)) / root(mean(1, ~missing)),
        "worst": [MARKERS[i] for i in np.flatnonzero(missing[worst])],
        "by_marker_mm": {
            name: {"missing": root(away[missing[:, i], i, 0]), "seen": root(away[~missing[:, i], i, 0])}
            for i, name in enumerate(MARKERS)
        },
    }


def errors(fold: Fold, model: WalkerPrior, way: np.ndarray) -> np.ndarray:
    """Squared errors (15, 2) [m²] in depth and 3D with the markers `way` missing, summed over walks and views."""
    w2 = project(fold.coefficients[:, None], SEEN_FROM)
    w2[..., way, :] = np.nan
    walks = maximum_a_posteriori(model, w2, SEEN_FROM, variance=None).coefficients
    wrong = np.einsum("vij,nvhmj->invhm", axes(SEEN_FROM), walks - fold.coefficients[:, None])
    each = joint_error(wrong, np.zeros_like(wrong)).sum(axis=(1, 2))
    return np.stack([each[2], each.sum(axis=0)], axis=-1)


def goals(joints: dict) -> list[tuple[str, str, str, str]]:
    """Rows for the table of goals."""
    ratio = f"{joints['depth_ratio']:.2f}; worst {joints['depth_ratio_worst']:.2f}"
    return [
        (
            f"5 of 15 markers missing, {joints['ways']:,} combinations: their depth error relative to visible ones",
            "",
            "≤ 1.3",
            ratio,
        ),
    ]


def table(joints: dict) -> None:
    """Print the results by marker."""
    print("\n| marker | depth error, visible [mm] | one of 5 missing [mm] |\n|-|-|-|")
    for name, figures in joints["by_marker_mm"].items():
        print(f"| {name.replace('_', ' ')} | {figures['seen']:.1f} | {figures['missing']:.1f} |")
    print(
        f"\nWith five markers missing, their depth error is {joints['missing_depth_mm']:.1f} mm, that of the visible "
        f"ones {joints['seen_depth_mm']:.1f} mm. In 3D it is {joints['missing_3d_mm']:.1f} mm (ratio "
        f"{joints['ratio_3d']:.2f}): a visible marker lacks one coordinate, a missing one three. Ratio of depth errors "
        f"over the combinations: 95th percentile {joints['depth_ratio_95th_percentile']:.2f}, worst "
        f"{joints['depth_ratio_worst']:.2f} ({', '.join(joints['worst'])}). Relative to the same joints when they are "
        f"visible: {joints['depth_ratio_to_same_joints_seen']:.2f}, worst "
        f"{joints['depth_ratio_to_same_joints_seen_worst']:.2f}."
    )
