"""Whom a film shows, as detections tell, and the choice of whom to follow."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import Points

_AROUND = np.array([-0.07, 0.07, -0.10, 0.06])  # a body's box beyond its markers', in heights of the latter
_LEAST_POINTS = 6  # markers of a frame from which it has a box
_BRIEF, _GAP = 0.6, 1.0  # [s] least duration of a candidate, and most between detections that a box is interpolated


@dataclass(frozen=True, eq=False)
class Candidate:
    """A person in a film.

    Attributes:
        number: from 1, who is largest, surest and longest in the picture first.
        boxes: (T, 4) first and last column, first and last row [pixels of the film]; NaN where nobody is seen.
        fps: frame rate of the boxes [Hz].
        points: what was detected.
    """

    number: int
    boxes: np.ndarray
    fps: float
    points: Points

    def __repr__(self) -> str:
        return f"Candidate({self})"

    def __str__(self) -> str:
        seen = np.flatnonzero(self.seen) / self.fps
        x, y = np.nanmedian(self.boxes[:, :2].mean(axis=1)), np.nanmedian(self.boxes[:, 2:].mean(axis=1))
        return (
            f"{self.number}: seen from {seen[0]:.1f} to {seen[-1]:.1f} s about ({x:.0f}, {y:.0f}), "
            f"{self.height:.0f} pixels tall"
        )

    @property
    def seen(self) -> np.ndarray:
        """(T,) whether the person has a box."""
        return np.isfinite(self.boxes[:, 0])

    @property
    def height(self) -> float:
        """Height of the box [pixels of the film], the median."""
        return float(np.nanmedian(self.boxes[:, 3] - self.boxes[:, 2] + 1))


def candidates(
    people: Sequence[Points], fps: float, frames: int, size: tuple[int, int], region: Sequence[float] | None = None
) -> list[Candidate]:
    """Those of `people` who are in a film of so many `frames` at `fps` [Hz] for long enough, best seen first.

    `size` is the film's width and height [pixels], and `region` (x, y, width, height) where the middle of a person must
    be, at least half of the time; None is everywhere.
    """
    found = []
    for points in people:
        boxes = _bridged(boxes_of(at_frames(points.positions, points.fps, fps, frames)), round(_GAP * fps))
        boxes = np.clip(boxes, 0, np.repeat(size, 2) - 1.0)
        seen = np.isfinite(boxes[:, 0])
        if seen.sum() >= _BRIEF * fps and _inside(boxes[seen], region):
            found.append(Candidate(0, boxes, fps, points))
    found.sort(key=_presence, reverse=True)
    return [replace(one, number=i) for i, one in enumerate(found, 1)]


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


def chosen(
    found: Sequence[Candidate], *, person: int | None = None, box: Sequence[float] | None = None,
    point: Sequence[float] | None = None, at: float | None = None,
) -> Candidate:  # fmt: skip
    """The candidate of `found` that is asked for, or the first.

    Args:
        person: its number.
        box, point: (x, y, width, height) around it, or (x, y) on it, in some frame [pixels of the film].
        at: [s] the moment of `box` or `point`; None is any.

    Raises:
        MotionError: nobody is there, or nobody where it's asked for.
    """
    if not found:
        raise MotionError(f"nobody is detected for {_BRIEF} s: there is nobody to follow")
    listed = " | ".join(str(c) for c in found[:4])
    if person is not None:
        if not 1 <= person <= len(found):
            raise MotionError(f"person must be from 1 to {len(found)}, the number of people, got {person}: {listed}")
        return found[person - 1]
    if box is None and point is None:
        return found[0]
    score = [float(np.nanmax(_matched(c, box, point, at), initial=0.0)) for c in found]
    if max(score) <= 0:
        raise MotionError(f"nobody is at {'box' if box is not None else 'point'}; who is seen: {listed}")
    return found[int(np.argmax(score))]


def areas(boxes: np.ndarray) -> np.ndarray:
    """Areas (n,) [pixels] of `boxes` (n, 4): first and last column, first and last row."""
    return (boxes[:, 1] - boxes[:, 0] + 1) * (boxes[:, 3] - boxes[:, 2] + 1)


def common_areas(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Areas (n,) [pixels] common to boxes `one` (n, 4) and `other` (n, 4), or (1, 4)."""
    low, high = np.maximum(one, other), np.minimum(one, other)
    return np.prod(np.maximum(high[:, 1::2] - low[:, ::2] + 1, 0), axis=1)


def _bridged(boxes: np.ndarray, most: int) -> np.ndarray:
    """Boxes (T, 4), interpolated over gaps of at most so many frames."""
    known = np.flatnonzero(np.isfinite(boxes[:, 0]))
    out = boxes.copy()
    for a, b in pairwise(known):
        if b - a - 1 <= most:
            out[a:b] = boxes[a] + (boxes[b] - boxes[a]) * (np.arange(b - a) / (b - a))[:, None]
    return out


def _inside(boxes: np.ndarray, region) -> bool:
    if region is None:
        return True
    x, y, wide, tall = region
    across, down = boxes[:, :2].mean(axis=1) - x, boxes[:, 2:].mean(axis=1) - y
    return bool(np.mean((across >= 0) & (across <= wide) & (down >= 0) & (down <= tall)) >= 0.5)


def _presence(one: Candidate) -> float:
    """Heights of a person in the picture, weighted by the confidence of their points and summed over frames."""
    points = one.points
    boxes, seen = boxes_of(points.positions), np.isfinite(points.positions[..., 0])
    sure = seen if points.confidence is None else seen * points.confidence
    return float(np.nansum((boxes[:, 3] - boxes[:, 2]) * sure.sum(axis=1)))


def _matched(one: Candidate, box, point, at: float | None) -> np.ndarray:
    """How well a candidate fits a box or point, in all frames or at a moment: overlap, or nearness to its middle."""
    boxes = one.boxes if at is None else one.boxes[round(at * one.fps) :][:1]
    if box is not None:
        x, y, wide, tall = box
        asked = np.array([[x, x + wide - 1, y, y + tall - 1]])
        common = common_areas(boxes, asked)
        return common / (areas(boxes) + areas(asked) - common)
    size = np.maximum(boxes[:, 1::2] - boxes[:, ::2], 1)
    off = np.abs(np.asarray(point) - (boxes[:, ::2] + boxes[:, 1::2]) / 2) / size
    return np.where((off <= 0.5).all(axis=1), 1.5 - off.sum(axis=1), 0.0)
