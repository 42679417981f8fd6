"""Draws per second from the motion tree, n = 10⁴ to 5·10⁶, brute force and cKDTree; build time and memory.

    motionenv bench tree.speed [--mocap FOLDER] [--large] [--plot FILE]

Databases hold the capture without every fifth clip and, from 5·10⁴ windows on, variants of it (`capture.enlarged`).
Probes are windows of the held-out clips, with one draw each and β = 0.05 unless stated. All methods use two threads on
two cores. Each size runs in a separate process. "data" is the size of the database's poses and the tree's coefficients;
"peak" is the greatest resident memory during fitting, minus that before the database was built.
"""

import multiprocessing
import os
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benchmarks import headline, shortest
from benchmarks.tree.brute_force import compiled_draws, numpy_draws, transposed
from benchmarks.tree.capture import capture, enlarged, held_out, histories, options
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.model import MotionTree

SIZES, LARGE, AS_TOLD = (10_000, 50_000, 500_000), 5_000_000, 0.05
STATUS = Path("/proc/self/status")


def resident(what: str) -> float:
    """Resident memory [MB], "VmRSS" for the current and "VmHWM" for the peak; NaN without /proc."""
    if not STATUS.exists():
        return float("nan")
    return next(int(line.split()[1]) / 1e3 for line in STATUS.read_text().splitlines() if line.startswith(what))


def forget_highest() -> None:
    """Reset VmHWM."""
    if STATUS.exists():
        Path("/proc/self/clear_refs").write_text("5")


def fitted(clips: list[Clip], n: int, splits: str = "sign") -> tuple[MotionTree, dict[str, float]]:
    """A tree of about n windows, with the time and memory to build it."""
    MotionTree().fit_database(build_database(clips[:8]))  # compiles
    before, start = resident("VmRSS"), time.perf_counter()
    few = clips[::5] if n < 20_000 else clips
    database = build_database(enlarged(few, n))
    forget_highest()
    middle = time.perf_counter()
    model = MotionTree(splits=splits).fit_database(database)
    data = (database.poses.nbytes + model.index_.blocks.nbytes) / 1e6
    highest = resident("VmHWM") - before
    taken = {"database": middle - start, "fit": time.perf_counter() - middle, "data": data, "highest": highest}
    return model, taken


def draws_per_second(model: MotionTree, probes: np.ndarray, method: str, **settings) -> float:
    """Draws per second of `model` for `probes`."""
    beta, leaf = settings.get("beta", AS_TOLD), settings.get("leaf", "uniform")
    call = lambda: model.draw(probes, 1, beta, 1, method, leaf)
    call()
    return len(probes) / shortest(call, 5)


def of_size(clips: list[Clip], histories_: np.ndarray, n: int, most: int = 10_000) -> dict[str, float]:
    """All measurements for a database of about n windows."""
    model, found = fitted(clips, n)
    found["n"] = n = model.index_.n
    probes = model.coefficients(histories_)
    probes = np.ascontiguousarray(
        np.resize(probes[np.random.default_rng(0).permutation(len(probes))], (most, probes.shape[1]))
    )
    found["b"] = probes.shape[1]
    for batch in (300, 10_000):
        found[f"tree {batch}"] = draws_per_second(model, probes[:batch], "tree")
    found["kernel leaf"] = draws_per_second(model, probes, "tree", leaf="kernel")
    many = max(min(128, most), min(most, int(2e8 / n)))  # probes for the slow methods, to take about a second
    found["exact"] = draws_per_second(model, probes[:many], "exact")
    found |= brute_force(model.index_.coefficients(np.arange(n)), probes[:many])
    return found


def brute_force(z: np.ndarray, probes: np.ndarray) -> dict[str, float]:
    """Draws per second by brute force, and searches per second for 32 nearest neighbours by cKDTree."""
    both, u = transposed(z), np.random.default_rng(0).random(len(probes))
    found = {}
    for name, draw in (("numpy", numpy_draws), ("compiled", compiled_draws)):
        some = slice(len(probes) // 4 if name == "numpy" else None)
        draw(*both, probes[:8], AS_TOLD, u)
        found[name] = len(probes[some]) / shortest(lambda d=draw, s=some: d(*both, probes[s], AS_TOLD, u[s]), 2)
    nearest = cKDTree(z)
    found["cKDTree"] = len(probes) / shortest(lambda: nearest.query(probes, 32, workers=2), 1)
    return found


def by_temperature(clips: list[Clip], histories_: np.ndarray, most: int) -> None:
    """Print draws per second at several temperatures, for the capture without variants."""
    print("\n| β (n ≈ 40,000, 10,000 probes) | tree, uniform leaf | tree, median splits | tree, kernel leaf |")
    print("|-|-|-|-|")
    model, median = (
        MotionTree().fit_database(build_database(clips)),
        MotionTree(splits="median").fit_database(build_database(clips)),
    )
    probes = np.resize(model.coefficients(histories_), (most, model.descent_.depth))
    for beta in (0.002, 0.05, 0.2, 1.0):
        rates = [
            draws_per_second(model, probes, "tree", beta=beta),
            draws_per_second(median, probes, "tree", beta=beta),
            draws_per_second(model, probes, "tree", beta=beta, leaf="kernel"),
        ]
        print(f"| {beta:g} | {' | '.join(f'{r:,.0f}' for r in rates)} |", flush=True)


def tables(rows: list[dict[str, float]]) -> None:
    """Print draws per second, ratios, and the time and memory of building."""
    shown = {
        "tree 300": "tree, 300 probes",
        "tree 10000": "tree, 10,000 probes",
        "kernel leaf": "tree, kernel leaf, 10,000 probes",
        "exact": "exact: brute force in double precision",
        "compiled": "brute force, BLAS and compiled exponentials",
        "numpy": "brute force, NumPy",
        "cKDTree": "cKDTree, 32 neighbours (search only)",
    }
    heads = [f"n = {r['n']:,} (b = {r['b']})" for r in rows]
    print(f"| draws per second | {' | '.join(heads)} |\n|-|{'-|' * len(rows)}")
    for key, name in shown.items():
        print(f"| {name} | {' | '.join(f'{r[key]:,.0f}' for r in rows)} |")
    for peer in ("compiled", "numpy", "cKDTree"):
        ratios = [f"**{r['tree 10000'] / r[peer]:,.1f}×**" for r in rows]
        print(f"| {shown['tree 10000']} / {shown[peer]} | {' | '.join(ratios)} |")
    print("\n| windows | database from clips, s | fit, s | data, MB | peak, MB | (peak - data) / data |\n|-|-|-|-|-|-|")
    for r in rows:
        above = (r["highest"] - r["data"]) / r["data"]
        cells = [f"{r['n']:,}", *(f"{r[k]:.1f}" for k in ("database", "fit", "data", "highest")), f"{above:.2f}"]
        print(f"| {' | '.join(cells)} |")


def plot(rows: list[dict[str, float]], path: Path) -> None:
    """Plot draws per second over n, and write the figure to `path`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4), dpi=120, layout="constrained")
    axes = figure.subplots()
    for key in ("tree 10000", "tree 300", "kernel leaf", "exact", "compiled", "numpy", "cKDTree"):
        axes.loglog([r["n"] for r in rows], [r[key] for r in rows], "o-", label=key)
    axes.set(xlabel="windows n", ylabel="draws per second")
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(path)


def apart(clips: list[Clip], histories_: np.ndarray, n: int) -> dict[str, float]:
    """`of_size` in a separate process."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(of_size, (clips, histories_, n))


def main() -> None:
    """Print the tables."""
    asked = options(__doc__).parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    clips = capture(asked)
    probes = histories(held_out(clips)[1])[0]
    known = [c for i, c in enumerate(clips) if i % 5 != 4]
    if asked.quick:
        rows = [of_size(known, probes, n, most=64) for n in (200, 500)]
    else:
        rows = [apart(known, probes, n) for n in ((*SIZES, LARGE) if asked.large else SIZES)]
    tables(rows)
    headline(draws=rows[1]["tree 10000"] / 1e6, ratio=rows[1]["tree 10000"] / rows[1]["compiled"])
    if asked.plot:
        plot(rows, asked.plot)
    by_temperature(known, probes, 64 if asked.quick else 10_000)


if __name__ == "__main__":
    main()
