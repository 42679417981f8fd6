r"""Orthographic view geometry: paper B's view angle α, and an elevation ε by which the camera looks down on the walker.

Image axes and viewing direction in the walker's frame (x forward, y left, z up):

    across  r = (cos α, sin α, 0)                               (appendix B, eq. B.2)
    upwards u = (-sin α sin ε, cos α sin ε, cos ε)              z for a level view (eq. B.3)
    away    d = (-sin α cos ε, cos α cos ε, -sin ε)             the missing dimension

`motionenv.render.cameras.fit_view` places a pinhole camera at the same α and ε.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def axes(alpha: ArrayLike, elevation: ArrayLike = 0.0) -> np.ndarray:
    """Orthonormal rows across, upwards and away (..., 3, 3) of views at `alpha` and `elevation` (...) [rad]."""
    alpha, elevation = np.broadcast_arrays(np.asarray(alpha, dtype=np.float64), np.asarray(elevation, dtype=np.float64))
    (ca, sa), (ce, se) = ((np.cos(a), np.sin(a)) for a in (alpha, elevation))
    rows = [[ca, sa, np.zeros_like(ca)], [-sa * se, ca * se, ce], [-sa * ce, ca * ce, -se]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def project(coefficients: np.ndarray, alpha: ArrayLike, elevation: float | np.ndarray = 0.0) -> np.ndarray:
    """Orthographic projection C(α) w (eq. 3.5), (..., 5, 15, 2) [m] across and upwards, of points or Fourier series.

    `coefficients` are (..., 5, 15, 3) [m], `alpha` and `elevation` (...) [rad].
    """
    return np.einsum("...ij,...hmj->...hmi", axes(alpha, elevation)[..., :2, :], coefficients)


def depth(coefficients: np.ndarray, alpha: ArrayLike, elevation: float | np.ndarray = 0.0) -> np.ndarray:
    """The missing dimension (..., 5, 15) [m], positive away from the camera; arguments as of `project`.

    `coefficients` are (..., 5, 15, 3) [m], `alpha` and `elevation` (...) [rad].
    """
    return np.einsum("...j,...hmj->...hm", axes(alpha, elevation)[..., 2, :], coefficients)
