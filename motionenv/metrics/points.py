"""Errors of point estimates of the 15 joints: mean per-joint position error and variants (Ionescu et al. 2014).

Joints with unknown truth (NaN) are excluded from the mean; if the truth is known, an estimate with NaN gives NaN.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import MARKERS

_PELVIS = MARKERS.index("pelvis")


def mpjpe(estimate: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Mean per-joint position error (...) [m]: the mean Euclidean distance over the joints.

    Both `estimate` and `truth` are (..., 15, 3) [m] and broadcast; unknown truths are NaN.

    Raises:
        MotionError: another shape.
    """
    estimate, truth = _joints(estimate, truth)
    distance = np.linalg.norm(estimate - truth, axis=-1)
    known = np.isfinite(truth).all(axis=-1)
    with np.errstate(invalid="ignore"):
        return np.where(known, distance, 0.0).sum(axis=-1) / known.sum(axis=-1)


def pelvis_mpjpe(estimate: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """`mpjpe` (...) [m] after translating `estimate` and `truth` so that their pelvis markers, both known, coincide.

    Raises:
        MotionError: another shape than (..., 15, 3).
    """
    estimate, truth = _joints(estimate, truth)
    return mpjpe(estimate - estimate[..., [_PELVIS], :], truth - truth[..., [_PELVIS], :])


def aligned_mpjpe(estimate: np.ndarray, truth: np.ndarray, *, scale: bool = True) -> np.ndarray:
    """`mpjpe` (...) [m] after the similarity transform that brings `estimate` closest to `truth`.

    Least squares over the known joints, in closed form (Umeyama 1991, eq. 40-42); never a reflection. Without `scale`
    only rotation and translation are allowed.

    Raises:
        MotionError: another shape than (..., 15, 3).
    """
    estimate, truth = _joints(estimate, truth)
    known = np.isfinite(truth).all(axis=-1, keepdims=True)
    count = known.sum(axis=-2, keepdims=True)
    with np.errstate(invalid="ignore"):
        x, y = (
            np.where(known, a - np.where(known, a, 0.0).sum(-2, keepdims=True) / count, 0.0) for a in (estimate, truth)
        )
    usable = np.isfinite(x).all(axis=(-2, -1), keepdims=True) & (count > 0)
    x = np.where(usable, x, 0.0)
    u, s, vt = np.linalg.svd(np.swapaxes(y, -1, -2) @ x)
    mirrored = np.sign(np.linalg.det(u @ vt))
    signs = np.stack([np.ones_like(mirrored), np.ones_like(mirrored), mirrored], axis=-1)
    rotation = (u * signs[..., None, :]) @ vt
    size = (x**2).sum(axis=(-2, -1))
    factor = np.divide((s * signs).sum(axis=-1), size, out=np.ones_like(size), where=(size > 0) & scale)
    nearest = factor[..., None, None] * x @ np.swapaxes(rotation, -1, -2)
    return mpjpe(np.where(usable, nearest, np.nan), np.where(known, y, np.nan))


def _joints(estimate, truth) -> tuple[np.ndarray, np.ndarray]:
    """Both as float64 (..., 15, 3) of one shape."""
    estimate, truth = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    for name, points in (("estimate", estimate), ("truth", truth)):
        if points.shape[-2:] != (len(MARKERS), 3):
            raise MotionError(f"{name} must hold the 15 joints, (..., 15, 3), got {points.shape}")
    try:
        estimate, truth = np.broadcast_arrays(estimate, truth)
    except ValueError:
        raise MotionError(f"estimate and truth must broadcast, got {estimate.shape} and {truth.shape}") from None
    return estimate, truth
