"""Cubic regression splines on one cycle (Ormoneit et al. 2005, appendix A), and least squares on them with gaps.

The knots are fixed at 0.1, 0.2, ..., 0.9. The paper's basis of truncated powers (with φ₀, so K + 1 = 13 functions) has
a condition number near 7e4; B-splines span the same space and are used instead. The periodically constrained splines
(value, first and second derivative equal at 0 and 1; 10 functions) are the periodic B-splines on the same knots: the
same space as appendix A's Φ(x)ᵀU₂.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from motionenv.errors import MotionError

#: Spacing of the knots [cycles].
SPACING = 0.1
_CLAMPED = np.concatenate([np.zeros(3), np.arange(11) / 10, np.ones(3)])


def spline_basis(x: ArrayLike) -> np.ndarray:
    """The unconstrained spline functions of appendix A at phases `x` (n,) in [0, 1], as B-splines: (n, 13).

    Raises:
        MotionError: a phase outside [0, 1], or not a number.
    """
    x = np.atleast_1d(np.asarray(x, dtype=np.float64))
    if x.ndim != 1 or not ((x >= 0) & (x <= 1)).all():
        raise MotionError("x must be a one-dimensional array of phases from 0 to 1")
    return BSpline.design_matrix(x, _CLAMPED, 3).toarray() if len(x) else np.zeros((0, 13))


def periodic_basis(x: ArrayLike) -> np.ndarray:
    """The periodically constrained spline functions of appendix A at phases `x` (n,): (n, 10); `x` wraps at 1.

    Function k is the cardinal cubic B-spline centred at phase k / 10.
    """
    distance = np.mod(np.atleast_1d(np.asarray(x, dtype=np.float64))[:, None] / SPACING - np.arange(10) + 5, 10) - 5
    far = np.abs(distance)
    return np.where(far < 1, 2 / 3 - far**2 + far**3 / 2, np.maximum(2 - far, 0) ** 3 / 6)


def outer_products(basis: np.ndarray) -> np.ndarray:
    """All products of two functions, (n, K²), from which weights give every Gram matrix by one product."""
    return (basis[:, :, None] * basis[:, None, :]).reshape(len(basis), -1)


def solve(gram: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Coefficients (K, m) of the normal equations (m, K, K), (m, K); the minimum-norm solution if they are singular."""
    inverse = np.linalg.pinv(gram, rcond=1e-11, hermitian=True)
    return np.einsum("akl,al->ka", inverse, right)
