"""Fit the body to points: a person's limb lengths, and the pose in every frame.

Closed form and vectorised over frames: the torso by weighted Procrustes, the head by two directions, each limb by
the direction of its upper part and the plane in which it bends. Entries that depend on a gap become NaN; all others
don't.
"""

from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionenv._core.rotations import nearest, to_euler, unwrap_euler
from motionenv.body.skeleton import LEG_SHARE, NODES, TRUNK_SHARE, from_height, limb_radii
from motionenv.errors import GapError, MotionError
from motionenv.types import Skeleton

_I = {name: i for i, name in enumerate(NODES)}
_TORSO = [_I[n] for n in ("pelvis", "sternum", "left_shoulder", "right_shoulder", "left_hip", "right_hip", "neck")]
# Per limb: first pose entry, signs of (flexion, abduction, rotation), sign of the hinge, proximal-middle-distal nodes.
_LIMBS = (
    (9, (-1, 1, -1), -1, ("left_shoulder", "left_elbow", "left_wrist")),
    (13, (-1, -1, 1), -1, ("right_shoulder", "right_elbow", "right_wrist")),
    (17, (-1, 1, -1), 1, ("left_hip", "left_knee", "left_ankle")),
    (21, (-1, -1, 1), 1, ("right_hip", "right_knee", "right_ankle")),
)


def fit_skeleton(nodes) -> Skeleton:
    """Limb lengths of a person: medians over frames of the distances between nodes, the torso by Procrustes.

    Args:
        nodes: (frames, 16, 3) [m] positions in the order of `NODES`, NaN in gaps. A neck that is missing throughout is
            placed midway between the shoulders.

    Raises:
        GapError: a node other than the neck is never seen (named).
        MotionError: `nodes` has another shape, or limbs of length 0.
    """
    nodes = _checked(nodes)
    torso = _torso_template(nodes)
    offsets = np.zeros((len(NODES), 3))
    offsets[_TORSO] = torso
    for _, _, _, chain in _LIMBS:
        for near, far in pairwise(chain):
            offsets[_I[far], 2] = -_median_distance(nodes, near, far)
    direction = from_height().offsets[_I["head"]]
    offsets[_I["head"]] = direction / np.linalg.norm(direction) * _median_distance(nodes, "neck", "head")
    legs = -0.5 * offsets[[_I[f"{side}_{j}"] for side in ("left", "right") for j in ("knee", "ankle")], 2].sum()
    height = (legs + offsets[_I["neck"], 2]) / (LEG_SHARE + TRUNK_SHARE)
    if not 0.2 < height < 4.0:
        raise MotionError(f"nodes give a person {height:.3g} m tall; check the unit (positions must be in metres)")
    return Skeleton(offsets, limb_radii(height), height)


def fit_poses(nodes, skeleton: Skeleton, fps: float, head_side=None) -> np.ndarray:
    """The pose vectors that bring the nodes of `skeleton` closest to captured ones.

    Limb directions start at the fitted torso's shoulder and hip, so that errors don't accumulate along a limb. In a
    nearly straight limb the bending plane is undefined; its rotation is then taken from neighbouring frames and the
    neutral position.

    Args:
        nodes: (frames, 16, 3) [m] positions in the order of `NODES`, NaN in gaps.
        skeleton: the body to pose, from `fit_skeleton` or of another person.
        fps: frame rate [Hz]; determines the averaging window for straight limbs.
        head_side: (frames, 3) direction to the left of the head in the world. None: the head faces the same way as the
            torso, because head and neck are single points.

    Returns:
        (frames, 25) [m, rad], angles continuous over time; NaN where required points are missing.

    Raises:
        MotionError: `nodes` has another shape.
    """
    nodes = _checked(nodes)
    torso, root = _procrustes(nodes[:, _TORSO], skeleton.offsets[_TORSO])
    poses = np.empty((len(nodes), 25))
    poses[:, :3] = root
    poses[:, 3:6] = unwrap_euler(to_euler("ZXY", torso))[:, [2, 1, 0]]
    poses[:, 6:9] = _neck(nodes, skeleton, torso, root, head_side)
    for at, signs, hinge, chain in _LIMBS:
        poses[:, at : at + 4] = _limb(nodes, skeleton, torso, root, fps, (signs, hinge, chain))
    return poses


def _checked(nodes) -> np.ndarray:
    """Nodes as (frames, 16, 3) float64, including the neck.

    Raises:
        MotionError: another shape.
    """
    nodes = np.array(nodes, dtype=np.float64)
    if nodes.ndim != 3 or nodes.shape[1:] != (len(NODES), 3) or not len(nodes):
        raise MotionError(f"nodes must have shape (frames, {len(NODES)}, 3), got {nodes.shape}")
    if np.isnan(nodes[:, _I["neck"]]).all():
        nodes[:, _I["neck"]] = nodes[:, [_I["left_shoulder"], _I["right_shoulder"]]].mean(1)
    return nodes


def _median_distance(nodes: np.ndarray, a: str, b: str) -> float:
    """Median over frames of the distance [m] between two nodes.

    Raises:
        GapError: never seen together.
    """
    distance = np.linalg.norm(nodes[:, _I[a]] - nodes[:, _I[b]], axis=-1)
    if np.isnan(distance).all():
        raise GapError(f"{a} and {b} are never seen in the same frame: omit this trial, or map other points to them")
    return float(_median(distance))


def _median(values: np.ndarray) -> np.ndarray:
    """Median over the first axis, ignoring NaN; numpy's own is ten times slower if there is no NaN."""
    return np.nanmedian(values, axis=0) if np.isnan(values).any() else np.median(values, axis=0)


def _torso_template(nodes: np.ndarray) -> np.ndarray:
    """Offsets (7, 3) [m] of the torso's nodes from the pelvis: generalised Procrustes over the frames.

    The frame is anatomical: z from pelvis to neck, y as close as possible to the left of hips and shoulders.
    """
    points = nodes[:, _TORSO]
    missing = [NODES[n] for n in _TORSO if np.isnan(nodes[:, n]).any(-1).all()]
    if missing:
        raise GapError(f"{', '.join(missing)} never seen: omit this trial, or map other points to them")
    up = points[:, 6] - points[:, 0]
    left = (points[:, 2] - points[:, 3]) + (points[:, 4] - points[:, 5])
    whole = np.isfinite(points).all((1, 2))
    if not whole.any():
        raise GapError("no frame shows pelvis, sternum, neck, hips and shoulders together: omit this trial")
    template = np.median((points - points[:, :1])[whole] @ _frame(up, left)[whole], axis=0)
    for _ in range(3):
        rotation, origin = _procrustes(points, template)
        template = _median((points - origin[:, None]) @ rotation)
        template = template - template[0]
        template = template @ _frame(template[6], template[2] - template[3] + template[4] - template[5])
    return template


def _frame(up: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Rotation (..., 3, 3) with columns forward, left and up: z along `up`, y as close as possible to `left`."""
    z = up / np.linalg.norm(up, axis=-1, keepdims=True)
    x = np.cross(left, z)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _procrustes(points: np.ndarray, template: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (frames, 3, 3) and origin (frames, 3) that bring `template` (n, 3) closest to `points` (frames, n, 3).

    Missing points are ignored; frames whose remaining points don't determine a rotation are NaN.
    """
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


def _neck(nodes, skeleton, torso, root, head_side) -> np.ndarray:
    """Neck flexion, bend and rotation (frames, 3) [rad]."""
    neck = root + torso @ skeleton.offsets[_I["neck"]]
    to_head = nodes[:, _I["head"]] - neck
    side = torso[:, :, 1] if head_side is None else np.asarray(head_side, dtype=np.float64)
    side = np.where(np.isfinite(side), side, torso[:, :, 1])
    local = _frame(skeleton.offsets[_I["head"]], np.array([0.0, 1.0, 0.0]))
    angles = unwrap_euler(to_euler("YXZ", torso.swapaxes(-1, -2) @ _frame(to_head, side) @ local.T))
    return angles * [1.0, -1.0, 1.0]


def _limb(nodes, skeleton, torso, root, fps, limb) -> np.ndarray:
    """Flexion, abduction and rotation of a ball joint and flexion of the hinge below it: (frames, 4) [rad]."""
    signs, hinge, chain = limb
    near, middle, far = (_I[n] for n in chain)
    start = root + torso @ skeleton.offsets[near]
    upper = _unit(nodes[:, middle] - start)
    lower = _unit(nodes[:, far] - (start - skeleton.offsets[middle, 2] * upper))
    # The limb points along -z: R_y(β) R_x(γ) (0, 0, -1) = (-cos γ sin β, sin γ, -cos γ cos β).
    u = np.einsum("tji,tj->ti", torso, upper)
    beta, gamma = np.arctan2(-u[:, 0], -u[:, 2]), np.arcsin(np.clip(u[:, 1], -1.0, 1.0))
    v = _into_limb(beta, gamma, np.einsum("tji,tj->ti", torso, lower))
    # Below the hinge: R_z(ρ) R_y(±f) (0, 0, -1), whose level part is ∓sin f · (cos ρ, sin ρ).
    rho = _bending_direction(-hinge * v[:, :2], fps, most_overstretch=0.5 if hinge > 0 else 0.2)
    bend = np.arctan2(-hinge * (v[:, 0] * np.cos(rho) + v[:, 1] * np.sin(rho)), -v[:, 2])
    ball = unwrap_euler(np.stack([beta, gamma, rho], axis=-1)) * signs
    ball[:, 2] = np.where(np.isnan(rho), np.nan, ball[:, 2])
    return np.concatenate([ball, bend[:, None]], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) normalised to length 1."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _into_limb(beta, gamma, v) -> np.ndarray:
    """Vectors (frames, 3) of the torso's frame in the frame rotated by R_y(β) R_x(γ)."""
    x, z = v[:, 0] * np.cos(beta) - v[:, 2] * np.sin(beta), v[:, 0] * np.sin(beta) + v[:, 2] * np.cos(beta)
    c, s = np.cos(gamma), np.sin(gamma)
    return np.stack([x, v[:, 1] * c + z * s, z * c - v[:, 1] * s], axis=-1)


def _bending_direction(bend: np.ndarray, fps: float, most_overstretch: float) -> np.ndarray:
    """Axial rotation ρ (frames,) [rad] from sin(flexion)·(cos ρ, sin ρ), (frames, 2).

    As the limb straightens, the vector's length vanishes and its direction becomes noise: below about 12° of flexion
    the mean vector of the nearest 0.1 s is used, and if that vanishes too, the neutral direction. A limb that seems to
    bend the wrong way, by less than the sine `most_overstretch`, is overstretched rather than rotated by half a turn: a
    hip can't turn the knee backwards, while a shoulder can turn the elbow.
    """
    seen = np.isfinite(bend).all(-1)
    size = np.linalg.norm(bend, axis=-1)
    turned = np.where(((size < most_overstretch) & (bend[:, 0] < 0))[:, None], -bend, bend)
    held = np.where(seen[:, None], turned, 0.0)
    share = gaussian_filter1d(seen.astype(float), 0.1 * fps, mode="nearest")
    nearby = gaussian_filter1d(held, 0.1 * fps, axis=0, mode="nearest") / np.maximum(share, 1e-9)[:, None]
    trust = np.where(seen, size**2 / (size**2 + 0.2**2), 0.0)[:, None]
    mixed = trust * held + (1.0 - trust) * nearby + [0.02, 0.0]
    return np.where(seen, np.arctan2(mixed[:, 1], mixed[:, 0]), np.nan)
