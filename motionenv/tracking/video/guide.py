"""Detections of 2D keypoints of a person in a film as a tracker's guide.

Detections tell people apart, and which side is left and right. Those of the person followed are lifted to 3D: what
they say of a pose, with all their confidences, gaps and outliers, is then a normal distribution about the lifted one,
which the tracker multiplies by the likelihood of silhouettes. (Multiplying by that of the points, too, would count them
twice, and was worse on the films on which the deviation was chosen.)
"""

from dataclasses import dataclass

import numpy as np

from motionenv.body import markers
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.lifting import fit_freely
from motionenv.tracking.video.candidates import at_frames
from motionenv.tracking.video.survey import Survey
from motionenv.types import MARKERS, Camera, Points, Skeleton

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_LEAST_POINTS = 6  # markers of a frame that tell how far a pose is off
#: Standard deviations (25,) of poses from the lifted ones [m, rad]. Chosen, with the memory of 0.3 s, on eight films of
#: `motionenv bench tracking.detected_films --people cmu`; 0.01 to 0.04 and up to 0.08 differ by 1 mm.
DEVIATION = np.concatenate([np.full(3, 0.02), np.full(22, 0.04)])


@dataclass(frozen=True, eq=False)
class Guide:
    """What detections tell of one person in a film's frames.

    Attributes:
        poses: (T, 25) lifted; NaN where unknown.
        skeleton: the person's.
        points: (T, 15, 2) [pixels of the film]; NaN where missing.
    """

    poses: np.ndarray
    skeleton: Skeleton
    points: np.ndarray

    @property
    def known(self) -> np.ndarray:
        return np.isfinite(self.poses).all(axis=1)


def lifted(points: Points, camera: Camera, seen: Survey, height: float | None, frames: slice) -> Guide:
    """The guide by a person's `points` in some `frames` of the film `seen`, whose `camera` is known.

    `height` [m] of the person scales the motion about the camera; None takes that which the points tell.

    Raises:
        MotionError: too few points to lift.
    """
    fit = fit_freely(points, camera)
    nodes = np.concatenate([fit.positions, fit.positions[:, _SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
    if height is not None:
        nodes = camera.centre + height / fit_skeleton(nodes).height * (nodes - camera.centre)
    body = fit_skeleton(nodes)
    poses = fit_poses(nodes, body, points.fps)
    of = lambda values: at_frames(values, points.fps, seen.fps, frames.stop)[frames]
    return Guide(of(poses), body, of(points.positions))


def disagreement(poses: np.ndarray, guide: Guide, camera: Camera) -> np.ndarray:
    """Median distance (T,) of poses' markers from the detected points, in heights of the body; NaN without points."""
    shown = camera.project(markers(poses, guide.skeleton))[0]
    tall = np.ptp(shown[..., 1], axis=1)
    off = np.linalg.norm(shown - guide.points, axis=-1)
    enough = np.isfinite(off).sum(axis=1) >= _LEAST_POINTS
    out = np.full(len(poses), np.nan)
    out[enough] = np.nanmedian(off[enough], axis=1) / np.maximum(tall[enough], 1.0)
    return out
