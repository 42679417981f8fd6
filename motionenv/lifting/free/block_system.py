"""A symmetric positive definite linear system over frames, in which frames two apart are coupled by few unknowns."""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from motionenv.errors import MotionError


def solve(
    diagonal: np.ndarray, next_: np.ndarray, second: np.ndarray, few: slice, right: np.ndarray, covariance: bool = False
) -> tuple[np.ndarray, np.ndarray | None]:
    """The solution (frames, n) and, on request, each frame's covariance (frames, n, n), which is part of the inverse.

    Frame after frame is eliminated, then substituted backwards. What a frame depends on is all of the next one and,
    in the second next one, the few unknowns that couple with it.

    Args:
        diagonal: (frames, n, n) of each frame; changed in place.
        next_: (frames - 1, n, n) between a frame (rows) and the next one (columns); changed in place.
        second: (frames - 2, m, m) between the few unknowns of a frame (rows) and those of the second next one.
        few: which m of the n unknowns these are.
        right: (frames, n).
        covariance: whether to compute covariances.

    Raises:
        MotionError: the system isn't positive definite.
    """
    values = right.copy()
    factors, gains = _eliminated(diagonal, next_, second, few, values)
    frames = len(values)
    for k in range(frames - 1, -1, -1):
        values[k] = dpotrs(factors[k], values[k], lower=True)[0]
        if k < frames - 1:
            values[k] -= gains[k] @ _later(values, k, few)
    return values, _covariances(factors, gains, few) if covariance else None


def _later(values: np.ndarray, k: int, few: slice) -> np.ndarray:
    """What frame `k` depends on: the values of the next frame, and the few of the second next one."""
    return np.concatenate([values[k + 1], values[k + 2, few]]) if k + 2 < len(values) else values[k + 1]


def _eliminated(own, next_, second, few: slice, values) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Cholesky factors of the eliminated frames, and gains on what they depend on; arguments change in place."""
    frames, n = values.shape
    factors: list[np.ndarray] = []
    gains: list[np.ndarray] = []
    coupling = np.zeros((n, n + second.shape[-1]))
    for k in range(frames):
        factor, failed = dpotrf(own[k], lower=True)
        if failed:
            raise MotionError("the frames don't determine a motion: give more points, or a longer stretch")
        factors.append(factor)
        if k == frames - 1:
            break
        coupling[:, :n] = next_[k]
        if k < frames - 2:
            coupling[few, n:] = second[k]
        else:
            coupling = coupling[:, :n]
        gain = dpotrs(factor, coupling, lower=True)[0]
        gains.append(gain)
        product = coupling.T @ gain
        own[k + 1] -= product[:n, :n]
        values[k + 1] -= gain[:, :n].T @ values[k]
        if k < frames - 2:
            next_[k + 1][:, few] -= product[:n, n:]
            own[k + 2][few, few] -= product[n:, n:]
            values[k + 2, few] -= gain[:, n:].T @ values[k]
    return factors, gains


def _covariances(factors: list[np.ndarray], gains: list[np.ndarray], few: slice) -> np.ndarray:
    """Diagonal blocks of the inverse (frames, n, n), from the last frame backwards."""
    frames, n = len(factors), len(factors[0])
    out = np.empty((frames, n, n))
    later = np.zeros((0, 0))  # covariance of what the frame depends on
    for k in range(frames - 1, -1, -1):
        out[k] = dpotrs(factors[k], np.eye(n), lower=True)[0]
        if k == frames - 1:
            later = out[k]
            continue
        across = -gains[k] @ later
        out[k] -= across @ gains[k].T
        shared = across[:, :n][:, few]
        later = np.block([[out[k], shared], [shared.T, out[k + 1][few, few]]])
    return out
