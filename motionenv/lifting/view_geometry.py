"""Orthographic view geometry: paper B's view angle α, and an elevation ε by which the camera looks down on the walker.

Image axes and viewing direction in the walker's frame (x forward, y left, z up):

    across  r = (cos α, sin α, 0)                               (appendix B, eq. B.2)
    upwards u = (-sin α sin ε, cos α sin ε, cos ε)              z for a level view (eq. B.3)
    away    d = (-sin α cos ε, cos α cos ε, -sin ε)             the missing dimension

`motionenv.render.cameras.fit_view` places a pinhole camera at the same α and ε. `project_markers` makes the 2D points
of a 3D walk, with the ground truth attached.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.render import cameras
from motionenv.types import MARKERS, Camera, Markers, Points


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
    """The missing dimension (..., 5, 15) [m], positive away from the camera; arguments as of `project`."""
    return np.einsum("...j,...hmj->...hm", axes(alpha, elevation)[..., 2, :], coefficients)


def project_markers(
    markers: Markers, alpha: float, *, elevation: float = 0.0, heading: float | None = None,
    camera: Camera | None = None,
) -> Points:  # fmt: skip
    """Project a 3D walk, first turned about the vertical to go along x (paper B's definition of the view angle).

    Args:
        markers, heading: as in `turned_to_x`; heading 0 leaves the walk as it is.
        alpha: view angle [rad]; see `motionenv.lifting.view_geometry`.
        elevation: angle [rad] by which the camera looks down on the walker, within ±π/2.
        camera: pinhole camera, for example `motionenv.render.cameras.fit_view` of the turned walk at `alpha` and
            `elevation`; the points are then in pixels, NaN outside of the image. None: orthographic, in metres.

    Returns:
        The points, with the turned walk as `truth`; if orthographic, as `motionenv.lift` tells it: x goes across the
        picture, y away and z up.

    Raises:
        MotionError: other markers, or an angle out of range.
        GapError: no heading is given, and it can't be estimated.
    """
    if not isinstance(markers, Markers) or markers.names != MARKERS or markers.positions.ndim != 3:
        raise MotionError(
            "markers must be one sequence of the 15 markers: make it with motionenv.mocap.retargeting.to_markers"
        )
    if not (math.isfinite(alpha) and abs(elevation) < math.pi / 2):
        raise MotionError(f"alpha must be finite and elevation within ±π/2 rad, got {alpha!r} and {elevation!r}")
    turned = turned_to_x(markers, heading)
    if camera is None:
        seen, unit = turned.positions @ axes(alpha, elevation)[:2].T, "m"
        turned = replace(turned, positions=turned.positions @ axes(alpha)[[0, 2, 1]].T)
    else:
        seen, unit = cameras.project(turned.positions, camera)[0], "px"
        inside = (seen >= -0.5) & (seen <= np.array([camera.width, camera.height]) - 0.5)
        seen = np.where(inside.all(axis=-1, keepdims=True), seen, np.nan)
    return Points(seen, markers.fps, unit, truth=turned, name=markers.name)


def turned_to_x(markers: Markers, heading: float | None = None) -> Markers:
    """Turn a walk, the 15 `markers` (frames, 15, 3) [m], about the vertical so that it goes along x.

    `heading` is the direction of travel, from x towards y [rad]; None estimates it with
    `motionenv.models.eigenwalkers.extraction.fourier_walker`.

    Raises:
        MotionError: `heading` isn't finite.
        GapError: no heading is given, and it can't be estimated.
    """
    heading = fourier_walker(markers).heading if heading is None else heading
    if not math.isfinite(heading):
        raise MotionError(f"heading must be a finite angle in radians, got {heading!r}")
    c, s = math.cos(heading), math.sin(heading)
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return Markers(markers.names, markers.positions @ back.T, markers.fps, name=markers.name)
