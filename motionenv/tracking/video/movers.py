"""What moves in a film: outlines linked over time into movers.

Each frame's connected components of the foreground are assigned to predicted boxes (constant velocity), one to one and
with the greatest total overlap. Pieces within a mover's box join it; a mover whose predicted box another's component
covers has merged with it and keeps its predicted box, moved inside the component, until they separate. What isn't seen
for `_GAP` seconds, or has left the picture, is never taken up again: who comes later is somebody else.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

_GAP = 1.0  # [s] longest gap in which a mover is behind something
_LEAST = 12  # [pixels] least area of a component
_OVERLAP = 0.3  # least overlap of a predicted box with a component, relative to the smaller of both
_PART = 0.25  # weight of that overlap against that relative to the union of both, so that specks don't swap bodies
#: Greatest area, relative to the predicted box, of what another's component leaves of a mover: the only value tried.
_REST = 0.6
_COVERED = 0.5  # least part of a predicted box inside another mover's component, to have merged with it
_GROWN = (5, 0.15)  # least frames of a mover that can merge, and its least area relative to the component
_UPRIGHT, _SMALL = 1.5, 0.2  # height over width of a body, and area of a piece beside it relative to the body's
_RECENT = 0.4  # [s] from which velocities are estimated
_MARGIN = 0.15  # space kept around a mover's box, in its heights


@dataclass(eq=False)
class Mover:
    """Something that moves, and where.

    Attributes:
        boxes: (T, 4) first and last column, first and last row [pixels]; NaN where it isn't seen.
        merged: (T,) bool, whether the box is predicted, because the outline is one with another mover's.
        parts: numbers of its components in each frame's label image, by frame.
    """

    boxes: np.ndarray
    merged: np.ndarray
    parts: dict[int, list[int]] = field(default_factory=dict)

    @property
    def seen(self) -> np.ndarray:
        return np.isfinite(self.boxes[:, 0])


def components(foreground: np.ndarray) -> np.ndarray:
    """Numbered outlines (height, width) of a `foreground` (height, width) of probabilities, 0 for none.

    Gaps of about a sixtieth of the height are closed.
    """
    from scipy.ndimage import binary_closing, label

    reach = max(1, round(len(foreground) / 60))
    solid = foreground > 0.5
    padded = np.pad(solid, reach)
    closed = binary_closing(padded, np.ones((2 * reach + 1, reach + 1)))[reach:-reach, reach:-reach]
    labels = label(closed | solid, structure=np.ones((3, 3)))[0] * solid
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.where(sizes[labels] >= _LEAST, labels, 0)


def linked(labels: np.ndarray, fps: float) -> list[Mover]:
    """Movers in label images (T, height, width) at `fps` [Hz], in the order of their appearance.

    `labels` are as `components` numbers them.
    """
    movers: list[Mover] = []
    for t, image in enumerate(labels):
        _frame(movers, [m for m in movers if _alive(m, t, fps, image.shape)], t, image, fps, len(labels))
    return movers


def window(labels: np.ndarray, who: Mover, others: Sequence[Mover]) -> np.ndarray:
    """Where (T, height, width) a mover `who` can be seen: near its box, and not on an outline of `others` only.

    `labels` are those of the outlines (T, height, width).
    """
    mine = np.zeros(labels.shape, dtype=bool)
    for t in np.flatnonzero(who.seen).tolist():
        c0, c1, r0, r1 = who.boxes[t]
        space = _MARGIN * (r1 - r0) + 1
        rows = slice(max(0, int(r0 - space)), int(r1 + space) + 2)
        columns = slice(max(0, int(c0 - space)), int(c1 + space) + 2)
        theirs = [p for m in others if m is not who for p in m.parts.get(t, []) if p not in who.parts.get(t, [])]
        mine[t, rows, columns] = ~np.isin(labels[t, rows, columns], theirs)
    return mine


def _alive(mover: Mover, t: int, fps: float, shape: tuple) -> bool:
    last = int(np.flatnonzero(mover.seen)[-1])
    box = _predicted(mover, t, fps)
    middle = box[:2].mean(), box[2:].mean()
    return t - last <= _GAP * fps and 0 <= middle[0] < shape[1] and 0 <= middle[1] < shape[0]


def _predicted(mover: Mover, t: int, fps: float) -> np.ndarray:
    seen = np.flatnonzero(mover.seen)
    last = seen[-1]
    known = seen[~mover.merged[seen]]
    recent = known[known >= known[-1] - _RECENT * fps] if len(known) else seen[-1:]
    if len(recent) < 3:
        return mover.boxes[last]
    velocity = (mover.boxes[recent[-1]] - mover.boxes[recent[0]]).reshape(2, 2).mean(axis=1)
    velocity /= recent[-1] - recent[0]
    return mover.boxes[last] + np.repeat(velocity, 2) * (t - last)


def _assigned(expected: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Number (components,) of the mover to whose predicted box each component's box belongs; -1 for none."""
    from scipy.optimize import linear_sum_assignment

    owner = np.full(len(boxes), -1)
    if not len(expected) or not len(boxes):
        return owner
    common = common_areas(expected, boxes)
    share = common / np.minimum(areas(expected)[:, None], areas(boxes))
    union = areas(expected)[:, None] + areas(boxes) - common
    for k, c in zip(*linear_sum_assignment(-(_PART * share + common / union)), strict=True):
        if share[k, c] > _OVERLAP:
            owner[c] = k
    whole = np.isin(np.arange(len(expected)), owner)
    for c in np.flatnonzero(owner < 0):  # a piece of a body
        inside = np.where(whole, common[:, c] / areas(boxes)[c], 0.0)
        k = int(inside.argmax())
        if inside[k] > _COVERED and _one_body(boxes[owner == k], boxes[c]):
            owner[c] = k
    return owner


def _one_body(parts: np.ndarray, piece: np.ndarray) -> bool:
    """Whether a piece's box (4,) can belong to the body of other boxes (n, 4): not if two people stand side by side."""
    main, both = _hull(parts), _hull(np.vstack([parts, piece]))
    stacked = min(main[1], piece[1]) - max(main[0], piece[0]) + 1 > 0.5 * (piece[1] - piece[0] + 1)
    upright = both[3] - both[2] > _UPRIGHT * (both[1] - both[0])
    return bool(stacked or upright or areas(piece[None])[0] < _SMALL * areas(main[None])[0])


def _frame(movers: list[Mover], active: list[Mover], t: int, image: np.ndarray, fps: float, frames: int) -> None:
    from scipy.ndimage import find_objects

    found = [(number, at) for number, at in enumerate(find_objects(image), 1) if at is not None]
    boxes = np.array([[c.start, c.stop - 1, r.start, r.stop - 1] for _, (r, c) in found], dtype=float).reshape(-1, 4)
    expected = np.array([_predicted(m, t, fps) for m in active]).reshape(-1, 4)
    owner = _assigned(expected, boxes)
    for k in np.unique(owner[owner >= 0]):
        mine = np.flatnonzero(owner == k)
        active[k].boxes[t] = _hull(boxes[mine])
        active[k].parts[t] = [found[c][0] for c in mine]
    grown = np.array([m.seen.sum() >= _GROWN[0] for m in active], dtype=bool)
    for k in np.flatnonzero(grown):
        mine = owner == k
        if mine.any() and areas(_hull(boxes[mine])[None])[0] > _REST * areas(expected[[k]])[0]:
            continue  # seen by itself
        inside = np.where(mine, 0.0, common_areas(expected[[k]], boxes)[0] / areas(expected[[k]]))
        where = int(inside.argmax()) if len(boxes) else 0
        if not len(boxes) or inside[where] < _COVERED or owner[where] < 0 or not grown[owner[where]]:
            continue
        if areas(expected[[k]])[0] > _GROWN[1] * areas(boxes)[where]:
            for j in (k, owner[where]):
                parts = np.union1d(np.flatnonzero(owner == j), where)
                active[j].boxes[t], active[j].merged[t] = _within(expected[j], _hull(boxes[parts])), True
                active[j].parts[t] = [found[c][0] for c in parts]
    for c in np.flatnonzero(owner < 0):
        movers.append(Mover(np.full((frames, 4), np.nan), np.zeros(frames, dtype=bool), {t: [found[c][0]]}))
        movers[-1].boxes[t] = boxes[c]


def _within(box: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """A box (4,) moved into another; into its middle where it's larger."""
    shift = np.maximum(outer[::2] - box[::2], 0) + np.minimum(outer[1::2] - box[1::2], 0)
    fits = box[1::2] - box[::2] <= outer[1::2] - outer[::2]
    middle = (outer[::2] + outer[1::2] - box[::2] - box[1::2]) / 2
    return box + np.repeat(np.where(fits, shift, middle), 2)


def _hull(boxes: np.ndarray) -> np.ndarray:
    return np.stack([boxes.min(axis=0), boxes.max(axis=0)])[[0, 1, 0, 1], np.arange(4)]


def areas(boxes: np.ndarray) -> np.ndarray:
    """Areas (n,) [pixels] of `boxes` (n, 4): first and last column, first and last row."""
    return (boxes[:, 1] - boxes[:, 0] + 1) * (boxes[:, 3] - boxes[:, 2] + 1)


def common_areas(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Common areas (n, m) [pixels] of every two boxes, `one` (n, 4) and `other` (m, 4), as in `areas`."""
    low, high = np.maximum(one[:, None], other), np.minimum(one[:, None], other)
    return np.prod(np.maximum(high[..., 1::2] - low[..., ::2] + 1, 0), axis=-1)
