"""Ridge regression with few people: how much to shrink is what predicts people left out best."""

import numpy as np


def shrunk_regression(z: np.ndarray, y: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Ridge regression of y (R,) on uncorrelated z (R, N): mean, weights (N,), and the deviation of left-out people.

    The penalty is the one under which each person is best predicted from all others (closed form by the hat matrix).
    With as many components as there are people less one that says nothing, for then the error is the same under every
    penalty; so of penalties that are as good but for rounding the largest counts.

    Args:
        z: (R, N).
        y: (R,).
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
