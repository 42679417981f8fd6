"""Ridge regression on few people, with the penalty chosen by leave-one-out cross-validation."""

import numpy as np


def shrunk_regression(z: np.ndarray, y: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Ridge regression of y (R,) on uncorrelated z (R, N): intercept, weights (N,), leave-one-out standard deviation.

    Of penalties with the least leave-one-out error, up to rounding, the largest wins; with N = R - 1 all are equal.
    """
    centre = y.mean()
    u, s, vt = np.linalg.svd(z - z.mean(axis=0), full_matrices=False)
    best: tuple[float, float] = (np.inf, 0.0)
    for penalty in len(y) * np.geomspace(1e3, 1e-3, 25):
        shrunk = s**2 / (s**2 + penalty)
        leverage = (u**2) @ shrunk + 1 / len(y)
        rest = (y - centre - u @ (shrunk * (u.T @ (y - centre)))) / np.maximum(1 - leverage, 1e-9)
        error = float(np.mean(rest**2))
        if error < best[0] * (1 - 1e-6):
            best = (error, float(penalty))
    weights = vt.T @ (s / (s**2 + best[1]) * (u.T @ (y - centre)))
    return float(centre - z.mean(axis=0) @ weights), weights, float(np.sqrt(best[0]))
