"""Imputation of motion cycles: functional PCA against its peers, each at the rank that is best on held-out blocks.

    motionenv bench models.imputation [--mocap FOLDER] [--seed 0]

scikit-fda runs in `--skfda-python`, as it needs multimethod<2, and is left out
if it isn't installed there. IterativeSVD (Troyanskaya et al. 2001) and SoftImpute (Mazumder et al. 2010) are
reimplemented below with fancyimpute's stopping rules, because fancyimpute 0.7 doesn't run with current scikit-learn.
Unlike fancyimpute they subtract column means first, which helps them.

Synthetic cycles: 19 channels of 128 samples; 10 smooth components (amplitude ~ (1 + h)^-1.5 at harmonic h) of rms 1,
with variances falling by 0.65; a smooth residual of rms 0.11 per cycle and channel; white noise of 0.08. 20 % is hidden
in blocks of 5 to 51 samples of one channel. Real cycles: all straight CMU walks, retargeted and segmented by
`motionenv.cycles`; 25 % of the seen samples is hidden. NRMSE is over hidden samples; the mean cycle has 1.
"""

import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np

from benchmarks import Arguments, has, headline
from benchmarks.captured_walks import straight_trials
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.types import ANGLES, Cycles

RANKS = (3, 5, 8, 12, 16)
SHRINKAGE = (0.005, 0.01, 0.02, 0.05, 0.1)  # of the largest singular value


def hide_blocks(values, share: float = 0.2, longest: float = 0.4, seed=None) -> np.ndarray:
    """A mask (K, P, m) of samples to hide: runs of one channel of one cycle, like occlusions.

    Args:
        values: (K, P, m), NaN where missing; blocks may overlap missing samples.
        share: share of samples to hide, from 0 to below 1.
        longest: length of the longest block [cycles]; the shortest is a quarter of it. Blocks wrap around the cycle.
        seed: int or Generator.
    """
    rng = np.random.default_rng(seed)
    k, p, m = np.shape(values)
    most = max(1, round(longest * p))
    hidden = np.zeros((k, m, p), dtype=bool)
    left = round(share * hidden.size)
    while left > 0:
        cycle, channel, first = rng.integers(k), rng.integers(m), rng.integers(p)
        n = min(rng.integers(max(1, most // 4), most + 1), left)
        block = np.arange(first, first + n) % p
        left -= n - np.count_nonzero(hidden[cycle, channel, block])
        hidden[cycle, channel, block] = True
    return hidden.transpose(0, 2, 1)


def imputation_error(truth, imputed, hidden) -> float:
    """Normalised root mean square error over `hidden` samples; the mean cycle has 1.

    Args:
        truth: (K, P, m), NaN where unknown.
        imputed: (K, P, m) imputed cycles.
        hidden: (K, P, m) mask of the hidden samples.
    """
    scored = hidden & np.isfinite(truth)
    mean = np.where(np.isfinite(truth), truth, 0).sum(axis=0) / np.maximum(np.isfinite(truth).sum(axis=0), 1)
    return float(np.sqrt(np.mean((truth - imputed)[scored] ** 2) / np.mean((truth - mean)[scored] ** 2)))


def ours(values, rank):
    """FunctionalPCA with pyppca's tolerance of 1e-4."""
    k, _, m = values.shape
    cycles = Cycles(values, tuple(f"a{i}" for i in range(m)), np.ones(k), np.arange(k), ("x",) * k)
    return FunctionalPCA(rank, tol=1e-4).fit(cycles).imputed_


def fig8(values, rank):
    """The paper's algorithm (our method="svd")."""
    k, _, m = values.shape
    cycles = Cycles(values, tuple(f"a{i}" for i in range(m)), np.ones(k), np.arange(k), ("x",) * k)
    return FunctionalPCA(rank, method="svd", residual_harmonics=0).fit(cycles).imputed_


def ppca(values, rank):
    """Package pyppca (Tipping & Bishop's EM, factorised). It needs numpy.matlib.repmat, which NumPy removed."""
    import types

    matlib = types.ModuleType("numpy.matlib")
    matlib.repmat = lambda a, rows, columns: np.tile(np.atleast_2d(a), (rows, columns))
    sys.modules["numpy.matlib"] = matlib
    import pyppca

    np.random.seed(0)  # noqa: NPY002 - pyppca uses the global generator
    flat = values.reshape(len(values), -1)
    return np.real(pyppca.ppca(flat, rank, False)[4]).reshape(values.shape)


def iterative_svd(values, rank):
    """Troyanskaya et al. 2001 as in fancyimpute: centred columns, rank doubling, stop at 1e-5, 200 iterations."""
    from sklearn.utils.extmath import randomized_svd

    flat = values.reshape(len(values), -1)
    missing, mean = np.isnan(flat), _mean(flat)
    x = np.where(missing, 0, flat - mean)
    for i in range(200):
        u, s, vt = randomized_svd(x, min(2**i, rank), random_state=0)
        new = (u * s) @ vt
        change, size = np.sum((x[missing] - new[missing]) ** 2), np.sum(x[missing] ** 2)
        x[missing] = new[missing]
        if size > 0 and change / size < 1e-5:
            break
    return (x + mean).reshape(values.shape)


def soft_impute(values, shrinkage):
    """Mazumder et al. 2010 as in fancyimpute: full SVD, singular values shrunk, stop at 1e-3, 100 iterations."""
    flat = values.reshape(len(values), -1)
    missing, mean = np.isnan(flat), _mean(flat)
    x = np.where(missing, 0, flat - mean)
    threshold = shrinkage * np.linalg.norm(x, 2)
    for _ in range(100):
        u, s, vt = np.linalg.svd(x, full_matrices=False)
        new = (u * np.maximum(s - threshold, 0)) @ vt
        change, size = np.linalg.norm(x[missing] - new[missing]), np.linalg.norm(x[missing])
        x[missing] = new[missing]
        if size > 0 and change / size < 1e-3:
            break
    return (x + mean).reshape(values.shape)


SKFDA = """
import sys, time, warnings
import numpy as np
warnings.simplefilter("ignore")
from skfda import FDataGrid
from skfda.preprocessing.dim_reduction import FPCA
folder, rank = sys.argv[1], int(sys.argv[2])
values = np.load(folder + "/values.npy")
start = time.perf_counter()
k, p, m = values.shape
full, grid = np.empty_like(values), np.arange(p)
mean = np.nanmean(values, axis=0)
for i in range(k):
    for a in range(m):
        seen = np.isfinite(values[i, :, a])
        full[i, :, a] = np.interp(grid, grid[seen], values[i, seen, a], period=p) if seen.any() else mean[:, a]
flat = FDataGrid(full.transpose(0, 2, 1).reshape(k, -1), np.arange(p * m))  # channels one after the other, as X(1)
model = FPCA(n_components=rank)
back = model.inverse_transform(model.fit_transform(flat)).data_matrix[..., 0].reshape(k, m, p).transpose(0, 2, 1)
np.save(folder + "/filled.npy", np.where(np.isnan(values), back, values))
print(time.perf_counter() - start)
"""


def skfda(values, rank, python):
    """scikit-fda's FPCA of linearly interpolated cycles; the time excludes start-up."""
    with tempfile.TemporaryDirectory() as folder:
        np.save(f"{folder}/values.npy", values)
        done = subprocess.run([python, "-c", SKFDA, folder, str(rank)], capture_output=True, text=True, check=True)
        return np.load(f"{folder}/filled.npy"), float(done.stdout)


def _mean(flat):
    """Column means of the seen samples, 0 without any."""
    seen = np.isfinite(flat)
    return np.where(seen, flat, 0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)


def synthetic(k, seed):
    """Synthetic cycles (k, 128, 19), described in the module's docstring."""
    rng = np.random.default_rng(seed)
    basis = sampled_basis(128, 20)
    harmonic = np.r_[0, np.arange(1, 20), np.arange(1, 20)]
    amplitude = (1.0 + harmonic) ** -1.5
    w = np.linalg.qr((rng.standard_normal((10, 39, 19)) * amplitude[:, None]).reshape(10, -1).T)[0].T.reshape(
        10, 39, 19
    )
    variance = 0.65 ** np.arange(10)
    scores = rng.standard_normal((k, 10)) * np.sqrt(variance / variance.sum() * 128 * 19)
    mean = rng.standard_normal((39, 19)) * amplitude[:, None] * np.sqrt(128)
    residual = 0.11 * np.sqrt(128) * amplitude / np.linalg.norm(amplitude)
    smooth = mean + np.tensordot(scores, w, axes=1) + rng.standard_normal((k, 39, 19)) * residual[:, None]
    return basis @ smooth + 0.08 * rng.standard_normal((k, 128, 19))


def real(mocap, most=None):
    """Complete cycles (K, 128, 19) [rad] of the straight CMU walks, of `most` at most."""
    from motionenv.cycles import segment
    from motionenv.mocap import read
    from motionenv.mocap.retargeting import retarget

    trials = straight_trials(mocap)[:most]
    angles = [retarget(read(mocap / "cmu_asfamc" / t[:2] / f"{t}.amc", fps=120.0)).angles for t in trials]
    cycles = segment(angles, 120.0, channels=ANGLES, subjects=[t[:2] for t in trials])
    return cycles.values[np.isfinite(cycles.values).all(axis=(1, 2))]


def best(method, values, truth, hidden, options, seed):
    """(option chosen on further hidden blocks, NRMSE, seconds of the final fit)."""
    further = hide_blocks(values, 0.15, seed=seed + 1000) & np.isfinite(values)
    tried = {}
    for option in options:
        filled = method(np.where(further, np.nan, values), option)
        filled = filled[0] if isinstance(filled, tuple) else filled
        tried[option] = imputation_error(values, filled, further)
    option = min(tried, key=tried.get)
    start = time.perf_counter()
    filled = method(values, option)
    seconds = time.perf_counter() - start
    if isinstance(filled, tuple):
        filled, seconds = filled
    return option, imputation_error(truth, filled, hidden), seconds


def compare(title, truth, share, seed, methods) -> float:
    """Print one table; return our error relative to that of the best peer."""
    hidden = hide_blocks(truth, share, seed=seed + 1)
    values = np.where(hidden, np.nan, truth)
    found = {name: best(method, values, truth, hidden, options, seed) for name, (method, options) in methods.items()}
    least = min(error for name, (_, error, _) in found.items() if name != "ours")
    print(f"\n{title}: K = {len(truth)}, {share:.0%} hidden, seed {seed}\n")
    print("| method | rank or shrinkage | NRMSE | relative to best peer | s |\n|-|-|-|-|-|")
    for name, (option, error, seconds) in found.items():
        print(f"| {name} | {option} | {error:.4f} | {error / least:.2f} | {seconds:.3f} |")
    return found["ours"][1] / least


def main() -> None:
    """Run all comparisons."""
    parser = Arguments(__doc__, mocap=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--skfda-python", default=sys.executable, help="a Python that has scikit-fda")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    methods = {
        "ours": (ours, RANKS),
        "fig. 8": (fig8, (5, 12)),
        "SoftImpute (reference)": (soft_impute, SHRINKAGE),
    }
    if has("pyppca"):
        methods["PPCA (pyppca)"] = (ppca, RANKS)
    if has("sklearn"):
        methods["IterativeSVD (reference)"] = (iterative_svd, RANKS)
    imports = "from skfda.preprocessing.dim_reduction import FPCA"  # which fails with multimethod 2, unlike the package
    if subprocess.run([arguments.skfda_python, "-c", imports], capture_output=True, check=False).returncode == 0:
        methods["scikit-fda after interpolation"] = (lambda v, q: skfda(v, q, arguments.skfda_python), RANKS)
    else:
        print(f"skipped: {arguments.skfda_python} has no FPCA of scikit-fda; --skfda-python names one that has")
    if arguments.quick:
        methods = {name: (method, options[:1]) for name, (method, options) in methods.items()}
    if arguments.mocap:
        error = compare(
            "CMU walks", real(arguments.mocap, 6 if arguments.quick else None), 0.25, arguments.seed, methods
        )
        headline(ratio=error, peers=len(methods) - 1)
    for k in (16,) if arguments.quick else (40, 400):
        compare("Synthetic", synthetic(k, arguments.seed), 0.2, arguments.seed, methods)


if __name__ == "__main__":
    main()
