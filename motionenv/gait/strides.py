"""Strides: from one initial contact of a foot to its next, or from one phase of a stride to the same of the next.

A stride of `find_strides` begins and ends with contacts. A short capture may show no foot's contact twice, but the same
phase of two strides: those of `strides_by_phase` begin with toe-off, or where a foot passes the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

from motionenv._core.representation import OneLine
from motionenv.gait.events import Events, backward_share, directions
from motionenv.gait.feet import Feet, smoothed
from motionenv.gait.stretches import Stretch, belt, heading

_STRIDE = (0.4, 3.0)  # [s] plausible duration
_PAUSE = 0.3  # [s] for which the pelvis may stand during a stride that is shorter than `_STEP`
_STEP = 0.3  # [m]
_FLAT = (0.25, 0.5)  # shares of stance between which the foot lies flat, of runners too
_STANCE = 2.0  # [s] longest
_PASSES = 7.0  # [Hz] cut-off frequency for feet that pass each other
_LEAD = 0.08  # [m] by which each foot is ahead of the other in a stride, at least
_STANCES = 5  # over which a belt's velocity is the median
_NAN = float("nan")
_OTHER = {"left": "right", "right": "left"}


@dataclass(frozen=True, repr=False)
class Stride(OneLine):
    """One stride. Times are in seconds since the first frame; NaN where unknown.

    Attributes:
        side: "left" or "right".
        start, end: initial contact, and the next of this side.
        kind: what the walker does: "steady", "turning" or "changing speed", if a part of the stride is not steady.
        turn: by which the path of the pelvis turns to the left meanwhile [degrees]; 0 on a treadmill.
        contact: initial contact within a stride that begins and ends with another phase; NaN if it begins with one.
        toe_off: of this side.
        opposite_off: toe-off of the other side, which ends the first double support; NaN in running, which has none.
        opposite_contact: initial contact of the other side.
        length: distance between the heel's places at its two contacts [m].
        step_length: from the other heel at its contact to this heel at its second, along the line of the stride [m].
        step_width: distance of the other heel from the line of the stride [m] (Huxham et al. 2006); negative where the
            feet cross.
    """

    side: str
    start: float
    end: float
    toe_off: float = _NAN
    opposite_off: float = _NAN
    opposite_contact: float = _NAN
    length: float = _NAN
    step_length: float = _NAN
    step_width: float = _NAN
    kind: str = "steady"
    turn: float = _NAN
    contact: float = _NAN

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.end - self.start

    @property
    def speed(self) -> float:
        """Length over duration [m/s]."""
        return self.length / self.seconds

    @property
    def curvature(self) -> float:
        """Turn to the left per length [1/m]."""
        return float(np.radians(self.turn)) / self.length

    @property
    def activity(self) -> str:
        """What is done: "running" if the foot leaves the ground before the other one meets it, or else "walking"."""
        return "running" if self.toe_off < self.opposite_contact else "walking"


def find_strides(feet: Feet, events: Events, stretches: Sequence[Stretch]) -> tuple[Stride, ...]:
    """The strides of the `feet` from `events`, in the order of time, in all `stretches` but unseen ones.

    Of two contacts between which one was missed, there is no stride. On a treadmill, lengths are over its belt.
    """
    carried = belt(feet)
    placed = feet if carried is None else _over_belt(feet, events, carried)
    turned = heading(feet) if carried is None else np.zeros(len(feet.pelvis))
    towards = -1.0 if backward_share(feet) > 0.5 else 1.0
    found = []
    for side in feet.sides:
        for start, end in pairwise(events.times("initial_contact", side)):
            kind, stands = _kind(start, end, stretches)
            if kind and _STRIDE[0] <= end - start <= _STRIDE[1] and not _several(events, side, start, end):
                turn = np.diff(np.interp([start, end], np.arange(len(turned)) / feet.fps, turned))[0]
                stride = replace(_timed(events, side, start, end), kind=kind, turn=float(turn))
                stride = _placed(stride, placed, towards)
                if stands <= _PAUSE or stride.length >= _STEP:
                    found.append(stride)
    return tuple(sorted(found, key=lambda stride: stride.start))


def strides_by_phase(feet: Feet, events: Events, stretches: Sequence[Stretch]) -> tuple[Stride, ...]:
    """Strides of the `feet` between other phases than contacts, in the order of time, in `stretches` that are seen.

    They go from toe-off to the next of the same side, by `events`; if there are none, from where a foot passes the
    other to where it does so again. Their length is that of the pelvis' way (and the belt's); of events, they have but
    a contact.
    """
    carried = belt(feet)
    turned = heading(feet) if carried is None else np.zeros(len(feet.pelvis))
    between = [(side, *times) for side in feet.sides for times in pairwise(events.times("toe_off", side))]
    found = []
    for side, start, end in between or _passes(feet):
        kind, stands = _kind(start, end, stretches)
        if kind and stands <= _PAUSE and _STRIDE[0] <= end - start <= _STRIDE[1]:
            way = _at(feet.pelvis, end, feet.fps) - _at(feet.pelvis, start, feet.fps)
            way = way if carried is None else way - carried * (end - start)
            turn = np.diff(np.interp([start, end], np.arange(len(turned)) / feet.fps, turned))[0]
            length = float(np.linalg.norm(way))
            contact = next((t for t in events.times("initial_contact", side) if start < t < end), _NAN)
            found.append(Stride(side, start, end, length=length, kind=kind, turn=float(turn), contact=contact))
    return tuple(sorted(found, key=lambda stride: stride.start))


def _passes(feet: Feet) -> list[tuple[str, float, float]]:
    """The side of a foot that passes the other one, when, and when it does so again [s]."""
    if len(feet.sides) < 2 or len(feet.pelvis) < 2:
        return []
    middle = [smoothed(0.5 * (feet.heel[s] + feet.toe[s])[:, :2], feet.fps, _PASSES) for s in ("left", "right")]
    lead = ((middle[0] - middle[1]) * directions(feet)).sum(-1)
    found = []
    for side, ahead in (("left", lead), ("right", -lead)):
        before = np.flatnonzero((ahead[:-1] < 0) & (ahead[1:] >= 0))
        times = (before + ahead[before] / (ahead[before] - ahead[before + 1])) / feet.fps
        for first, (start, end) in zip(before, pairwise(times.tolist()), strict=False):
            inside = ahead[first : round(end * feet.fps)]
            if min(inside.max(initial=0.0), -inside.min(initial=0.0)) > _LEAD:
                found.append((side, start, end))
    return found


def _over_belt(feet: Feet, events: Events, carried: np.ndarray) -> Feet:
    """The feet of somebody on a treadmill as they would be on a floor.

    The belt moves as the feet do that lie flat on it; where no stance is known, at the velocity `carried`.
    """
    times, velocities = [], []
    for side in feet.sides:
        foot = 0.5 * (feet.heel[side] + feet.toe[side])
        offs = np.array(events.times("toe_off", side))
        for contact in events.times("initial_contact", side):
            off = min(offs[offs > contact], default=np.inf)
            if off - contact < _STANCE:
                first, last = (contact + share * (off - contact) for share in _FLAT)
                times.append(0.5 * (first + last))
                velocities.append((_at(foot, last, feet.fps) - _at(foot, first, feet.fps)) / (last - first))
    known = np.isfinite(velocities).all(-1) if velocities else np.zeros(0, dtype=bool)
    clock = np.arange(len(feet.pelvis)) / feet.fps
    if known.any():
        order = np.argsort(np.array(times)[known])
        smooth = median_filter(np.array(velocities)[known][order], (_STANCES, 1), mode="nearest")
        velocity = np.stack([np.interp(clock, np.array(times)[known][order], column) for column in smooth.T], -1)
    else:
        velocity = np.broadcast_to(carried, (len(clock), 2))
    moved = np.zeros((len(clock), 3))
    moved[1:, :2] = np.cumsum(0.5 * (velocity[1:] + velocity[:-1]), axis=0) / feet.fps
    still = lambda paths: {side: path - moved for side, path in paths.items()}
    return replace(feet, pelvis=feet.pelvis - moved, heel=still(feet.heel), toe=still(feet.toe))


def _kind(start: float, end: float, stretches: Sequence[Stretch]) -> tuple[str, float]:
    """What somebody does between two times, "" where he isn't seen, and for how long [s] he stands."""
    shared = {s.kind: 0.0 for s in stretches}
    for s in stretches:
        shared[s.kind] += max(min(end, s.end) - max(start, s.start), 0.0)
    stands = shared.get("standing", 0.0)
    if shared.get("unseen", 0.0) > 0:
        return "", stands
    changes = (shared.get("changing speed", 0.0) + stands, "changing speed")
    most = max((shared.get("turning", 0.0), "turning"), changes)
    return (most[1] if most[0] > 0 else "steady"), stands


def _several(events: Events, side: str, start: float, end: float) -> bool:
    """Whether most of what happens once in a stride happens more often between two times."""
    others = [
        (kind, s) for kind in ("initial_contact", "toe_off") for s in _OTHER if (kind, s) != ("initial_contact", side)
    ]
    counts = [sum(start < t < end for t in events.times(*other)) for other in others]
    return sum(n > 1 for n in counts) > 0.5 * sum(n > 0 for n in counts)


def _timed(events: Events, side: str, start: float, end: float) -> Stride:
    other = _OTHER[side]
    within = lambda kind, whose: [t for t in events.times(kind, whose) if start < t < end]
    offs, opposite_offs, contacts = within("toe_off", side), within("toe_off", other), within("initial_contact", other)
    toe_off = offs[0] if len(offs) == 1 else _NAN
    contact = contacts[0] if len(contacts) == 1 else _NAN
    off = opposite_offs[0] if len(opposite_offs) == 1 else _NAN
    if start < toe_off < contact < off < end:  # running: the other foot leaves the ground before this one meets it
        off = _NAN
    elif not _ordered([start, off, contact, toe_off, end]):
        off = contact = toe_off = _NAN  # events that contradict each other tell nothing
    return Stride(side, start, end, toe_off, off, contact)


def _placed(stride: Stride, feet: Feet, towards: float) -> Stride:
    """A stride with its distances; `towards` is -1 of who walks backwards, and so has his left on the right."""
    heel, other = feet.heel[stride.side], _OTHER[stride.side]
    first, last = (_at(heel, t, feet.fps) for t in (stride.start, stride.end))
    length = float(np.linalg.norm(last - first))
    if not (np.isfinite(stride.opposite_contact) and other in feet.heel and length > 0):
        return replace(stride, length=length)
    along = (last - first) / length
    apart = last - _at(feet.heel[other], stride.opposite_contact, feet.fps)
    to_the_left = float(along[0] * apart[1] - along[1] * apart[0])
    outwards = towards if stride.side == "left" else -towards
    return replace(stride, length=length, step_length=float(apart @ along), step_width=outwards * to_the_left)


def _ordered(times: Sequence[float]) -> bool:
    known = [t for t in times if np.isfinite(t)]
    return all(a < b for a, b in pairwise(known))


def _at(path: np.ndarray, time: float, fps: float) -> np.ndarray:
    """Horizontal position (2,) [m] at a time, between frames linearly; NaN in gaps."""
    frame = min(max(time * fps, 0.0), len(path) - 1.0)
    i = min(int(frame), len(path) - 2) if len(path) > 1 else 0
    share = frame - i
    after = path[min(i + 1, len(path) - 1), :2]
    return (1 - share) * path[i, :2] + share * after


#: Samples of a normalised curve: 0 to 100 % of the cycle.
SAMPLES = 101


def normalised(values: np.ndarray, fps: float, strides: Sequence[Stride]) -> np.ndarray:
    """Cut curves `values` (frames, n), NaN in gaps, into `strides` and resample each at 0, 1, ..., 100 % of its cycle.

    At the frame rate `fps` [Hz]. The result (strides, 101, n) is linearly interpolated; NaN beside unknown frames. A
    stride with a contact within it is cut there, and its parts are exchanged.
    """
    values = np.asarray(values, dtype=np.float64)
    share = np.linspace(0.0, 1.0, SAMPLES)
    out = np.full((len(strides), SAMPLES, values.shape[1]), np.nan)
    for cut, stride in zip(out, strides, strict=True):
        late = 0.0 if np.isnan(stride.contact) else (stride.contact - stride.start) / stride.seconds
        frames = (stride.start + np.where(late + share > 1, late + share - 1, late + share) * stride.seconds) * fps
        inside = (frames >= 0) & (frames <= len(values) - 1)
        before = np.minimum(frames[inside].astype(int), max(len(values) - 2, 0))
        weight = (frames[inside] - before)[:, None]
        after = np.minimum(before + 1, len(values) - 1)
        cut[inside] = np.where(weight > 0, (1 - weight) * values[before] + weight * values[after], values[before])
    return out


def mean_and_sd(curves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of `curves` (n, ...) at each sample; NaN where fewer than one or two are known."""
    known = np.isfinite(curves)
    count = known.sum(0)
    mean = np.where(known, curves, 0.0).sum(0) / np.where(count > 0, count, np.nan)
    squares = np.where(known, (curves - mean) ** 2, 0.0).sum(0)
    return mean, np.sqrt(squares / np.where(count > 1, count - 1, np.nan))
