"""Poses of rigid segments from clusters of three or more markers.

Söderkvist & Wedin (1993), J Biomech 26: the rotation and translation that fit a cluster's shape best in the sense of
least squares, by a singular value decomposition. The shape is the trial's mean (generalised Procrustes analysis, Gower
1975, Psychometrika 40), so that markers may be missing in any frame as long as three are seen.
"""

import numpy as np

from motionenv.mocap.clinical.gait_model import Segment

_LEAST = 3  # markers that determine a pose
_ROUNDS = 4  # of fitting the shape; changes are then far below a millimetre
_FLAT = 0.005  # [m] rms breadth below which markers are a line, about which a pose can't be told
_OUTLIER = 4.0  # times the usual misfit beyond which a frame's markers can't be those of the rigid cluster
_NOISE = 0.004  # [m] misfit that skin always has


def cluster_pose(markers: np.ndarray) -> Segment | None:
    """The pose of a cluster of `markers` (frames, markers, 3) [m], NaN where unseen, over time.

    Its origin is in the middle of the cluster; its rotation is cluster → world. Frames that show fewer than three
    markers, and those that fit the shape far worse than usual, as where markers were mistaken for one another, are NaN.
    None if no three markers are ever seen at once, or if they lie on a line.
    """
    seen = np.isfinite(markers).all(-1)
    usable = seen.sum(1) >= _LEAST
    if not usable.any():
        return None
    shape = markers[np.argmax(seen.sum(1))].copy()
    shape -= np.nanmean(shape, axis=0)
    for _ in range(_ROUNDS):
        pose, misfit = _fitted(markers, shape)
        good = usable & (misfit <= _limit(misfit))
        if not good.any():
            return None
        local = np.einsum("tji,tmj->tmi", pose.rotation[good], markers[good] - pose.origin[good, None])
        known = np.isfinite(local).all(-1)
        counts = known.sum(0)[:, None]
        sums = np.where(known[..., None], local, 0.0).sum(0)
        shape = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
        shape -= np.nanmean(shape, axis=0)
    if np.linalg.svd(shape[np.isfinite(shape[:, 0])], compute_uv=False)[1] < _FLAT * np.sqrt(_LEAST):
        return None
    pose, misfit = _fitted(markers, shape)
    bad = ~(misfit <= _limit(misfit))
    origin, rotation = pose.origin.copy(), pose.rotation.copy()
    origin[bad], rotation[bad] = np.nan, np.nan
    return Segment(origin, rotation)


def carried(positions: dict[str, np.ndarray], standing: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Knees and ankles of a standing trial, carried by the clusters of thighs and shanks (CAST; Cappozzo et al. 1995).

    `positions` (frames, 3) [m] are the walk's landmarks, and `standing` (3,) those of the standing trial. The result
    has the landmarks on and in knees and ankles that the walk lacks, (frames, 3) [m].
    """
    found: dict[str, np.ndarray] = {}
    for side in ("left", "right"):
        for limb, joints in (("thigh", ("knee",)), ("shank", ("ankle", "knee"))):
            names = [n for n in positions if n.startswith(f"{side}_{limb}_cluster_") and n in standing]
            if len(names) < _LEAST:
                continue
            shape, markers = np.array([standing[n] for n in names]), np.stack([positions[n] for n in names], axis=1)
            pose, misfit = _fitted(markers, shape)
            origin = np.where((misfit <= _limit(misfit))[:, None], pose.origin, np.nan)
            wanted = [f"{side}_{joint}{face}" for joint in joints for face in ("", "_lateral", "_medial")]
            for name in [n for n in wanted if n in standing and n not in positions and n not in found]:
                found[name] = origin + pose.rotation @ standing[name]
    return found


def _limit(misfit: np.ndarray) -> float:
    """Largest misfit [m] of a frame that shows the cluster as it is."""
    return _OUTLIER * max(float(np.nanmedian(misfit)), _NOISE)


def _fitted(markers: np.ndarray, shape: np.ndarray) -> tuple[Segment, np.ndarray]:
    """The pose of `shape` (markers, 3) in each frame, and the rms distance of the markers from it (frames,) [m]."""
    both = np.isfinite(markers).all(-1) & np.isfinite(shape).all(-1)
    usable = both.sum(1) >= _LEAST
    weight = both / np.maximum(both.sum(1, keepdims=True), 1)
    here, there = np.where(both[..., None], shape, 0.0), np.where(both[..., None], markers, 0.0)
    a, b = (np.einsum("tm,tmi->ti", weight, v) for v in (here, there))
    cross = np.einsum("tm,tmi,tmj->tij", weight, there - b[:, None], here - a[:, None])
    u, _, vt = np.linalg.svd(cross)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    turn = u @ vt
    origin = b - np.einsum("tij,tj->ti", turn, a)
    away = np.einsum("tij,tmj->tmi", turn, here) + origin[:, None] - there
    misfit = np.sqrt(np.einsum("tm,tmi->t", weight, away**2))
    hidden = ~usable
    turn[hidden], origin[hidden], misfit[hidden] = np.nan, np.nan, np.nan
    return Segment(origin, turn), misfit
