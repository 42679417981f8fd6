"""Share of variance in b principal components of windows, why it differs from paper C's 89 %, and speed of the PCA.

    motionenv bench tree.variance [--mocap FOLDER]

The peers are scikit-learn's. Shares for other preparations of the windows come from explicit windows and their
covariance.
"""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from benchmarks import has, shortest
from benchmarks.tree.capture import bounds, capture, enlarged, options
from motionenv.models.motion_tree.database import Clip, Database, build_database
from motionenv.models.motion_tree.features import FPS, WINDOW, parameters
from motionenv.models.motion_tree.search.basis import Basis, fit_basis, project
from motionenv.types import Motion

PAPER = 0.89
EVERYTHING, POSES = np.arange(50), np.arange(25)
PER_FRAME = np.repeat([1.0, FPS], 25)  # velocities as differences from frame to frame
ROOT_AND_LEGS = np.array([*range(6), *range(17, 25), *range(25, 31), *range(42, 50)])


def windows(database: Database, channels: np.ndarray, units=1.0) -> np.ndarray:
    """Every window of the database as a row (n, 10 p), divided by `units`, the oldest frame first, float32."""
    rows = [(parameters(database.poses[a:b]) / units)[:, channels] for a, b in zip(*bounds(database), strict=True)]
    view = np.lib.stride_tricks.sliding_window_view
    cut = [view(r, WINDOW, axis=0)[:-1].swapaxes(1, 2).reshape(-1, WINDOW * len(channels)) for r in rows]
    return np.concatenate(cut).astype(np.float32)


def spectrum(rows: np.ndarray, standardise: bool) -> np.ndarray:
    """Shares of the variance along the principal axes of `rows` (n, 10 p), largest first."""
    rows = rows - rows.mean(0)
    covariance = (rows.T @ rows).astype(float)
    if standardise:
        each = np.diag(covariance).reshape(WINDOW, -1).mean(0)
        scale = np.tile(np.sqrt(np.where(each > 1e-6 * each.max(), each, np.inf)), WINDOW)
        covariance /= scale[:, None] * scale
    values = np.linalg.eigvalsh(covariance)[::-1]
    return values / values.sum()


def smoothed(clip: Clip, cutoff: float) -> Clip:
    """The clip after a low-pass filter with a `cutoff` [Hz], forwards and backwards, so without delay."""
    m = clip.motion
    poses = sosfiltfilt(butter(2, cutoff, fs=m.fps, output="sos"), m.poses, axis=0)
    return Clip(Motion(poses, m.skeleton, m.fps, m.name), clip.name, clip.activity, clip.person)


def shares_table(clips: list[Clip]) -> None:
    """Print the share of variance in b components, for the default and other preparations of the windows."""
    whole = build_database(clips)
    b = int(np.log2(len(whole.windows)))
    active = [c for c in clips if c.activity in ("walk", "run", "dash")]
    rows = [
        ("default: each parameter divided by its standard deviation", whole, EVERYTHING, 0.0),
        ("… without velocities", whole, POSES, 0.0),
        ("… root and legs only", whole, ROOT_AND_LEGS, 0.0),
        ("… smoothed, 6 Hz", build_database(smoothed(c, 6.0) for c in clips), EVERYTHING, 0.0),
        ("… smoothed, 3 Hz", build_database(smoothed(c, 3.0) for c in clips), EVERYTHING, 0.0),
        ("… walking and running only", build_database(active or clips), EVERYTHING, 0.0),
        ("not standardised: m, rad, m/s, rad/s", whole, EVERYTHING, 1.0),
        ("… velocities per frame", whole, EVERYTHING, PER_FRAME),
        ("… without velocities", whole, POSES, 1.0),
    ]
    print(f"| {len(clips)} clips | windows | variance in b = {b} components | components for {PAPER:.0%} |\n|-|-|-|-|")
    print("| paper C | 50,000 | 89 % (b = 16) | 16 |")
    for name, database, channels, units in rows:
        raw = windows(database, channels, units if np.any(units) else 1.0)
        held = np.cumsum(spectrum(raw, standardise=not np.any(units)))
        needed = int(np.searchsorted(held, PAPER)) + 1
        print(f"| {name} | {len(database.windows):,} | {held[b - 1]:.1%} | {needed} |", flush=True)
    print(f"\n`fit_basis` itself gives {fit_basis(whole, EVERYTHING).share:.4%} for the first row.")


def ours(database: Database) -> tuple[Basis, np.ndarray]:
    """Basis and coefficients, by lag covariances."""
    basis = fit_basis(database, EVERYTHING)
    out = np.empty((len(database.windows), len(basis.deviation)), np.float32)
    project(database, basis, out)
    return basis, out


def speed_table(clips: list[Clip], n: int) -> None:
    """Print the time of basis and coefficients, and of scikit-learn on windows standardised beforehand."""
    if not has("sklearn"):
        return
    from sklearn.decomposition import PCA, IncrementalPCA

    database = build_database(enlarged(clips, n))
    ours(build_database(clips[:5]))  # compiles
    taken = shortest(lambda: ours(database))
    basis, _ = ours(database)
    axes, b = basis.components[:, ::-1].reshape(len(basis.deviation), -1), len(basis.deviation)
    rows = windows(database, EVERYTHING)
    rows -= np.tile(basis.mean, WINDOW).astype(np.float32)
    rows /= np.tile(basis.scale, WINDOW).astype(np.float32)
    peers = {
        "IncrementalPCA, batches of 2,500 (its default)": IncrementalPCA(b, batch_size=2500),
        "PCA, covariance_eigh": PCA(b, svd_solver="covariance_eigh"),
    }
    print(f"\n| {len(rows):,} windows of {rows.shape[1]}, b = {b} | s | ratio | smallest cosine to ours |\n|-|-|-|-|")
    print(f"| ours, from the poses (windows are never stored) | {taken:.2f} | 1.0 | |", flush=True)
    for name, model in peers.items():
        theirs = shortest(lambda m=model: m.fit(rows).transform(rows), 1)
        cosine = np.linalg.svd(axes @ model.components_.T)[1].min()
        print(f"| {name}, fit and transform | {theirs:.2f} | {theirs / taken:.1f} | {cosine:.4f} |", flush=True)
    print(f"\nThe windows for scikit-learn take {rows.nbytes / 1e6:,.0f} MB; the time to prepare them isn't counted.")


def main() -> None:
    """Print the tables."""
    asked = options(__doc__).parse_args()
    clips = capture(asked)
    shares_table(clips)
    speed_table(clips, 1_000 if asked.quick else 500_000)


if __name__ == "__main__":
    main()
