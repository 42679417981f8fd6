"""A symmetric positive definite linear system over frames, in which only frames up to two apart are coupled."""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from motionenv.errors import MotionError


def solve(
    diagonal: np.ndarray, next_: np.ndarray, second: np.ndarray, right: np.ndarray, covariance: bool = False
) -> tuple[np.ndarray, np.ndarray | None]:
    """The solution (frames, n) and, on request, each frame's covariance (frames, n, n), which is part of the inverse.

    Pairs of frames make a block-tridiagonal system, which is eliminated forwards and substituted backwards.

    Args:
        diagonal: (frames, n, n) of each frame.
        next_: (frames - 1, n, n) between a frame (rows) and the next one (columns).
        second: (frames - 2, n, n) between a frame and the second next one.
        right: (frames, n).
        covariance: whether to compute covariances.

    Raises:
        MotionError: the system isn't positive definite.
    """
    frames, n = right.shape
    own, coupling, values = _paired(diagonal, next_, second, right)
    factors, gains = _eliminated(own, coupling, values)
    for k in range(len(own) - 1, -1, -1):
        values[k] = dpotrs(factors[k], values[k], lower=True)[0]
        if k < len(coupling):
            values[k] -= gains[k] @ values[k + 1]
    solution = values.reshape(-1, n)[:frames]
    return solution, _covariances(factors, gains, n)[:frames] if covariance else None


def _eliminated(own, coupling, values) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Cholesky factors of the eliminated pairs, and gains on the next ones; `values` are changed in place."""
    factors: list[np.ndarray] = []
    gains: list[np.ndarray] = []
    carried = own[0]
    for k in range(len(own)):
        if k:
            carried = own[k] - coupling[k - 1].T @ gains[-1]
            values[k] -= gains[-1].T @ values[k - 1]
        factor, failed = dpotrf(carried, lower=True)
        if failed:
            raise MotionError("the frames don't determine a motion: give more points, or a longer stretch")
        factors.append(factor)
        if k < len(coupling):
            gains.append(dpotrs(factor, coupling[k], lower=True)[0])
    return factors, gains


def _covariances(factors: list[np.ndarray], gains: list[np.ndarray], n: int) -> np.ndarray:
    """Diagonal blocks of the inverse (frames, n, n), from the last pair backwards."""
    inverse, out = np.zeros((0, 0)), np.empty((len(factors), 2, n, n))
    for k in range(len(factors) - 1, -1, -1):
        later = gains[k] @ inverse @ gains[k].T if k < len(gains) else 0.0
        inverse = dpotrs(factors[k], np.eye(2 * n), lower=True)[0] + later
        out[k] = inverse[:n, :n], inverse[n:, n:]
    return out.reshape(-1, n, n)


def _paired(diagonal, next_, second, right) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks of pairs of frames: their own (pairs, 2 n, 2 n), to the next pair, and right sides (pairs, 2 n)."""
    frames, n = right.shape
    pairs = (frames + 1) // 2
    own, coupling = np.zeros((pairs, 2 * n, 2 * n)), np.zeros((pairs - 1, 2 * n, 2 * n))
    values = np.zeros((pairs, 2 * n))
    own[:, :n, :n] = diagonal[::2]
    own[: frames // 2, n:, n:] = diagonal[1::2]
    if frames % 2:
        own[-1, n:, n:] = np.eye(n)  # a frame that doesn't exist
    own[: frames // 2, :n, n:] = next_[::2]
    own[: frames // 2, n:, :n] = next_[::2].swapaxes(1, 2)
    coupling[:, n:, :n] = next_[1::2]
    coupling[:, :n, :n] = second[::2]
    coupling[: len(second[1::2]), n:, n:] = second[1::2]
    values[:, :n] = right[::2]
    values[: frames // 2, n:] = right[1::2]
    return own, coupling, values
