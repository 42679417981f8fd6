"""Rotations as matrices, (..., 3, 3), mapping local to parent coordinates. Angles in radians."""

import numpy as np

_AXES = {"X": 0, "Y": 1, "Z": 2}


def about(axis: str, angle) -> np.ndarray:
    """Rotation by `angle` (...) [rad] about the coordinate axis "X", "Y" or "Z": (..., 3, 3)."""
    angle = np.asarray(angle, dtype=np.float64)
    c, s = np.cos(angle), np.sin(angle)
    i = _AXES[axis]
    j, k = (i + 1) % 3, (i + 2) % 3
    out = np.zeros((*angle.shape, 3, 3))
    out[..., i, i] = 1.0
    out[..., j, j] = out[..., k, k] = c
    out[..., j, k], out[..., k, j] = -s, s
    return out


def from_euler(order: str, angles) -> np.ndarray:
    """Product of rotations about the axes of `order`, left to right: "YXZ" is R_y(a₀) R_x(a₁) R_z(a₂).

    Args:
        order: one letter of X, Y, Z per angle (intrinsic order, as BVH channels are).
        angles: (..., len(order)) [rad].

    Returns:
        (..., 3, 3).
    """
    angles = np.asarray(angles, dtype=np.float64)
    out = about(order[0], angles[..., 0])
    for i, axis in enumerate(order[1:], 1):
        out = out @ about(axis, angles[..., i])
    return out


def to_euler(order: str, rotations) -> np.ndarray:
    """Angles (..., 3) [rad] with `from_euler(order, angles) == rotations`, the middle one within ±π/2.

    `order` names three different axes. Where the middle angle is ±π/2 only the sum or the difference of the
    others is defined; the last is then 0.
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


def unwrap_euler(angles) -> np.ndarray:
    """The same rotations over time with the branch nearest to the frame before: no jumps of π or 2π.

    Three Euler angles (a, b, c) of different axes and (a + π, π - b, c + π) are one rotation; the nearer
    branch is taken frame by frame, and of the two continuous results the one whose median middle angle is smaller.
    NaN frames stay NaN and the next known frame follows the last known one.

    Args:
        angles: (..., frames, 3) [rad].
    """
    angles = np.array(angles, dtype=np.float64)
    last = np.zeros((*angles.shape[:-2], 3))
    for t in range(angles.shape[-2]):
        now = angles[..., t, :]
        both = np.stack([now, _other_branch(now)])
        both = both - 2 * np.pi * np.round((both - last) / (2 * np.pi))
        nearer = np.abs(both - last).sum(-1)
        best = np.where((nearer[1] < nearer[0])[..., None], both[1], both[0])
        angles[..., t, :] = best
        last = np.where(np.isnan(best), last, best)
    middle = _median(np.abs(angles[..., 1]))
    angles = np.where((middle > np.pi / 2)[..., None, None], _other_branch(angles), angles)
    return angles - 2 * np.pi * np.round(_median(np.moveaxis(angles, -2, -1))[..., None, :] / (2 * np.pi))


def _other_branch(angles: np.ndarray) -> np.ndarray:
    """The other three angles (..., 3) that make the same rotation."""
    return np.stack([angles[..., 0] + np.pi, np.pi - angles[..., 1], angles[..., 2] + np.pi], axis=-1)


def _median(values: np.ndarray) -> np.ndarray:
    """Median over the last axis of what is known; 0 where nothing is."""
    known = ~np.isnan(values)
    ordered = np.sort(values, axis=-1)  # NaN last
    middle = np.take_along_axis(ordered, np.maximum(known.sum(-1, keepdims=True) - 1, 0) // 2, axis=-1)[..., 0]
    return np.where(known.any(-1), middle, 0.0)


def nearest(matrices) -> np.ndarray:
    """The rotation nearest to each matrix (..., 3, 3) in the Frobenius norm; NaN where a matrix has NaN."""
    matrices = np.asarray(matrices, dtype=np.float64)
    known = np.isfinite(matrices).all((-2, -1))
    u, _, vt = np.linalg.svd(np.where(known[..., None, None], matrices, np.eye(3)))
    u = u * np.stack([np.ones_like(u[..., 0, 0]), np.ones_like(u[..., 0, 0]), np.linalg.det(u @ vt)], -1)[..., None, :]
    return np.where(known[..., None, None], u @ vt, np.nan)
