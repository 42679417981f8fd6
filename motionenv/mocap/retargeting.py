"""Retarget captured points to the 25-DOF body: joint positions, limb lengths, poses."""

import numpy as np

from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.body.skeleton import NODES
from motionenv.errors import MotionError
from motionenv.mocap.joint_centres import has_markers, with_joint_centres
from motionenv.mocap.names import SCHEMES, missing
from motionenv.types import MARKERS, Markers, Motion, Skeleton


def retarget(markers: Markers, *, scheme: str | None = None, skeleton: Skeleton | None = None) -> Motion:
    """Fit the 25-DOF body to captured joints or markers.

    Args:
        markers: captured points (frames, points, 3) [m].
        scheme: naming scheme of the points: "cmu", "cmu-bvh", "mixamo", "bandai-namco", "plug-in-gait", or "markers"
            for our own 15. None selects the first one whose points are all present.
        skeleton: the body to use; None measures the person's limbs.

    Returns:
        A motion in the world of the capture; gaps remain gaps (NaN).

    Raises:
        MotionError: an unknown scheme, or required points are missing (named).
        GapError: a required point is never seen.
    """
    nodes, head_side = to_nodes(markers, scheme=scheme)
    if skeleton is None:
        skeleton = fit_skeleton(nodes)
    return Motion(fit_poses(nodes, skeleton, markers.fps, head_side), skeleton, markers.fps, markers.name)


def to_markers(markers: Markers, *, scheme: str | None = None) -> Markers:
    """The 15 markers of paper B, (frames, 15, 3) [m], from captured points by their names.

    Args:
        markers: captured points.
        scheme: naming scheme of the points; see `retarget`.

    Raises:
        MotionError: an unknown scheme, or required points are missing (named).
    """
    nodes, _ = to_nodes(markers, scheme=scheme)
    return Markers(MARKERS, nodes[:, : len(MARKERS)], markers.fps, name=markers.name)


def to_nodes(markers: Markers, *, scheme: str | None = None) -> tuple[np.ndarray, np.ndarray | None]:
    """The body's nodes (frames, 16, 3) [m], and the direction to the left of the head (frames, 3) or None.

    Args:
        markers: captured points.
        scheme: naming scheme of the points; see `retarget`.

    Raises:
        MotionError: an unknown scheme, or required points are missing (named).
    """
    if markers.positions.ndim != 3:
        raise MotionError(f"markers must be one sequence (frames, points, 3), got {markers.positions.shape}")
    markers = _plain_names(markers)
    if has_markers(markers.names):
        markers = with_joint_centres(markers)
    scheme = _checked_scheme(scheme, markers.names)
    table, head = SCHEMES[scheme]
    nodes = np.stack([_weighted(markers, table[node]) for node in NODES], axis=1)
    return nodes, _head_side(markers, nodes, head)


def _plain_names(markers: Markers) -> Markers:
    """The same points without a rig's prefix ("mixamorig:")."""
    names = tuple(n.rpartition(":")[2] for n in markers.names)
    return Markers(names, markers.positions, markers.fps, markers.parents, markers.rotations, markers.name)


def _checked_scheme(scheme: str | None, names: tuple[str, ...]) -> str:
    """`scheme`, or the first one whose points are all among `names`.

    Raises:
        MotionError: no such scheme, or required points are missing.
    """
    if scheme is None:
        scheme = min(SCHEMES, key=lambda s: len(missing(s, names)))
    if scheme not in SCHEMES:
        raise MotionError(f"scheme must be one of {', '.join(SCHEMES)}, got {scheme!r}")
    lacking = missing(scheme, names)
    if lacking:
        raise MotionError(
            f"the nearest naming scheme, {scheme!r}, needs the points {', '.join(lacking)}; the file has "
            f"{', '.join(names)}. Rename them with motionenv.Markers, or omit this file"
        )
    return scheme


def _weighted(markers: Markers, weights: dict[str, float]) -> np.ndarray:
    """Weighted mean (frames, 3) [m] of points."""
    return np.sum([w * markers.positions[:, markers.index(n)] for n, w in weights.items()], axis=0)


def _head_side(markers: Markers, nodes: np.ndarray, head: str | None) -> np.ndarray | None:
    """Direction to the left of the head in the world (frames, 3).

    From the four head markers, or from the captured rotation of the head bone, whose lateral axis is identified over
    the whole trial: on average a person looks where the shoulders point.
    """
    if head is None:
        at = {n: markers.positions[:, markers.index(n)] for n in ("LFHD", "LBHD", "RFHD", "RBHD")}
        return 0.5 * (at["LFHD"] + at["LBHD"] - at["RFHD"] - at["RBHD"])
    if markers.rotations is None:
        return None
    turn = markers.rotations[:, markers.index(head)]
    shoulders = nodes[:, NODES.index("left_shoulder")] - nodes[:, NODES.index("right_shoulder")]
    return turn @ np.nanmedian(np.einsum("tji,tj->ti", turn, shoulders), axis=0)
