"""Retarget captured points to the 25-DOF body: joint positions, limb lengths, poses."""

from dataclasses import replace

import numpy as np

from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.body.skeleton import NODES
from motionenv.errors import MotionError
from motionenv.mocap.body_nodes import Nodes, body_nodes
from motionenv.mocap.clinical import Measurements, person_of
from motionenv.mocap.clinical.skeleton_legs import SkeletonWalk, correct_legs
from motionenv.mocap.marker_sets import Landmarks, MarkerMap, find_landmarks
from motionenv.types import MARKERS, Markers, Motion, Skeleton


def retarget(
    markers: Markers | Motion, *, marker_map: MarkerMap | str | None = None, skeleton: Skeleton | None = None,
    static: Markers | None = None, measurements: Measurements | None = None,
) -> Motion:  # fmt: skip
    """Fit the 25-DOF body to captured joints or markers, of a whole body or of a part of it.

    Args:
        markers: captured points (frames, points, 3) [m]; or a motion, which is already on the body: it is returned as
            it is, or on another `skeleton` with the same joint angles, its path scaled by the length of the legs.
        marker_map: which points are which landmarks: a map, or the name of a marker set, such as "plug-in-gait". None
            takes the set of which the most landmarks are there.
        skeleton: the body to use; None measures the person's limbs.
        static: a standing trial of the same person, which locates the joints' axes; see `clinical.calibrate`.
        measurements: of the person; None takes those that the file states.

    Returns:
        A motion in the world of the capture. Gaps, and limbs that were not captured, are NaN.

    Raises:
        MotionError: an unknown marker set, or no leg with hip and knee (what is missing is named); neither markers nor
            a motion, or options for markers with a motion.
        GapError: a required point is never seen.
    """
    if isinstance(markers, Motion):
        if (marker_map, static, measurements) != (None, None, None):
            raise MotionError("a Motion has no markers: omit marker_map, static and measurements, or pass Markers")
        if skeleton is None:
            return markers
        leg = [NODES.index("left_knee"), NODES.index("left_ankle")]
        new, old = (np.linalg.norm(body.offsets[leg], axis=1).sum() for body in (skeleton, markers.skeleton))
        path = markers.poses[:, :3] * (new / old)  # feet stay on the ground and don't slide
        return Motion(np.hstack([path, markers.poses[:, 3:]]), skeleton, markers.fps, markers.name)
    if not isinstance(markers, Markers):
        raise MotionError(f"markers must be Markers or a Motion, as read() returns, got {type(markers).__name__}")
    nodes = find_nodes(markers, marker_map=marker_map, static=static, measurements=measurements)
    if skeleton is None:
        skeleton = fit_skeleton(nodes.positions)
    poses = fit_poses(nodes.positions, skeleton, markers.fps, nodes.head_side, nodes.trunk)
    return Motion(poses, skeleton, markers.fps, markers.name, notes=(*markers.notes, *nodes.notes))


def to_markers(markers: Markers, *, marker_map: MarkerMap | str | None = None) -> Markers:
    """The 15 markers of paper B, (frames, 15, 3) [m], from captured points; NaN where unknown.

    Args:
        markers: captured points.
        marker_map: which points are which landmarks; see `retarget`.

    Raises:
        MotionError: an unknown marker set, or no leg with hip and knee (what is missing is named).
    """
    nodes = find_nodes(markers, marker_map=marker_map)
    return Markers(MARKERS, nodes.positions[:, : len(MARKERS)], markers.fps, name=markers.name)


def find_nodes(
    markers: Markers, *, marker_map: MarkerMap | str | None = None, static: Markers | None = None,
    measurements: Measurements | None = None,
) -> Nodes:  # fmt: skip
    """The body's nodes (frames, 16, 3) [m] in a capture, and the attitude of its head and pelvis.

    Args:
        markers, marker_map, static, measurements: as in `retarget`.

    Raises:
        MotionError: an unknown marker set, or no leg with hip and knee (what is missing is named).
    """
    landmarks = find_landmarks(markers, marker_map)
    person, calibration = person_of(markers, static=static, measurements=measurements, marker_map=marker_map)
    nodes = body_nodes(landmarks, person, calibration)
    side = _captured_side(markers, landmarks, nodes.positions)
    nodes = nodes if side is None else replace(nodes, head_side=side)
    return _with_corrected_legs(markers, landmarks, nodes)


def _with_corrected_legs(markers: Markers, landmarks: Landmarks, nodes: Nodes) -> Nodes:
    """The nodes, with the legs of a walking CMU skeleton corrected."""
    shanks = [name.strip() for name in landmarks.marker_map.shank_rotation.split(",") if name]
    joints = [name.rpartition(":")[2] for name in markers.names]
    if markers.rotations is None or not shanks or not set(shanks) <= set(joints):
        return nodes
    left, right = (markers.rotations[:, joints.index(name)] for name in shanks)
    walk = SkeletonWalk(nodes.positions, markers.rotations[:, 0], {"left": left, "right": right}, markers.fps)
    found = correct_legs(walk)
    if found is None:
        return nodes
    positions, correction = found
    return replace(nodes, positions=positions, how=nodes.how | {"hip": str(correction)})


def _captured_side(markers: Markers, landmarks: Landmarks, nodes: np.ndarray) -> np.ndarray | None:
    """Direction to the left of the head (frames, 3), from the captured rotation of the head's joint.

    Which axis of the joint is lateral shows over the whole trial: on average a person looks where the shoulders point.
    """
    wanted = landmarks.marker_map.head_rotation
    joint = next((n for n in markers.names if wanted and n.rpartition(":")[2] == wanted), None)
    shoulders = nodes[:, NODES.index("left_shoulder")] - nodes[:, NODES.index("right_shoulder")]
    seen = np.isfinite(shoulders).all(-1)
    if joint is None or markers.rotations is None or not seen.any():
        return None
    turn = markers.rotations[:, markers.index(joint)]
    return turn @ np.median(np.einsum("tji,tj->ti", turn, shoulders)[seen], axis=0)
