"""Speed of lifting from known and unknown views, compared with loops over NumPy's solvers.

Walkers are drawn from the shipped prior, including its noise, and seen from 181 views. The loops solve once per walker
and view and, if the view is unknown, per candidate angle (each degree of the circle). They are timed on a part of the
pairs and extrapolated. Ours finds all minima on the full circle to 1e-9 rad.

    motionenv bench lifting.speed
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: matrices are too small to share

import numpy as np
from scipy.optimize import least_squares as optimise

from benchmarks import Arguments, shortest
from motionenv.lifting.view_geometry import project
from motionenv.lifting.views.known_view import least_squares, maximum_a_posteriori
from motionenv.lifting.views.unknown_view import find_view
from motionenv.models.registry import load

VIEWS = np.radians(np.arange(-90, 91))
CIRCLE = np.radians(np.arange(360))
VARIANCE = 70e-6
SAMPLED_UNKNOWN = 4


def sequences(model, walkers: int, views: np.ndarray) -> np.ndarray:
    """2D coefficients (walkers, views, 5, 15, 2) [m] of walkers drawn from the prior."""
    rng = np.random.default_rng(0)
    scores = np.sqrt(model.explained_variance_) * rng.standard_normal((walkers, len(model.components_)))
    rest = np.sqrt(model.noise_)[..., None] * rng.standard_normal((walkers, 5, 15, 3))
    return project((model.inverse_transform(scores) + rest)[:, None], views)


def picture(alpha: float) -> np.ndarray:
    """C(α) of one marker (2, 3)."""
    return np.array([[np.cos(alpha), np.sin(alpha), 0.0], [0.0, 0.0, 1.0]])


def shown(model, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Projected mean (150,) and components (150, N)."""
    c = picture(alpha)
    return (model.mean_ @ c.T).reshape(-1), (model.components_ @ c.T).reshape(len(model.components_), -1).T


def solved(model, y, mean, e, approach: str) -> np.ndarray:
    """Scores of one sequence (150,): eqs. 3.9 and 3.15."""
    if approach == "ls":
        return np.linalg.lstsq(e, y - mean, rcond=None)[0]
    return np.linalg.solve(e.T @ e + np.diag(VARIANCE / model.explained_variance_), e.T @ (y - mean))


def known_loop(model, y, alpha: float, approach: str) -> np.ndarray:
    """The missing dimension (5, 15) of one sequence seen from `alpha`."""
    k = solved(model, y.reshape(-1), *shown(model, alpha), approach)
    walker = model.mean_ + np.tensordot(k, model.components_, 1)
    return walker @ [-np.sin(alpha), np.cos(alpha), 0.0]


def scan_loop(model, y, approach: str, kept=None) -> float:
    """The best of 360 candidate angles by eqs. 4.5 and 4.6; `kept` are cached projections."""
    costs, y = [], y.reshape(-1)
    for i, alpha in enumerate(CIRCLE):
        mean, e = kept[i] if kept else shown(model, alpha)
        k = solved(model, y, mean, e, approach)
        cost = np.sum((y - mean - e @ k) ** 2) / (2 * VARIANCE)
        costs.append(cost + (np.sum(k**2 / (2 * model.explained_variance_)) if approach == "map" else 0.0))
    return CIRCLE[np.argmin(costs)]


def optimiser(model, y) -> float:
    """Eq. 4.5 by a general optimiser with analytic derivatives, the best of starts from four sides."""
    y = y.reshape(-1)

    def rest(x):
        mean, e = shown(model, x[0])
        return y - mean - e @ x[1:]

    def jacobian(x):
        turned = (model.mean_ + np.tensordot(x[1:], model.components_, 1)) @ [-np.sin(x[0]), np.cos(x[0]), 0.0]
        across = np.stack([turned, np.zeros_like(turned)], axis=-1).reshape(-1)
        return -np.column_stack([across, shown(model, x[0])[1]])

    starts = (np.append(a, np.zeros(len(model.components_))) for a in np.radians([0, 90, 180, 270]))
    return min((optimise(rest, x, jacobian) for x in starts), key=lambda told: told.cost).x[0]


def seconds(work, repeats: int = 5) -> float:
    """Shortest of several runs, after one that compiles."""
    return shortest(work, repeats, warm=True)


def print_row(task: str, loop: float, ours: float) -> None:
    """Print a row of the table: seconds and their ratio."""
    print(f"| {task} | {loop:.3g} | {ours:.3g} | {loop / ours:.0f} |")


def known_rows(model, w2, views) -> None:
    """Print the rows of known views; a loop is timed on some pairs of walkers and views."""
    walkers, sampled = len(w2), min(200, len(w2) * len(views))
    pairs = np.random.default_rng(1).choice(walkers * len(views), sampled, replace=False)
    for approach, solve in (("ls", least_squares), ("map", maximum_a_posteriori)):
        at = [(p // len(views), p % len(views)) for p in pairs]
        each = seconds(lambda a=approach, at=at: [known_loop(model, w2[i, j], views[j], a) for i, j in at]) / sampled
        ours = seconds(lambda s=solve: s(model, w2, views))
        print_row(f"known view, {approach.upper()}, {walkers} × {len(views)}", each * w2[..., 0, 0, 0].size, ours)


def unknown_rows(model, w2, quick) -> None:
    """Print the rows of unknown views, and of one sequence."""
    some = w2[:: max(len(w2) // SAMPLED_UNKNOWN, 1), w2.shape[1] * 70 // 181][:SAMPLED_UNKNOWN]
    kept = [shown(model, a) for a in CIRCLE]
    repeats = 1 if quick else 20
    table = w2[..., 0, 0, 0].size / len(some)
    for approach in ("ls", "map"):
        name = f"unknown view, {approach.upper()}, {len(w2)} × {w2.shape[1]}"
        ours = seconds(lambda a=approach: find_view(model, w2, approach=a), 3)
        for words, given in ((name, None), (f"{name}, loop with cached projections", kept)):
            each = seconds(lambda a=approach, g=given: [scan_loop(model, y, a, g) for y in some], 2)
            print_row(words, each * table, ours)
        if approach == "ls":
            each = seconds(lambda: [optimiser(model, y) for y in some], 2)
            print_row(f"{name}, general optimiser from 4 sides", each * table, ours)
    one = seconds(lambda: scan_loop(model, some[0], "map"), 2)
    print_row("one sequence, unknown view, MAP", one, seconds(lambda: find_view(model, some[0]), repeats))
    anyhow = {"phase": "unknown", "scale": "unknown", "offset": "unknown"}
    ours = seconds(lambda: find_view(model, some[0], variance=None, **anyhow), repeats)
    print(f"| one sequence, unknown view, phase, scale and offset | | {ours:.3g} | |")
    ours = seconds(lambda: find_view(model, some[0], variance=None, elevation="unknown", **anyhow), 1 if quick else 5)
    print(f"| one sequence, the same and unknown elevation | | {ours:.3g} | |")


def main() -> None:
    """Print the table."""
    quick = Arguments(__doc__).parse_args().quick
    model = load("walk/prior")
    walkers, views = (1, VIEWS[::60]) if quick else (54, VIEWS)
    w2 = sequences(model, walkers, views)
    print(f"N = {len(model.components_)} components; the loops were timed on a part and extrapolated.\n")
    print("| task | loop [s] | ours [s] | ratio |\n|-|-|-|-|")
    known_rows(model, w2, views)
    unknown_rows(model, w2, quick)


if __name__ == "__main__":
    main()
