"""Rays in a world whose z points up, from pixels and what is known of the camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import MARKERS, Camera

#: Focal length of an unknown camera, in widths of the picture: 40 to 55 degrees across, as phones and webcams have.
_FOCAL = 1.15
_FOCAL_DEVIATION = (
    0.25  # of its logarithm: wide lenses of phones have 0.7 widths, and the picture may be wider than points
)
_UNDISTORTING = 20  # fixed-point iterations


@dataclass(frozen=True)
class Rays:
    """Rays from the camera to the markers.

    Attributes:
        directions: (frames, 15, 3) unit vectors in the world; NaN where a marker wasn't seen.
        origins: (frames, 3) [m] camera positions.
        posed: whether the camera's pose is known; else it stands upright at the origin and looks along y.
        focal: [pixels].
        focal_deviation: standard deviation of its logarithm.
    """

    directions: np.ndarray
    origins: np.ndarray
    posed: bool
    focal: float
    focal_deviation: float = 0.0


def rays_of(
    pixels: np.ndarray, camera: Camera | Sequence[Camera] | np.ndarray | None,
    distortion: Sequence[float] | None = None, elevation: float = 0.0,
) -> Rays:  # fmt: skip
    """Rays through `pixels` (frames, 15, 2), or more points of a body.

    Args:
        pixels: (frames, 15, 2), NaN where a marker wasn't seen. Of an unknown camera, the first 15 tell.
        camera: one camera, or one per frame; its intrinsics (3, 3) if nothing else is known; None if nothing is.
        distortion: OpenCV's coefficients (k1, k2, p1, p2[, k3[, k4, k5, k6]]).
        elevation: angle [rad] by which a camera of unknown pose looks down.

    Raises:
        MotionError: another number of cameras, or of coefficients.
    """
    frames = len(pixels)
    if isinstance(camera, Camera):
        cameras = [camera]
    elif camera is None or isinstance(camera, np.ndarray):
        inner = _guessed(pixels[:, : len(MARKERS)]) if camera is None else _checked_intrinsics(camera)
        down = np.array([[1.0, 0, 0], [0, -np.sin(elevation), -np.cos(elevation)],
                         [0, np.cos(elevation), -np.sin(elevation)]])  # fmt: skip
        cameras = [Camera(inner, down, np.zeros(3), 1, 1)]
    else:
        cameras = list(camera)
        if len(cameras) != frames or not all(isinstance(one, Camera) for one in cameras):
            raise MotionError(f"camera must be one Camera, or one for each of the {frames} frames, got {len(cameras)}")
    inverse = np.stack([np.linalg.inv(one.K) for one in cameras])
    rotation = np.stack([one.R for one in cameras])
    flat = np.concatenate([pixels, np.ones((*pixels.shape[:-1], 1))], axis=-1) @ inverse.swapaxes(1, 2)
    if distortion is not None:
        flat[..., :2] = _undistorted(flat[..., :2], distortion)
    directions = flat @ rotation
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    origins = np.broadcast_to(np.stack([one.centre for one in cameras]), (frames, 3))
    posed = camera is not None and not isinstance(camera, np.ndarray)
    return Rays(directions, origins, posed, float(cameras[0].K[0, 0]), 0.0 if camera is not None else _FOCAL_DEVIATION)


def _guessed(pixels: np.ndarray) -> np.ndarray:
    """Intrinsics of a usual camera whose picture is as large as the points need."""
    seen = pixels[np.isfinite(pixels).all(axis=-1)]
    low, high = seen.min(axis=0), seen.max(axis=0)
    focal = _FOCAL * max(high.max(), float(np.ptp(seen, axis=0).max()))
    middle = 0.5 * (low + high)
    return np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1.0]])


def _checked_intrinsics(inner: np.ndarray) -> np.ndarray:
    if inner.shape != (3, 3) or not np.isfinite(inner).all() or not inner[0, 0] > 0 < inner[1, 1]:
        raise MotionError(f"camera must be a Camera or intrinsics (3, 3) in pixels, got {np.asarray(inner).tolist()}")
    return inner


def _undistorted(points: np.ndarray, distortion: Sequence[float]) -> np.ndarray:
    """Ideal image points (..., 2) of distorted ones, by the fixed-point iteration of OpenCV's model."""
    given = np.asarray(distortion, dtype=float)
    if given.shape not in ((4,), (5,), (8,)) or not np.isfinite(given).all():
        raise MotionError(
            f"distortion must be 4, 5 or 8 finite numbers k1, k2, p1, p2[, k3[, k4, k5, k6]], got {given}"
        )
    k1, k2, p1, p2, k3, k4, k5, k6 = np.append(given, np.zeros(8 - len(given)))
    ideal = points.copy()
    for _ in range(_UNDISTORTING):
        x, y = ideal[..., 0], ideal[..., 1]
        square = x * x + y * y
        radial = (1 + square * (k1 + square * (k2 + square * k3))) / (1 + square * (k4 + square * (k5 + square * k6)))
        moved = np.stack([2 * p1 * x * y + p2 * (square + 2 * x * x), p1 * (square + 2 * y * y) + 2 * p2 * x * y], -1)
        ideal = (points - moved) / radial[..., None]
    return ideal
