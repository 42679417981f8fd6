"""The strides of a captured walk that models learn from, each along its own chord.

A long, straight and steady walk is cut by its period, as in paper A, section 3. Of other captures (of one or two
strides, on a curve, on a treadmill, of who jogs and turns) each stride is taken for itself: from a contact to the next
one of the same foot (`motionenv.gait`), or from one phase to the same of the next stride where contacts are too few.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.cycles import Alignment, to_reference
from motionenv.errors import MotionError
from motionenv.gait import Feet, Stride, feet_of, find_events, find_stretches, find_strides, strides_by_phase
from motionenv.gait.stretches import belt
from motionenv.mocap import MarkerMap
from motionenv.models.walking.preprocessing import (
    CHANNELS,
    STRAIGHT,
    closed,
    find_cycles,
    forward_speed,
    gait_channels,
    leading_phase,
    straightness,
    walking_cycles,
)
from motionenv.types import Cycles, Markers, Motion

__all__ = ["WalkStrides", "captured_cycles", "walk_strides"]

_HEADING = CHANNELS.index("root_heading")
_AHEAD = np.radians(60.0)  # greatest angle between where somebody faces and where he goes, who walks ahead
_LEGS = [CHANNELS.index(f"{side}_{angle}") for side in ("left", "right") for angle in ("hip_flexion", "knee_flexion")]
_AROUND, _REACH = 0.1, 0.12  # [s] around the beginning of a stride, and by how much of its duration contacts may err
_IN_PLACE = 0.2  # [m/s] of who is on a treadmill, at most
_ON_THE_SPOT = 120.0  # [degrees] of turning within a stride whose chord says no longer where it goes


@dataclass(frozen=True, eq=False, repr=False)
class WalkStrides(OneLine):
    """The strides of one capture.

    Attributes:
        strides: as of `motionenv.gait.find_strides`, with the speed, the curvature and the activity of each.
        found: "period" if models cut the whole walk by its period, else "events" or "phase".
        headings: (n,) direction of each stride's chord, from x towards y [rad]; on a treadmill that of walking.
    """

    strides: tuple[Stride, ...]
    found: str
    headings: np.ndarray

    @property
    def speed(self) -> float:
        """Mean speed [m/s], with equal weight for each second."""
        known = [s for s in self.strides if np.isfinite(s.length)]
        return float(sum(s.length for s in known) / sum(s.seconds for s in known))


def walk_strides(
    motion: Motion, capture: Markers | Motion | None = None, marker_map: MarkerMap | str | None = None
) -> WalkStrides:
    """The strides of a captured walk, `motion` (frames, 25).

    Args:
        motion: of the body.
        capture: the markers that it was retargeted from, whose file may state events and force plates; None finds the
            events in `motion`.
        marker_map: which of the capture's points are which landmarks; None recognises the marker set.

    Raises:
        MotionError: no stride, or none ahead; several motions.
        GapError: no foot or pelvis.
    """
    try:
        found = _by_period(motion)
    except MotionError as error:
        found = _by_events(motion, motion if capture is None else capture, marker_map, error)
    facing = np.abs(_facing(motion, found))
    ahead = (facing <= _AHEAD) & (np.abs([stride.turn for stride in found.strides]) <= _ON_THE_SPOT)
    if not ahead.any():
        raise MotionError(
            "no stride goes ahead: the walker turns on the spot, or goes backwards or sideways (facing "
            f"{np.degrees(facing).min():.0f}° away from where he goes)"
        )
    kept = tuple(stride for stride, is_ahead in zip(found.strides, ahead, strict=True) if is_ahead)
    return replace(found, strides=kept, headings=found.headings[ahead])


def captured_cycles(motions: Sequence[Motion], walks: Sequence[WalkStrides], subjects: Sequence[str]) -> Cycles:
    """Closed cycles of captured walks, `sequence` numbering the `motions`; of each the strides in `walks`.

    Of walks "by period", these are paper A's (`walking_cycles`). Of others, each stride is one whole cycle, its heading
    relative to its chord. At phase 0 the left leg is furthest ahead of the right. `subjects` label each walk's person.

    Raises:
        MotionError: no cycle at all.
    """
    parts = []
    whole = [i for i, walk in enumerate(walks) if walk.found == "period"]
    if whole:
        channels, fps = [gait_channels(motions[i]) for i in whole], [motions[i].fps for i in whole]
        found = walking_cycles(channels, fps, [subjects[i] for i in whole])
        parts.append(replace(found, sequence=np.array(whole)[found.sequence]))
    for i, (motion, walk) in enumerate(zip(motions, walks, strict=True)):
        if walk.found != "period":
            parts += _cycles_of_strides(motion, walk, i, subjects[i])
    if not parts:
        raise MotionError("no stride has enough samples for a cycle: the frame rate is too low")
    join = lambda name: np.concatenate([getattr(part, name) for part in parts])
    labels = tuple(label for part in parts for label in part.subject)
    return Cycles(join("values"), CHANNELS, join("seconds"), join("sequence"), labels, join("drift"))


def _by_period(motion: Motion) -> WalkStrides:
    straight = straightness(motion)
    if straight < STRAIGHT:
        raise MotionError(f"not straight: net displacement is {straight:.0%} of the path's length")
    speed = forward_speed(motion)
    if speed < _IN_PLACE:
        raise MotionError(f"in place: the walker gets {speed:.2f} m ahead in a second")
    found = find_cycles(motion)
    seconds = found.seconds
    last = (len(motion.poses) - 1) / motion.fps
    starts = found.starts[found.starts + seconds <= last] if last >= 2 * seconds else found.starts[:1]
    way = motion.poses[np.isfinite(motion.poses[:, :2]).all(1), :2]
    heading = np.arctan2(*(way[-1] - way[0])[::-1])
    strides = tuple(Stride("left", t, t + seconds, length=speed * seconds, turn=0.0) for t in starts.tolist())
    return WalkStrides(strides, "period", np.full(len(strides), heading))


def _by_events(motion: Motion, capture: Markers | Motion, marker_map, no_period: MotionError) -> WalkStrides:
    if motion.poses.ndim != 2 or len(motion.poses) < 2:
        raise no_period
    feet = feet_of(capture, marker_map)
    stretches = find_stretches(feet)
    recording = capture.recording if isinstance(capture, Markers) else None
    events = find_events(feet, recording)
    strides, found = find_strides(feet, events, stretches), "events"
    if not strides:
        strides, found = strides_by_phase(feet, events, stretches), "phase"
    if not strides:
        raise MotionError(
            "no stride: no foot meets or leaves the ground twice, nor do the feet pass each other twice in one way; "
            f"and as a whole, {no_period}"
        )
    strides = tuple(_recurring(stride, motion.poses[:, 6:], feet.fps) for stride in strides)
    return WalkStrides(strides, found, _chords(feet, strides))


def _recurring(stride: Stride, angles: np.ndarray, fps: float) -> Stride:
    """A stride that ends when the `angles` (frames, 19) of the legs are again as at its beginning.

    Contacts of the drawn feet err by some frames, and the two ends of a stride not by the same.
    """
    first, length = round(stride.start * fps), stride.seconds * fps
    around = np.arange(max(first - round(_AROUND * fps), 0), first + round(_AROUND * fps) + 1)
    lags = np.arange(int((1 - _REACH) * length), int((1 + _REACH) * length) + 2)
    legs = angles[:, _LEGS]
    change = np.full(len(lags), np.inf)
    for i, lag in enumerate(lags):
        pairs = around[around + lag < len(legs)]
        squares = (legs[pairs + lag] - legs[pairs]) ** 2
        if len(pairs) >= 0.5 * len(around) and np.isfinite(squares).any():
            change[i] = np.nanmean(squares)
    best = int(change.argmin())
    if not 0 < best < len(lags) - 1 or not np.isfinite(change[best - 1 : best + 2]).all():
        return stride
    before, at, after = change[best - 1 : best + 2]
    seconds = (lags[best] + 0.5 * (before - after) / max(before - 2 * at + after, 1e-12)) / fps
    ratio = min(seconds, (len(legs) - 1) / fps - stride.start) / stride.seconds
    return replace(
        stride, end=stride.start + ratio * stride.seconds, length=ratio * stride.length, turn=ratio * stride.turn
    )


def _chords(feet: Feet, strides: Sequence[Stride]) -> np.ndarray:
    """Direction (n,) [rad] in which the pelvis goes in each stride, over the belt if there is one."""
    carried = belt(feet)
    frames = np.arange(len(feet.pelvis))
    known = np.isfinite(feet.pelvis[:, :2]).all(1)
    ends = np.array([(s.start, s.end) for s in strides]) * feet.fps
    x, y = (np.diff(np.interp(ends, frames[known], feet.pelvis[known, i]))[:, 0] for i in (0, 1))
    if carried is not None:
        seconds = np.diff(ends)[:, 0] / feet.fps
        x, y = x - carried[0] * seconds, y - carried[1] * seconds
    return np.arctan2(y, x)


def _facing(motion: Motion, walk: WalkStrides) -> np.ndarray:
    """Mean angle (n,) [rad] of the body to the left of each stride's direction; 0 where unknown."""
    turned = [
        motion.poses[round(s.start * motion.fps) : round(s.end * motion.fps) + 1, 5] - heading
        for s, heading in zip(walk.strides, walk.headings, strict=True)
    ]
    return np.array([np.angle(np.nansum(np.exp(1j * t))) for t in turned])


def _cycles_of_strides(motion: Motion, walk: WalkStrides, sequence: int, subject: str) -> list[Cycles]:
    """Each stride of a walk as a closed cycle."""
    channels = gait_channels(motion)
    found = []
    for stride, heading in zip(walk.strides, walk.headings, strict=True):
        start, end = stride.start * motion.fps, stride.end * motion.fps
        first = int(np.ceil(start - 1e-6))
        own = channels[first : int(np.floor(end + 1e-6)) + 1].copy()
        turned = motion.poses[first : first + len(own), 5] - heading
        own[:, _HEADING] = turned - np.nan_to_num(np.nanmean(turned) - np.angle(np.nanmean(np.exp(1j * turned))))
        if len(own) < 2 or np.isnan(own).all():
            continue
        place = Alignment(np.array([end - start]), np.array([start - first]), np.zeros((10, 19)), np.zeros(1))
        try:
            cycle = closed(to_reference([own], place, motion.fps, channels=CHANNELS, subjects=[subject]))
        except MotionError:  # too few samples for a spline
            continue
        values = _shifted(cycle.values[:1], leading_phase(cycle.values[0]))
        found.append(
            replace(
                cycle, values=values, seconds=cycle.seconds[:1], sequence=np.array([sequence]), subject=(subject,),
                drift=None if cycle.drift is None else cycle.drift[:1],
            )
        )  # fmt: skip
    return found


def _shifted(values: np.ndarray, phase: float) -> np.ndarray:
    """Periodic cycles (n, samples, channels) that begin at `phase` [cycles]."""
    at = phase * values.shape[1]
    whole = int(np.floor(at))
    before, after = np.roll(values, -whole, axis=1), np.roll(values, -whole - 1, axis=1)
    return (whole + 1 - at) * before + (at - whole) * after
