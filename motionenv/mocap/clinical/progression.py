"""The direction of progression: the frame against which a laboratory reports pelvis and feet."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

_WALKS = 0.3  # [m] least way for a direction of travel
_STRAIGHT = 0.9  # least ratio of net displacement to the length of the path
_AXIS = np.radians(15.0)  # laboratories align their walkway with an axis; within this the axis is the direction
_SECONDS = 0.5  # standard deviation of the smoothing of a curved path's direction


def progression(pelvis: np.ndarray, rotation: np.ndarray, fps: float, *, axes: bool = True) -> np.ndarray:
    """Rotation of the frame of progression to the world (frames, 3, 3), x forward and z up, at `fps` [Hz].

    Of a straight walk, the direction is that of travel or, within 15 degrees of it, the laboratory's axis, as in
    Plug-in Gait. Of a curved one it is the direction of travel at each time, and of who stands the laboratory's axis
    that the `pelvis`, with origin (frames, 3) [m] and `rotation` (frames, 3, 3), segment → world, faces. Without the
    laboratory's `axes`, as of a film, these directions are as they are.
    """
    known = np.isfinite(pelvis).all(-1) & np.isfinite(rotation).all((-1, -2))
    if not known.any():
        return np.full((len(pelvis), 3, 3), np.nan)
    path = _between(pelvis[:, :2], known)
    smooth = gaussian_filter1d(path, _SECONDS * fps, axis=0, mode="nearest")
    length = np.linalg.norm(np.diff(smooth, axis=0), axis=-1).sum()
    net = smooth[-1] - smooth[0]
    if length < _WALKS:
        angles = np.full(len(path), _snapped(rotation[known, :2, 0].mean(0), np.pi / 4 if axes else 0.0))
    elif np.linalg.norm(net) >= _STRAIGHT * length:
        angles = np.full(len(path), _snapped(net, _AXIS if axes else 0.0))
    else:
        way = np.gradient(smooth, axis=0)
        angles = np.arctan2(way[:, 1], way[:, 0])
    c, s, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _between(path: np.ndarray, known: np.ndarray) -> np.ndarray:
    frames = np.arange(len(path))
    return np.stack([np.interp(frames, frames[known], path[known, i]) for i in (0, 1)], -1)


def _snapped(way: np.ndarray, within: float) -> float:
    """Direction [rad] of `way` (2,), or that of an axis `within` an angle [rad] of it."""
    angle = float(np.arctan2(way[1], way[0]))
    axis = np.round(angle / (np.pi / 2)) * (np.pi / 2)
    return float(axis) if abs(angle - axis) <= within else angle
