"""Limb lengths of a person, from a capture of the whole body or of a part."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body.fitting._torso import TORSO, checked_nodes, median, torso_shape
from motionenv.body.limbs import from_height, limb_radii
from motionenv.body.skeleton import NODES
from motionenv.errors import GapError, MotionError
from motionenv.types import Skeleton

_I = {name: i for i, name in enumerate(NODES)}
_CHAINS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
#: Pairs of nodes and the joints between them, for each limb and the head.
_SEGMENTS = [(near, far) for chain in _CHAINS for near, far in pairwise(chain)]
#: Nodes from whose distance to the one before, or else height above the pelvis, a person's height is estimated: legs
#: and trunk, which make most of it, and, where neither is seen, the rest.
_TELLING = (
    ("left_knee", "right_knee", "left_ankle", "right_ankle", "neck"),
    ("left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "head"),
)


def fit_skeleton(nodes: ArrayLike) -> Skeleton:
    """Limb lengths of a person: medians over frames of the distances between nodes, the torso by Procrustes.

    A capture need not show the whole body. A limb segment that is never seen is as long as that on the other side.
    What is seen on neither side has the length of an average person's (Winter 2009, fig. 4.1) of the same height. The
    height is that of an average person whose thighs, shins and trunk, as far as they are seen, are together as long;
    if none of them is seen, arms, head and the width of the hips are used.

    Args:
        nodes: (frames, 16, 3) [m] positions in the order of `NODES`, NaN in gaps. A neck that is missing throughout is
            placed above the shoulders' middle (`NECK_ABOVE`), a pelvis between the hips, a hip opposite the other one.

    Raises:
        GapError: neither the pelvis nor a hip is ever seen, or no length at all.
        MotionError: `nodes` has another shape, or limbs of a person shorter than 0.2 m or taller than 4 m.
    """
    nodes = checked_nodes(nodes)
    if np.isnan(nodes[:, [_I["pelvis"], _I["left_hip"], _I["right_hip"]]]).any(-1).all():
        raise GapError(
            "neither the pelvis nor a hip is ever seen, to which the body is tied: omit this trial, or map other "
            "points to pelvis, left_hip or right_hip"
        )
    offsets = np.full((len(NODES), 3), np.nan)
    offsets[TORSO] = torso_shape(nodes)
    average = from_height(1.0).offsets
    _add_segments(offsets, nodes, average)
    height = _height(offsets, average)
    if not 0.2 < height < 4.0:
        raise MotionError(f"nodes give a person {height:.3g} m tall; check the unit (positions must be in metres)")
    return Skeleton(_completed(offsets, height * average), limb_radii(height), height)


def _add_segments(offsets: np.ndarray, nodes: np.ndarray, average: np.ndarray) -> None:
    """Write the measured offsets of limbs and head [m], in place."""
    for near, far in _SEGMENTS:
        left, right = (_median_distance(nodes, f"{side}_{near}", f"{side}_{far}") for side in ("left", "right"))
        offsets[_I[f"left_{far}"]] = [0.0, 0.0, -(right if np.isnan(left) else left)]
        offsets[_I[f"right_{far}"]] = [0.0, 0.0, -(left if np.isnan(right) else right)]
    head = average[_I["head"]]
    offsets[_I["head"]] = head / np.linalg.norm(head) * _median_distance(nodes, "neck", "head")


def _median_distance(nodes: np.ndarray, a: str, b: str) -> float:
    """Median over frames of the distance [m] between two nodes; NaN if they are never seen together."""
    return float(median(np.linalg.norm(nodes[:, _I[a]] - nodes[:, _I[b]], axis=-1)))


def _height(offsets: np.ndarray, average: np.ndarray) -> float:
    """Height [m] of the average person in whom the segments measured in `offsets` (16, 3) [m] are together as long."""
    for names in _TELLING:
        rows = [_I[name] for name in names]
        weight = np.where([name == "neck" for name in names], 2.0, 1.0)  # one trunk, and both legs
        lengths, shares = (weight * np.linalg.norm(of[rows], axis=-1) for of in (offsets, average))
        known = np.isfinite(lengths)
        if known.any():
            return float(lengths[known].sum() / shares[known].sum())
    raise GapError("no two nodes of one limb are ever seen in the same frame: omit this trial, or map other points")


def _completed(offsets: np.ndarray, average: np.ndarray) -> np.ndarray:
    """Offsets (16, 3) [m] whose gaps are filled from the other side, then from an average person's of this height."""
    for side, other in (("left", "right"), ("right", "left")):
        for joint in ("shoulder", "hip"):
            mirrored = offsets[_I[f"{other}_{joint}"]] * [1.0, -1.0, 1.0]
            at = _I[f"{side}_{joint}"]
            offsets[at] = np.where(np.isnan(offsets[at]), mirrored, offsets[at])
    return np.where(np.isnan(offsets), average, offsets)
