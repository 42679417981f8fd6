"""The pose in every frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.rotations import to_euler, unwrap_euler
from motionenv.body.fitting._limbs import LIMBS, limb_angles
from motionenv.body.fitting._torso import checked_nodes, frame, torso_pose
from motionenv.body.skeleton import NODES
from motionenv.types import Skeleton

_NECK, _HEAD = NODES.index("neck"), NODES.index("head")


def fit_poses(
    nodes: ArrayLike, skeleton: Skeleton, fps: float, head_side: np.ndarray | None = None,
    torso: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """The pose vectors that bring the nodes of `skeleton` closest to captured ones.

    Limb directions start at the fitted torso's shoulder and hip, so that errors don't accumulate along a limb.

    Where an angle is undefined, because a limb is straight (rotation about its length) or its upper part points
    sideways (gimbal lock), it is continued from the frames around, by the least turning that fits the points. Knees may
    be overstretched as measured (genu recurvatum); elbows softly stop at 5°.

    A capture need not show the whole body: entries of joints that are never seen are NaN in all frames. If it shows no
    more of the torso than hips and pelvis, which lie on one line, they leave the torso's tilt open: it is taken from
    `torso`, and without that is 0.

    Args:
        nodes: (frames, 16, 3) [m] positions in the order of `NODES`, NaN in gaps.
        skeleton: the body to pose, from `fit_skeleton` or of another person.
        fps: frame rate [Hz]; determines over how many frames undefined angles are averaged.
        head_side: (frames, 3) direction to the left of the head in the world. None: the head faces the same way as the
            torso, because head and neck are single points.
        torso: (frames, 3, 3) rotations torso → world, whose columns point forward, left and up, as measured by other
            means, for instance by markers on the pelvis. Used in frames whose nodes don't determine the attitude; if
            others do, after a constant turn that brings it closest to the torso as fitted there.

    Returns:
        (frames, 25) [m, rad], angles continuous over time; NaN where required points are missing.

    Raises:
        MotionError: `nodes` or `torso` has another shape, or `torso` holds no rotations.
    """
    nodes = checked_nodes(nodes)
    turn, root = torso_pose(nodes, skeleton.offsets, torso)
    poses = np.empty((len(nodes), 25))
    poses[:, :3] = root
    poses[:, 3:6] = unwrap_euler(to_euler("ZXY", turn))[:, [2, 1, 0]]
    poses[:, 6:9] = _neck(nodes, skeleton, turn, root, head_side)
    for limb in LIMBS:
        near, middle, far = limb.chain
        start = root + turn @ skeleton.offsets[near]
        upper, whole = (np.einsum("tji,tj->ti", turn, nodes[:, n] - start) for n in (middle, far))
        poses[:, limb.at : limb.at + 4] = limb_angles(limb, upper, whole, -skeleton.offsets[middle, 2], fps)
    return poses


def _neck(nodes, skeleton, torso, root, head_side) -> np.ndarray:
    """Neck flexion, bend and rotation (frames, 3) [rad]."""
    neck = root + torso @ skeleton.offsets[_NECK]
    to_head = nodes[:, _HEAD] - neck
    side = torso[:, :, 1] if head_side is None else np.asarray(head_side, dtype=np.float64)
    side = np.where(np.isfinite(side), side, torso[:, :, 1])
    local = frame(skeleton.offsets[_HEAD], np.array([0.0, 1.0, 0.0]))
    angles = unwrap_euler(to_euler("YXZ", torso.swapaxes(-1, -2) @ frame(to_head, side) @ local.T))
    return angles * [1.0, -1.0, 1.0]
