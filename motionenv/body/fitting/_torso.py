"""The torso: its shape over a whole capture, and its attitude and place in every frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.rotations import nearest
from motionenv.body.limbs import from_height
from motionenv.body.skeleton import NECK_ABOVE, NODES
from motionenv.errors import MotionError

_I = {name: i for i, name in enumerate(NODES)}
_NAMES = ("pelvis", "sternum", "left_shoulder", "right_shoulder", "left_hip", "right_hip", "neck")
#: Rows of nodes that are fixed to the torso.
TORSO = [_I[name] for name in _NAMES]
_PELVIS, _STERNUM, _NECK = (_NAMES.index(name) for name in ("pelvis", "sternum", "neck"))
_PAIRS = [(_NAMES.index(f"left_{joint}"), _NAMES.index(f"right_{joint}")) for joint in ("shoulder", "hip")]


def checked_nodes(nodes: ArrayLike) -> np.ndarray:
    """Nodes as (frames, 16, 3) float64. What is missing throughout is derived from what is seen, where it can be.

    The pelvis is placed midway between the hips, a hip opposite the other one, beyond the pelvis, and the neck above
    the shoulders' middle as `NECK_ABOVE` says.
    """
    nodes = np.array(nodes, dtype=np.float64)
    if nodes.ndim != 3 or nodes.shape[1:] != (len(NODES), 3) or not len(nodes):
        raise MotionError(f"nodes must have shape (frames, {len(NODES)}, 3), got {nodes.shape}")
    if _unseen(nodes, "pelvis"):
        nodes[:, _I["pelvis"]] = nodes[:, [_I["left_hip"], _I["right_hip"]]].mean(1)
    for side, other in (("left", "right"), ("right", "left")):
        if _unseen(nodes, f"{side}_hip"):
            nodes[:, _I[f"{side}_hip"]] = 2.0 * nodes[:, _I["pelvis"]] - nodes[:, _I[f"{other}_hip"]]
    if _unseen(nodes, "neck"):
        pelvis, shoulders = nodes[:, _I["pelvis"]], nodes[:, [_I["left_shoulder"], _I["right_shoulder"]]].mean(1)
        trunk = 0.0 if _unseen(nodes, "pelvis") else shoulders - pelvis
        nodes[:, _I["neck"]] = shoulders + (NECK_ABOVE - 1.0) * trunk
    return nodes


def _unseen(nodes: np.ndarray, name: str) -> bool:
    """Whether a node is missing in every frame."""
    return bool(np.isnan(nodes[:, _I[name]]).any(-1).all())


def median(values: np.ndarray) -> np.ndarray:
    """Median over the first axis, ignoring NaN, and NaN where there is nothing else."""
    missing = np.isnan(values)
    if not missing.any():  # numpy's own, which ignores NaN, takes ten times as long
        return np.median(values, axis=0)
    empty = missing.all(axis=0)
    return np.where(empty, np.nan, np.nanmedian(np.where(empty, 0.0, values), axis=0))


def torso_shape(nodes: np.ndarray) -> np.ndarray:
    """Offsets (7, 3) [m] of the torso's nodes from the pelvis, NaN for those never seen: generalised Procrustes.

    The frame is anatomical: z from pelvis to neck, y as close as possible to the left of hips and shoulders. Without a
    neck, the sternum is where it is in the average person's direction. Hips alone, which lie on one line, are on y.
    """
    points = nodes[:, TORSO]
    seen = np.isfinite(points).all(-1).any(0)
    pairs = [pair for pair in _PAIRS if seen[list(pair)].all()]
    top = _NECK if seen[_NECK] else _STERNUM
    if not (seen[_PELVIS] and seen[top] and pairs):
        return _hips_alone(points)
    template = median(_in(points - points[:, :1], _axes(points, top, pairs)))
    for _ in range(3):
        rotation, origin = _procrustes(points, template)
        template = median(_in(points - origin[:, None], rotation))
        template = template - template[_PELVIS]
        template = template @ _axes(template, top, pairs)
    return template if top == _NECK else template @ _leaning(template[_STERNUM])


def _hips_alone(points: np.ndarray) -> np.ndarray:
    """Offsets (7, 3) [m] where only the hips' width is known, if anything is."""
    left, right = _PAIRS[1]
    shape = np.full((len(TORSO), 3), np.nan)
    width = float(median(np.linalg.norm(points[:, left] - points[:, right], axis=-1)))
    shape[[_PELVIS, left, right]] = np.outer([0.0, 0.5 * width, -0.5 * width], [0.0, 1.0, 0.0])
    return shape


def _axes(points, top: int, pairs) -> np.ndarray:
    """`frame` from torso points (..., 7, 3): up from the pelvis to the node `top`, left along `pairs` of nodes."""
    left = sum(points[..., a, :] - points[..., b, :] for a, b in pairs)
    return frame(points[..., top, :] - points[..., _PELVIS, :], left)


def _leaning(sternum: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) about y, to multiply from the right, that brings `sternum` to the average person's direction."""
    average = from_height().offsets[_I["sternum"]]
    angle = np.arctan2(average[0], average[2]) - np.arctan2(sternum[0], sternum[2])
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def frame(up: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Rotation (..., 3, 3) with columns forward, left and up: z along `up`, y as close as possible to `left`."""
    z = up / np.linalg.norm(up, axis=-1, keepdims=True)
    x = np.cross(left, z)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _in(vectors: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Vectors (frames, n, 3) in the frames (frames, 3, 3), NaN where either is missing, without a warning."""
    return np.einsum("tni,tij->tnj", vectors, rotation)


def torso_pose(nodes: np.ndarray, offsets: np.ndarray, measured: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Rotation torso → world (frames, 3, 3) and position of the pelvis (frames, 3) [m], NaN where unknown.

    From `checked_nodes` and the skeleton's offsets (16, 3) [m]; `measured` attitudes (frames, 3, 3), or None, are for
    frames whose nodes don't determine it (see `fit_poses`).
    """
    points, template = nodes[:, TORSO], offsets[TORSO]
    rotation, _ = _procrustes(points, template)
    open_ = np.isnan(rotation).any((1, 2))
    if open_.any():
        rotation = np.where(open_[:, None, None], _substitute(points, rotation, open_, measured), rotation)
    return rotation, _origin(points, template, rotation)


def _substitute(points, rotation, open_, measured) -> np.ndarray:
    """Attitudes (frames, 3, 3) of frames whose nodes don't determine it."""
    if measured is None:
        # In a capture that shows the upper body elsewhere, standing upright for some frames would be a jump.
        return _upright(points) if open_.all() else np.full_like(rotation, np.nan)
    measured = _checked_rotations(measured, len(points))
    both = ~open_ & np.isfinite(measured).all((1, 2))
    if both.any():  # what was measured elsewhere may lean against the torso: no jump where it takes over
        measured = measured @ nearest((measured[both].swapaxes(-1, -2) @ rotation[both]).mean(0))
    return measured


def _checked_rotations(rotations, frames: int) -> np.ndarray:
    """`rotations` (frames, 3, 3), which may have NaN."""
    rotations = np.asarray(rotations, dtype=np.float64)
    if rotations.shape != (frames, 3, 3):
        raise MotionError(f"torso must have shape ({frames}, 3, 3), a rotation per frame, got {rotations.shape}")
    known = rotations[np.isfinite(rotations).all((1, 2))]
    off = np.abs(known @ known.swapaxes(-1, -2) - np.eye(3)).max(initial=0.0)
    if off > 0.01 or (np.linalg.det(known) < 0).any():
        raise MotionError("torso must hold rotations, with columns forward, left and up of length 1, right-handed")
    return rotations


def _upright(points: np.ndarray) -> np.ndarray:
    """Attitudes (frames, 3, 3) with the lateral axis along the hips and no tilt; NaN for hips above each other."""
    left = points[:, _PAIRS[1][0]] - points[:, _PAIRS[1][1]]
    level = np.linalg.norm(left[:, :2], axis=-1) > 0.3 * np.linalg.norm(left, axis=-1)
    left = np.where(level[:, None], left, np.nan)
    y = left / np.linalg.norm(left, axis=-1, keepdims=True)
    x = np.cross(y, [0.0, 0.0, 1.0])
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _origin(points, template, rotation) -> np.ndarray:
    """Position (frames, 3) of the template's origin: the mean over the points that are seen."""
    seen = np.isfinite(points).all(-1)
    count = seen.sum(1)
    placed = points - np.einsum("tij,nj->tni", rotation, template)
    total = np.where(seen[..., None], placed, 0.0).sum(1)
    return np.where((count > 0)[:, None], total / np.maximum(count, 1)[:, None], np.nan)


def _procrustes(points: np.ndarray, template: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (frames, 3, 3) and origin (frames, 3) that bring `template` (n, 3) closest to `points` (frames, n, 3).

    Missing points, and points of the template that are NaN, are ignored; frames whose remaining points don't determine
    a rotation are NaN.
    """
    inside = np.isfinite(template).all(-1)
    points, template = points[:, inside], template[inside]
    seen = np.isfinite(points).all(-1)
    count = np.maximum(seen.sum(1), 1)[:, None]
    weight = seen[..., None].astype(float)
    p = np.where(seen[..., None], points, 0.0)
    p_mean = p.sum(1) / count
    t_mean = (weight * template).sum(1) / count
    t = weight * (template - t_mean[:, None])
    # Without missing points, all frames have the same singular values.
    spread = np.linalg.svd(t[:1] if seen.all() else t, compute_uv=False)[:, 1]
    fixed = (seen.sum(1) >= 3) & (spread > 0.2 * np.linalg.svd(template - template.mean(0), compute_uv=False)[1])
    cross = np.einsum("tni,tnj->tij", p - weight * p_mean[:, None], t)
    rotation = nearest(np.where(fixed[:, None, None], cross, np.nan))
    return rotation, p_mean - np.einsum("tij,tj->ti", rotation, t_mean)
