"""Whom to follow: candidates among what moves in a film, what speaks for a walking person, and the choice.

A walker travels steadily (across the picture, or by growing and shrinking), is upright, opens and closes the legs at
the rhythm of steps, is seen for a while, and is no smaller than what else moves. A logistic regression on these is the
probability that a mover walks. It was fitted to the development films of `benchmarks/tracking/choosing.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionenv.errors import MotionError
from motionenv.tracking.video.movers import Mover, areas, common_areas
from motionenv.types import Points

_STEPS = (0.33, 0.8)  # [s] shortest and longest duration of a step
_DRIFT = 1.0  # [s] over which slow changes of the outline are removed
_LEGS = 0.4  # lower part of an outline that shows the legs
_DEPTH = 2.0  # travel in depth per relative growth: that of somebody two heights away; most are farther
_BRIEF = 0.6  # [s] least duration of a candidate
_PIECE = 3.0  # [s] longest piece of a film from which evidence is taken, as in the films it was fitted to
_LEAST_TRAVEL = 0.1  # [heights/s] least of who walks; the slowest of the development films have 0.13
_SURE = 0.7  # least probability of walking of whom is chosen without being named; those films' wrong ones have less
#: Weights of log(travel + 0.05), log(jitter + 0.02), log upright, (log upright - 1)², rhythm above 0, log seconds and
#: log(height / the tallest's), and the constant: logistic regression with a Gaussian penalty.
_WEIGHTS = np.array([2.32, -1.86, 5.71, -5.42, 2.31, 1.59, 4.69, -5.91])


@dataclass(frozen=True, eq=False)
class Candidate:
    """Something in a film that moves, and what speaks for a walking person.

    Attributes:
        number: from 1, the likeliest walker first.
        boxes: (T, 4) first and last column, first and last row [pixels of the film]; NaN where it isn't seen.
        fps: frame rate of the boxes [Hz].
        height: of the outline [pixels of the film], the median.
        travel: [outline heights per second] across the picture and in depth, along the best straight line.
        jitter: distance from that line [heights].
        upright: height over width, the median.
        rhythm: correlation of the legs' opening with itself one step later, from -1 to 1.
        seconds: for how long it is seen [s].
        walks: probability that it is a walking person.
        mover: its outlines.
        points: of the person, if detections told whom the film shows.
    """

    number: int
    boxes: np.ndarray
    fps: float
    height: float
    travel: float
    jitter: float
    upright: float
    rhythm: float
    seconds: float
    walks: float
    mover: Mover
    points: Points | None = None

    def __repr__(self) -> str:
        return f"Candidate({self})"

    def __str__(self) -> str:
        seen = np.flatnonzero(np.isfinite(self.boxes[:, 0])) / self.fps
        x, y = np.nanmedian(self.boxes[:, :2].mean(axis=1)), np.nanmedian(self.boxes[:, 2:].mean(axis=1))
        what = f"walks with probability {self.walks:.2f}" if self.points is None else "detected"
        return (
            f"{self.number}: {what}; seen from {seen[0]:.1f} to {seen[-1]:.1f} s "
            f"about ({x:.0f}, {y:.0f}), {self.height:.0f} pixels tall; travels {self.travel:.2f} heights a second; "
            f"{self.upright:.1f} times as tall as wide; rhythm of steps {self.rhythm:.2f}"
        )


def evidence(mover: Mover, labels: np.ndarray, fps: float) -> np.ndarray:
    """Travel, jitter, uprightness, rhythm, duration [s] and height [pixels] (6,) of a `mover`, as in `Candidate`.

    `labels` (T, height, width) are of the outlines, `fps` is the frame rate [Hz].
    """
    frames = np.flatnonzero(mover.seen & ~mover.merged)
    frames = frames if len(frames) > 2 else np.flatnonzero(mover.seen)
    boxes, time = mover.boxes[frames], frames / fps
    tall, wide = boxes[:, 3] - boxes[:, 2] + 1, boxes[:, 1] - boxes[:, 0] + 1
    height = float(np.median(tall))
    path = np.column_stack([boxes[:, :2].mean(axis=1) / height, boxes[:, 2:].mean(axis=1) / height, np.log(tall)])
    line = np.column_stack([np.ones(len(time)), time])
    slope, jitter = np.zeros(3), 0.0
    if len(frames) > 2:
        fitted = np.linalg.lstsq(line, path, rcond=None)[0]
        slope, jitter = fitted[1] * [1, 1, _DEPTH], float(np.sqrt(((path - line @ fitted) ** 2).sum(axis=1).mean()))
    upright, seconds = float(np.median(tall / wide)), len(frames) / fps
    return np.array([np.linalg.norm(slope), jitter, upright, _rhythm(mover, labels, fps), seconds, height])


def _rhythm(mover: Mover, labels: np.ndarray, fps: float) -> float:
    """Greatest autocorrelation of the legs' opening at the duration of a step; 0 if seen for less than two steps."""
    from scipy.ndimage import uniform_filter1d

    opening = np.full(len(labels), np.nan)
    for t in np.flatnonzero(mover.seen & ~mover.merged).tolist():
        c0, c1, r0, r1 = mover.boxes[t].astype(int)
        from_row = round(r1 - _LEGS * (r1 - r0))
        columns = np.nonzero(np.isin(labels[t, from_row : r1 + 1, c0 : c1 + 1], mover.parts[t]))[1]
        if len(columns):
            opening[t] = columns.std() / (r1 - r0 + 1)
    known = np.flatnonzero(np.isfinite(opening))
    if len(known) < 2 * _STEPS[1] * fps:
        return 0.0
    signal = np.interp(np.arange(known[0], known[-1] + 1), known, opening[known])
    signal = signal - uniform_filter1d(signal, max(3, round(_DRIFT * fps)), mode="nearest")
    lags = range(max(1, int(_STEPS[0] * fps)), int(_STEPS[1] * fps) + 1)
    values = [_correlation(signal[lag:], signal[:-lag]) for lag in lags]
    return max(values)


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    size = np.sqrt((one**2).sum() * (other**2).sum())
    return float((one * other).sum() / size) if size > 1e-12 else 0.0


def candidates(movers: Sequence[Mover], labels: np.ndarray, fps: float, scale: float = 1.0) -> list[Candidate]:
    """Those of `movers` that are seen for long enough, the likeliest walker first.

    `labels` (T, height, width) are of the outlines at `fps` [Hz]; `scale` is pixels of the film per pixel of these.
    """
    long = [m for m in movers if m.seen.sum() >= _BRIEF * fps]
    pieces = [[evidence(p, labels, fps) for p in _pieces(m, fps)] for m in long]
    tallest = max((e[5] for piece in pieces for e in piece), default=1.0)
    found = []
    for mover, piece in zip(long, pieces, strict=True):
        odds = [_log_odds(e, tallest) for e in piece]
        best = piece[int(np.argmax(odds))]
        boxes = (mover.boxes + 0.5) * scale - 0.5
        walks = float(1 / (1 + np.exp(-max(odds))))
        travel, jitter, upright, rhythm, _, height = best.tolist()
        seconds = float(mover.seen.sum()) / fps
        shape = (height * scale, travel, jitter, upright, rhythm)
        found.append(Candidate(0, boxes, fps, *shape, seconds, walks, mover))
    found.sort(key=lambda c: -c.walks)
    return [replace(c, number=i) for i, c in enumerate(found, 1)]


def chosen(
    found: Sequence[Candidate], *, person: int | None = None, box: Sequence[float] | None = None,
    point: Sequence[float] | None = None, at: float | None = None,
) -> Candidate:  # fmt: skip
    """The candidate of `found` that is asked for, or the likeliest walker.

    Args:
        person: its number.
        box, point: (x, y, width, height) around it, or (x, y) on it, in some frame [pixels of the film].
        at: [s] the moment of `box` or `point`; None is any.

    Raises:
        MotionError: nobody walks, or nothing is where it's asked for.
    """
    if not found:
        raise MotionError(f"no foreground: nothing of a person's size moves for {_BRIEF} s; the camera must be static")
    listed = " | ".join(str(c) for c in found[:4])
    if person is not None:
        if not 1 <= person <= len(found):
            raise MotionError(
                f"person must be from 1 to {len(found)}, the number of candidates, got {person}: {listed}"
            )
        return found[person - 1]
    if box is None and point is None:
        if found[0].walks < _SURE and found[0].points is None:
            raise MotionError(
                f"nobody seems to walk; choose whom to follow by person, box or point. What moves: {listed}"
            )
        return found[0]
    score = [float(np.nanmax(_matched(c, box, point, at), initial=0.0)) for c in found]
    if max(score) <= 0:
        raise MotionError(f"nothing moves at {'box' if box is not None else 'point'}; what moves: {listed}")
    return found[int(np.argmax(score))]


def _matched(one: Candidate, box, point, at: float | None) -> np.ndarray:
    """How well a candidate fits a box or point, in all frames or at a moment: overlap, or nearness to its middle.

    While it isn't seen, because it's hidden or one with another outline, its box is between those before and after.
    """
    boxes, frames = one.boxes, np.arange(len(one.boxes))
    alone = np.flatnonzero(one.mover.seen & ~one.mover.merged)
    if len(alone):
        between = np.stack([np.interp(frames, alone, b[alone], np.nan, np.nan) for b in one.boxes.T], axis=1)
        boxes = np.where(np.isfinite(between), between, one.boxes)
    boxes = boxes if at is None else boxes[round(at * one.fps) :][:1]
    if box is not None:
        x, y, wide, tall = box
        asked = np.array([[x, x + wide - 1, y, y + tall - 1]])
        common = common_areas(boxes, asked)[:, 0]
        return common / (areas(boxes) + areas(asked) - common)
    size = np.maximum(boxes[:, 1::2] - boxes[:, ::2], 1)
    off = np.abs(np.asarray(point) - (boxes[:, ::2] + boxes[:, 1::2]) / 2) / size
    return np.where((off <= 0.5).all(axis=1), 1.5 - off.sum(axis=1), 0.0)


def _pieces(mover: Mover, fps: float) -> list[Mover]:
    first, last = np.flatnonzero(mover.seen)[[0, -1]]
    long, frames = round(_PIECE * fps), np.arange(len(mover.boxes))
    starts = range(first, max(first + 1, last + 2 - long), max(1, long // 2))
    inside = [(frames >= s) & (frames < s + long) & mover.seen for s in starts]
    return [replace(mover, boxes=np.where(i[:, None], mover.boxes, np.nan)) for i in inside if i.sum() >= _BRIEF * fps]


def _log_odds(found: np.ndarray, tallest: float) -> float:
    travel, jitter, upright, rhythm, seconds, height = found
    terms = [
        np.log(travel + 0.05), np.log(jitter + 0.02), np.log(upright), (np.log(upright) - 1) ** 2, max(rhythm, 0.0),
        np.log(seconds), np.log(height / tallest), 1.0,
    ]  # fmt: skip
    return float(_WEIGHTS @ terms) if travel >= _LEAST_TRAVEL else -np.inf
