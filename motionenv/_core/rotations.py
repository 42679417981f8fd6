"""Rotations as matrices, (..., 3, 3), mapping local to parent coordinates. Angles in radians."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

_AXES = {"X": 0, "Y": 1, "Z": 2}


def from_euler(order: str, angles: ArrayLike) -> np.ndarray:
    """Product (..., 3, 3) of rotations by `angles` (..., n) [rad] about the n axes of `order`, left to right.

    "YXZ" is R_y(a₀) R_x(a₁) R_z(a₂): the intrinsic order, as BVH channels are.
    """
    from scipy.spatial.transform import Rotation  # takes 50 ms, which walks that are synthesised don't need

    angles = np.asarray(angles, dtype=np.float64)
    turned = Rotation.from_euler(order, angles.reshape(-1, len(order))).as_matrix()
    return turned.reshape(*angles.shape[:-1], 3, 3)


def from_rotation_vector(vectors: ArrayLike) -> np.ndarray:
    """Rotations (..., 3, 3) about the directions of `vectors` (..., 3) by their lengths [rad]."""
    from scipy.spatial.transform import Rotation

    vectors = np.asarray(vectors, dtype=np.float64)
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


def to_euler(order: str, rotations: ArrayLike) -> np.ndarray:
    """Angles (..., 3) [rad] with `from_euler(order, angles) == rotations`, the middle one within ±π/2.

    `order` names three different axes. Where the middle angle is ±π/2 only the sum or the difference of the
    others is defined; the last is then 0. SciPy's `Rotation` warns there, and refuses NaN, which is a gap here.
    """
    rotations = np.asarray(rotations, dtype=np.float64)
    i, j, k = (_AXES[a] for a in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    middle = np.arcsin(np.clip(sign * rotations[..., i, k], -1.0, 1.0))
    first = np.arctan2(-sign * rotations[..., j, k], rotations[..., k, k])
    last = np.arctan2(-sign * rotations[..., i, j], rotations[..., i, i])
    locked = np.abs(rotations[..., i, k]) > 1.0 - 1e-12
    first = np.where(locked, np.arctan2(sign * rotations[..., k, j], rotations[..., j, j]), first)
    return np.stack([first, middle, np.where(locked, 0.0, last)], axis=-1)


def unwrap_euler(angles: ArrayLike) -> np.ndarray:
    """The same rotations (..., frames, 3) [rad] with the branch nearest to the frame before: no jumps of π or 2π.

    Three Euler angles (a, b, c) of different axes and (a + π, π - b, c + π) are one rotation; the nearer
    branch is taken frame by frame, and of the two continuous results the one whose median middle angle is smaller.
    NaN frames stay NaN and the next known frame follows the last known one.
    """
    angles = np.array(angles, dtype=np.float64)
    for sequence in angles.reshape(-1, *angles.shape[-2:]):
        _unwrap(sequence)
    return angles


def _unwrap(angles: np.ndarray) -> None:
    """`unwrap_euler` of one sequence (frames, 3), in place."""
    known = np.isfinite(angles).all(-1)
    if not known.any():
        return
    smooth = angles[known]
    if _jumps(smooth):
        smooth = _without_jumps(smooth)
    if np.median(np.abs(smooth[:, 1])) > math.pi / 2:
        smooth = np.array([1.0, -1.0, 1.0]) * smooth + math.pi
    angles[known] = smooth - 2 * math.pi * np.round(np.median(smooth, axis=0) / (2 * math.pi))


def _jumps(angles: np.ndarray) -> bool:
    """Whether `_without_jumps` would change anything in angles (frames, 3), as it does of few people who walk."""
    before = np.concatenate([np.zeros((1, 3)), angles[:-1]])
    near = angles - before
    far = math.pi + np.array([1.0, -1.0, 1.0]) * angles - before
    far -= 2 * math.pi * np.round(far / (2 * math.pi))
    return bool((np.abs(near) >= math.pi).any() or (np.abs(far).sum(1) <= np.abs(near).sum(1)).any())


def _without_jumps(angles: np.ndarray) -> np.ndarray:
    """Angles (frames, 3) on the branch nearest to the frame before, the first nearest to 0."""
    a0 = b0 = c0 = 0.0
    out = []
    for a, b, c in angles.tolist():  # plain floats: a frame costs 1 µs, and arrays of three 20
        near = (_near(a, a0), _near(b, b0), _near(c, c0))
        far = (_near(a + math.pi, a0), _near(math.pi - b, b0), _near(c + math.pi, c0))
        near_gap = abs(near[0] - a0) + abs(near[1] - b0) + abs(near[2] - c0)
        far_gap = abs(far[0] - a0) + abs(far[1] - b0) + abs(far[2] - c0)
        a0, b0, c0 = far if far_gap < near_gap else near
        out.append((a0, b0, c0))
    return np.array(out)


def _near(angle: float, to: float) -> float:
    """`angle` plus the whole turns that bring it nearest `to`."""
    return angle - 2 * math.pi * round((angle - to) / (2 * math.pi))


def nearest(matrices: ArrayLike) -> np.ndarray:
    """The rotation nearest to each matrix (..., 3, 3) in the Frobenius norm; NaN where a matrix has NaN.

    SciPy's `Rotation.align_vectors` finds one at a time, which takes 50 times as long for a capture's frames.
    """
    matrices = np.asarray(matrices, dtype=np.float64)
    known = np.isfinite(matrices).all((-2, -1))
    u, _, vt = np.linalg.svd(np.where(known[..., None, None], matrices, np.eye(3)))
    u = u * np.stack([np.ones_like(u[..., 0, 0]), np.ones_like(u[..., 0, 0]), np.linalg.det(u @ vt)], -1)[..., None, :]
    return np.where(known[..., None, None], u @ vt, np.nan)
