"""Log score of the motion tree's prediction of the next pose of held-out clips, compared with simpler models.

    motionenv bench tree.prediction [--mocap FOLDER]

Every fifth clip is held out. A score is the log density of the true next pose in nats per frame (25 parameters,
position and heading as increments; metres and radians); higher is better. Intervals are 95 % bootstrap intervals over
clips, from 1,000 resamples. The tree's density is a mixture of 256 Gaussians about its predictions, as wide as these
err; as a Monte Carlo estimate, its logarithm is biased slightly downwards. The other models are fitted to the same
clips:

- constant velocity: the last velocity continues.
- Gaussian: pose and b coefficients are jointly Gaussian, which amounts to linear regression on the coefficients.
- autoregression: linear regression on the 50 parameters of the last frame.

The tree's Gaussians are diagonal. The other models are evaluated with diagonal and full covariance of their errors.
"""

import numpy as np

from benchmarks.tree.capture import capture, held_out, histories, options
from motionenv.models.motion_tree.features import FPS, PARTS, local, parameters, turned_towards
from motionenv.models.motion_tree.model import MotionTree

TEMPERATURES = (0.002, 0.05, 0.2, 1.0)
PIECE = 500


def regression(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Least-squares weights (k + 1, 25) of y (n, 25) on x (n, k) and a constant."""
    return np.linalg.lstsq(np.column_stack([x, np.ones(len(x))]), y, rcond=None)[0]


def log_densities(error: np.ndarray, learnt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Log densities of `error` (n, 25) under zero-mean Gaussians with diagonal and full covariance of `learnt`."""
    covariance = learnt.T @ learnt / len(learnt)
    found = []
    for c in (np.diag(np.diag(covariance)), covariance):
        root = np.linalg.cholesky(c)
        scaled = np.linalg.solve(root, error.T)
        found.append(-0.5 * (scaled**2).sum(0) - np.log(np.diag(root)).sum() - 12.5 * np.log(2 * np.pi))
    return found[0], found[1]


def baselines(model: MotionTree, learn, test) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Log densities (n,) of the other models by name, diagonal and full; `learn` and `test` are (histories, after)."""
    frames = [parameters(h)[:, -1] for h, _ in (learn, test)]
    truth = [turned_towards(local(h[:, -1], a), f[:, :25]) for (h, a), f in zip((learn, test), frames, strict=True)]
    steady = [f[:, :25] + f[:, 25:] / FPS for f in frames]
    for s, f in zip(steady, frames, strict=True):
        s[:, [0, 1, 5]] = f[:, [0, 1, 5]]
    coefficients = [model.coefficients(h).astype(float) for h, _ in (learn, test)]
    errors = {"constant velocity": [t - s for t, s in zip(truth, steady, strict=True)]}
    for name, x in (("Gaussian", coefficients), ("autoregression", frames)):
        weights = regression(x[0], truth[0])
        errors[name] = [t - np.column_stack([k, np.ones(len(k))]) @ weights for k, t in zip(x, truth, strict=True)]
    return {name: log_densities(test, learn) for name, (learn, test) in errors.items()}


def interval(score: np.ndarray, clip: np.ndarray) -> str:
    """Mean of scores (n,) and its 95 % bootstrap interval over clips (n,)."""
    _, number = np.unique(clip, return_inverse=True)
    sums, counts = np.bincount(number, score), np.bincount(number)
    drawn = np.random.default_rng(0).integers(len(sums), size=(1000, len(sums)))
    low, high = np.percentile(sums[drawn].sum(1) / counts[drawn].sum(1), [2.5, 97.5])
    return f"{score.mean():.1f} ({low:.1f} to {high:.1f})"


def log_density(tree: MotionTree, history: np.ndarray, after: np.ndarray, draws: int = 256, **asks) -> np.ndarray:
    """Log density (...) of the next local poses `after` (..., 25), per metre and radian; `asks` as of `sample`."""
    drawn, last = tree.sample(history, draws, carry=True, **asks), history[..., -1, :]
    chosen = np.array(PARTS[tree.part])
    error = local(last, after)[..., None, :] - local(last[..., None, :], drawn.poses)
    error = turned_towards(error, np.zeros(25))[..., chosen]
    deviation = tree.forecast_.deviation[chosen]
    each = -0.5 * ((error / deviation) ** 2).sum(-1) - np.log(deviation * np.sqrt(2 * np.pi)).sum()
    return np.logaddexp.reduce(each, axis=-1) - np.log(draws)


def main() -> None:
    """Print the table."""
    asked = options(__doc__).parse_args()
    database, others = held_out(capture(asked))
    model = MotionTree().fit_database(database)
    history, after, clip = histories(others, 20 if asked.quick else 3000)
    pieces = range(0, len(history), PIECE)
    print(f"n = {model.index_.n:,} windows; {len(history):,} frames of {len(np.unique(clip))} held-out clips.\n")
    print("| nats per frame | | full covariance |\n|-|-|-|")
    scores = {}
    for name, (diagonal, full) in baselines(model, histories(database)[:2], (history, after)).items():
        scores |= {name: diagonal, f"{name}, full": full}
        print(f"| {name} | {interval(diagonal, clip)} | {interval(full, clip)} |")
    for method in ("exact", "tree"):
        for temperature in TEMPERATURES:
            asks = {"temperature": temperature, "seed": 0, "method": method}
            parts = [log_density(model, history[a : a + PIECE], after[a : a + PIECE], **asks) for a in pieces]
            scores[f"{method}, {temperature:g}"] = np.concatenate(parts)
            print(
                f"| {method}, β = {temperature:g} | {interval(scores[f'{method}, {temperature:g}'], clip)} | |",
                flush=True,
            )
    print("\n| gain in nats per frame over | exact, β = 0.05 (default) | exact, β = 1 |\n|-|-|-|")
    for name in ("constant velocity", "Gaussian", "autoregression"):
        for peer in (name, f"{name}, full"):
            more = [interval(scores[k] - scores[peer], clip) for k in ("exact, 0.05", "exact, 1")]
            print(f"| {peer} | {' | '.join(more)} |")


if __name__ == "__main__":
    main()
