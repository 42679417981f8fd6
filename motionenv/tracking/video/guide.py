"""Detections of 2D keypoints in a film: the people that they show, and the motion of one of them as a tracker's guide.

Detections tell people apart, and which side is left and right. Those of the person followed are lifted to 3D: what
they say of a pose, with all their confidences, gaps and outliers, is then a normal distribution about the lifted one,
which the tracker multiplies by the likelihood of silhouettes. (Multiplying by that of the points, too, would count them
twice, and was worse on the films on which the deviation was chosen.) Where there are no detections, silhouettes go on
alone, on the outline that fitted the person before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionenv.body import markers
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.lifting import fit_freely
from motionenv.mocap.keypoints.points2d import read_people
from motionenv.tracking.video.candidates import Candidate, candidates
from motionenv.tracking.video.movers import Mover, areas, common_areas
from motionenv.tracking.video.survey import Survey
from motionenv.types import MARKERS, Camera, Points, Skeleton

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_AROUND = np.array([-0.07, 0.07, -0.10, 0.06])  # a body's box beyond its markers', in heights of the latter
_LEAST_POINTS = 6  # markers of a frame from which it has a box
_SAME, _INSIDE = 0.4, 0.3  # least overlap of a person with an outline, and least part of an outline inside a box
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


def people_of(seen: Survey) -> list[Points]:
    """Everybody in the detections of the film `seen`.

    Raises:
        FormatError: as of `read_people`.
        MotionError: no Points in pixels.
    """
    detections, info = seen.film.detections, seen.info
    if isinstance(detections, str | Path):
        return read_people(detections, info.fps, (info.width, info.height))
    people = [detections] if isinstance(detections, Points) else list(detections or [])
    if not people or not all(isinstance(p, Points) and p.unit == "px" for p in people):
        raise MotionError("detections must be a file, or Points in the film's pixels, one for each person")
    return people


def at_frames(values: np.ndarray, fps: float, seen_fps: float, frames: int) -> np.ndarray:
    """Values (n, ...) at `fps` [Hz] at the moments of `frames` frames at `seen_fps` [Hz]; NaN after the last."""
    nearest = np.round(np.arange(frames) * fps / seen_fps).astype(int)
    out = np.asarray(values, dtype=float)[np.minimum(nearest, len(values) - 1)].copy()
    out[nearest >= len(values)] = np.nan
    return out


def boxes_of(points: np.ndarray) -> np.ndarray:
    """Boxes (T, 4) around the bodies of points (T, 15, 2): first and last column, first and last row; NaN without."""
    known = np.isfinite(points[..., 0])
    low = np.where(known[..., None], points, np.inf).min(axis=1)
    high = np.where(known[..., None], points, -np.inf).max(axis=1)
    tall = (high - low)[:, 1:]
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    boxes[known.sum(axis=1) < _LEAST_POINTS] = np.nan
    with np.errstate(invalid="ignore"):
        return boxes + _AROUND * tall


def detected(people: Sequence[Points], seen: Survey) -> list[Candidate]:
    """Everybody of `people` who is in the film `seen`, as candidates: whom a detector saw best and largest first."""
    frames, scale = len(seen.labels), seen.info.width / seen.labels.shape[2]
    boxes = [boxes_of(at_frames(p.positions, p.fps, seen.fps, frames)) for p in people]
    clear = [(np.clip(b, 0, np.repeat([seen.info.width, seen.info.height], 2) - 1) + 0.5) / scale - 0.5 for b in boxes]
    movers = [_joined(Mover(b, np.zeros(frames, dtype=bool), _parts(seen.labels, b)), seen) for b in clear]
    found = candidates(movers, seen.labels, seen.fps, scale)
    whose = {id(mover): one for mover, one in zip(movers, people, strict=True)}
    found.sort(key=lambda c: -_presence(whose[id(c.mover)]))
    return [replace(c, number=i, points=whose[id(c.mover)]) for i, c in enumerate(found, 1)]


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


def _presence(points: Points) -> float:
    """Heights of a person in the picture, weighted by the confidence of their points and summed over frames."""
    boxes, seen = boxes_of(points.positions), np.isfinite(points.positions[..., 0])
    sure = seen if points.confidence is None else seen * points.confidence
    return float(np.nansum((boxes[:, 3] - boxes[:, 2]) * sure.sum(axis=1)))


def _parts(labels: np.ndarray, boxes: np.ndarray) -> dict[int, list[int]]:
    parts = {}
    for t in np.flatnonzero(np.isfinite(boxes[:, 0])).tolist():
        c0, c1, r0, r1 = np.maximum(boxes[t], 0).astype(int)
        inside = np.bincount(labels[t, r0 : r1 + 1, c0 : c1 + 1].ravel(), minlength=labels[t].max() + 1)
        share = inside / np.maximum(np.bincount(labels[t].ravel(), minlength=len(inside)), 1)
        parts[t] = [int(n) for n in np.flatnonzero(share > _INSIDE) if n]
    return parts


def _joined(who: Mover, seen: Survey) -> Mover:
    """A detected person, and the mover of the first look that is the same, where nothing was detected."""
    best, same = _SAME, None
    for mover in (c.mover for c in seen.found):
        both = who.seen & mover.seen
        common = np.diagonal(common_areas(who.boxes[both], mover.boxes[both]))
        overlap = common / (areas(who.boxes[both]) + areas(mover.boxes[both]) - common)
        if both.any() and np.median(overlap) > best:
            best, same = float(np.median(overlap)), mover
    if same is None:
        return who
    gone = ~who.seen
    boxes, merged = np.where(gone[:, None], same.boxes, who.boxes), gone & same.merged
    return Mover(boxes, merged, {t: (same.parts if gone[t] else who.parts).get(t, []) for t in range(len(gone))})
