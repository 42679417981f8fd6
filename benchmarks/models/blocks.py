"""Fitting models to more than memory holds: memory above the data, time, and whether the models are the same.

    motionenv bench models.blocks [--cycles 1000000] [--in-memory 64000] [--walkers 100000] [--clips 3000]

Functional PCA with q = 5 of synthetic cycles of 128 samples x 19 channels, 20 % missing (as of
`benchmarks.models.imputation`), 19.5 kB each: a million are 20 GB, written to --folder (by default, a temporary one)
first. Each fit runs in a process of its own. Memory is the peak of its resident set less what it was before the fit,
and that of the largest of its workers. The models of the same cycles are compared with the first one: the greatest
difference relative to the greatest entry.

Eigenwalkers, the walkers' prior and the tree are fitted to iterables, whose items are made when their turn comes:
walkers drawn from walk/eigenwalkers with 4 mm of noise, two of each person, and a minute at 30 frames/s per clip. Of
the tree, anonymous memory counts, as its database and coefficients lie in mapped files, whose pages the system may take
back.
"""

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import psutil

import motionenv
from benchmarks import Arguments
from benchmarks.models.imputation import hide_blocks
from motionenv.cycles import StoredCycles
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.fpca import FunctionalPCA
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.motion_tree import MotionTree
from motionenv.types import Cycles

CHANNELS = tuple(f"a{i}" for i in range(19))
PER_FILE = 4000
COMPARED = ("mean_", "components_", "explained_variance_", "noise_variance_", "residual_spectrum_")


def write(folder: Path, cycles: int) -> None:
    """Write files of 4,000 cycles each: ten smooth components, a smooth residual per cycle, white noise, and gaps."""
    basis = sampled_basis(128, 20)
    rng = np.random.default_rng(0)
    decay = np.sqrt(128) * (1 + np.r_[0, np.arange(1, 20), np.arange(1, 20)])[:, None] ** -1.5
    components = rng.standard_normal((10, 39, 19)) * decay * np.sqrt(0.65 ** np.arange(10))[:, None, None]
    masks = hide_blocks(np.zeros((PER_FILE, 128, 19)), 0.2, seed=1)
    for first in range(0, cycles, PER_FILE):
        rng = np.random.default_rng([1, first])
        n = min(PER_FILE, cycles - first)
        smooth = np.tensordot(rng.standard_normal((n, 10)), components, 1) / 3
        smooth[:, :15] += 0.11 * rng.standard_normal((n, 15, 19)) * decay[:15]
        values = basis @ smooth + 0.08 * rng.standard_normal((n, 128, 19))
        values[masks[rng.permutation(PER_FILE)[:n]]] = np.nan
        np.save(folder / f"{first:08d}.npy", values)


def fit(folder: str, files: int, kind: str, workers: int, method: str) -> dict:
    """Fit in this process; returns seconds, memory [bytes] and saves the model's arrays beside the files."""
    paths = sorted(Path(folder).glob("*.npy"))[:files]
    stored = StoredCycles(paths, CHANNELS)
    cycles = in_memory(stored) if kind == "memory" else stored
    FunctionalPCA(5, method=method).fit(in_memory(StoredCycles(paths[:1], CHANNELS)))  # compiles
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn")) if workers else None
    model, found = watched(lambda: FunctionalPCA(5, method=method).fit(cycles, executor=pool))
    if pool is not None:
        pool.shutdown()
    np.savez(Path(folder) / "model.npz", **{name: getattr(model, name) for name in COMPARED})
    return found | {"data": 8 * int(np.prod(stored.values.shape))}


def watched(work) -> tuple:
    """What `work()` returns, and its seconds, memory above that before, and that of its largest worker [bytes]."""
    process = psutil.Process()
    before, ended = (process.memory_info().rss, anonymous()), threading.Event()
    peaks = [0, 0, 0]

    def watch() -> None:
        while not ended.wait(0.02):
            peaks[0] = max(peaks[0], process.memory_info().rss - before[0])
            peaks[1] = max([peaks[1], *(child.memory_info().rss for child in process.children())])
            peaks[2] = max(peaks[2], anonymous() - before[1])

    watcher = threading.Thread(target=watch)
    watcher.start()
    start = time.perf_counter()
    result = work()
    seconds = time.perf_counter() - start
    ended.set()
    watcher.join()
    return result, {"seconds": seconds, "above": peaks[0], "worker": peaks[1], "anonymous": peaks[2]}


def anonymous() -> int:
    """Bytes of this process's memory that no file holds."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("RssAnon"))


def walkers(n: int):
    """Yield Fourier walkers, two of each person."""
    model, rng = motionenv.load("walk/eigenwalkers"), np.random.default_rng(0)
    for i in range(n):
        if i % 2 == 0:
            scores = rng.standard_normal(len(model.components_)) * np.sqrt(model.explained_variance_)
        w = model.inverse_transform(scores) + 0.004 * rng.standard_normal((5, 15, 3))
        yield FourierWalker(w, float(model.frequency(scores) * np.exp(0.03 * rng.standard_normal())))


def clips(n: int):
    """Yield motions of a minute."""
    base = motionenv.synthesize("walk/fpca", seconds=60, fps=30, seed=0)
    rng, t = np.random.default_rng(0), np.arange(len(base.poses))[:, None] / 30
    for _ in range(n):
        wave = 0.15 * np.sin(t * rng.uniform(0.3, 3, 25) + rng.uniform(0, 6, 25))
        wave[:, :3] *= 0.05
        yield replace(base, poses=base.poses + wave)


def fit_stream(kind: str, n: int) -> dict:
    """Fit a model to `n` walkers or clips, as they come."""
    made = {"Eigenwalkers": Eigenwalkers, "WalkerPrior": WalkerPrior, "MotionTree": MotionTree}[kind]
    items = clips if kind == "MotionTree" else walkers
    subjects = None if kind == "MotionTree" else [str(i // 2) for i in range(n)]
    made().fit(items(min(n, 200)), None)  # compiles
    start = time.perf_counter()
    for _ in items(n):
        pass
    making = time.perf_counter() - start
    found = watched(lambda: made().fit(items(n), subjects))[1]
    data = n * (1800 * 25 * 8 if kind == "MotionTree" else 225 * 8)
    return found | {"seconds": found["seconds"] - making, "data": data}


def in_memory(stored: StoredCycles) -> Cycles:
    """Cycles read into memory."""
    k = len(stored.values)
    return Cycles(stored.values[:], CHANNELS, np.ones(k), np.arange(k), stored.subject)


def measured(apart: bool, function: Callable, *arguments) -> dict:
    """What `fit` or `fit_stream` measures, in a new process if `apart`."""
    if not apart:
        return function(*arguments)
    call = f"{function.__name__}(*{arguments!r})"
    code = f"import json; from benchmarks.models.blocks import *; print(json.dumps({call}))"
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, check=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Write the cycles and print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--cycles", type=int, default=1_000_000, quick=16)
    parser.add_argument("--in-memory", type=int, default=64_000, quick=16)
    parser.add_argument("--walkers", type=int, default=100_000, quick=20)
    parser.add_argument("--clips", type=int, default=3000, quick=1)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        write(folder, given.cycles)
        some, every = (str(-(-n // PER_FILE)) for n in (given.in_memory, given.cycles))
        rows = [("memory", some, 0), ("files", some, 0), ("files", some, 1), ("files", some, 2), ("files", every, 0)]
        print("| cycles | method | from | worker processes | µs per cycle | above, MB | above / data | difference |")
        print("|-|-|-|-|-|-|-|-|", flush=True)
        for method in ("ppca", "svd"):
            first = None
            for kind, files, workers in rows:
                found = measured(not given.quick, fit, str(folder), int(files), kind, workers, method)
                model = dict(np.load(folder / "model.npz"))
                first = model if first is None else first
                same = max(np.abs(model[n] - first[n]).max() / np.abs(first[n]).max() for n in COMPARED)
                cycles = found["data"] // (8 * 128 * 19)
                beside = f" + {found['worker'] / 1e6:.0f} each" if workers else ""
                print(
                    f"| {cycles:,} | {method} | {kind} | {workers or '-'} | {found['seconds'] / cycles * 1e6:.0f} | "
                    f"{found['above'] / 1e6:.0f}{beside} | {found['above'] / found['data']:.2f} | "
                    + ("" if files != some else f"{same:.0e}") + " |",
                    flush=True,
                )  # fmt: skip
    print("\n| model | fitted to | µs each | above, MB | data, MB |\n|-|-|-|-|-|", flush=True)
    for kind, n, unit in (
        ("Eigenwalkers", given.walkers, "walkers"),
        ("WalkerPrior", given.walkers, "walkers"),
        ("MotionTree", given.clips, "clips"),
    ):
        found = measured(not given.quick, fit_stream, kind, n)
        above = found["anonymous" if kind == "MotionTree" else "above"]
        each, data = found["seconds"] / n * 1e6, found["data"]
        print(f"| {kind} | {n:,} {unit} | {each:.0f} | {above / 1e6:.0f} | {data / 1e6:,.0f} |", flush=True)


if __name__ == "__main__":
    main()
