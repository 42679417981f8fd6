"""Initial contacts and toe-offs of a capture: from its file, its force plates, or the paths of heels and toes.

In the paths, candidates are those of Zeni, Richards & Higginson (2008, Gait Posture 27): at initial contact the heel is
furthest ahead of the pelvis, at toe-off the toe furthest behind. But the heel is furthest ahead some 50 ms before it
meets the ground, the more so the faster somebody walks. So initial contact is moved to where the heel's fall is stopped
hardest, the peak of its vertical acceleration, within a few frames of where the heel stops moving ahead. The toe of a
runner is furthest behind some 50 ms after it leaves the ground; there, toe-off is where it begins to move fast.

`benchmarks/mocap/events.py` measures the error. The constants of contacts (`_STOPS`, `_NEAR`, `_FAST`) were chosen by
leaving out one laboratory at a time; `_LEAVES` was chosen on all of them, and concerns runners.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import find_peaks

from motionenv._core.representation import OneLine
from motionenv._core.runs import runs
from motionenv._core.validation import checked_choice
from motionenv.errors import MotionError
from motionenv.gait.feet import Feet, bridged, smoothed
from motionenv.gait.stretches import belt, on_treadmill
from motionenv.types import Event, ForcePlate, Recording

#: Where events may come from.
METHODS = ("auto", "file", "plates", "kinematics")
_FEW = 2  # events that say nothing about sides
_SHIFT = 0.06  # [s] by which both contacts and toe-offs are late, or early: then the file's clock is another
_SAME = 0.3  # [s] within which two events of a kind and side are the same one: no foot steps again so soon

# Force plates
_LOADED = 20.0  # [N] on the plate
_STEPS_ON = 200.0  # [N] peak of a step; less is a touch, or an empty plate's drift
_STANCE = (0.11, 2.0)  # [s] duration of a stance: shortest in sprinting; a longer one is standing
_BESIDE = 0.03  # [m] by which a foot may stand over a plate's edge
_TIP = 0.3  # of the distance from heel to toe, from there to the tip of the shoe
_REACH = 0.30  # [m] farthest that the centre of pressure can be from the middle of the foot
_AT_REST = 0.5  # [m/s] of a foot that stands

# Paths of heels and toes
_HEADING, _SLOW, _FAST = 0.5, 7.0, 14.0  # [Hz] cut-off frequencies for the direction, candidates, and the impact
_STANDS = 0.1  # [m/s] of a pelvis that goes nowhere
_STEP = 0.35  # [s] least time between two candidates of one kind and side
_SWING = 0.1  # [m] least prominence of a candidate: a foot that travels less doesn't step
_STOPS = 0.5  # [m/s] over the floor, below which a heel has stopped moving ahead; at most half its speed before
_LEAVES = 1.6  # [m/s] over the floor of a toe that has left it; in running it is not yet furthest behind then
_LANDING = (0.02, 0.25)  # [s] before and after a candidate in which the heel stops
_NEAR = 0.035  # [s] around that, in which its fall is stopped hardest
_BELT = 5  # percentile of the velocity ahead of a foot on a treadmill: that of the belt on which it stands
_BACKWARDS = -0.5  # cosine between foot and travel of who walks backwards
_GAP = 0.05  # [s] of unknown frames that are bridged; in longer gaps, and `_AROUND` them, there are no events
_AROUND = 0.1  # [s]


@dataclass(frozen=True, repr=False)
class Events(OneLine):
    """The gait events of a capture, in the order of time.

    `sources` counts those that came from the "file", from "plates" and from "kinematics"; `notes` are what a reader of
    the `events` should know.
    """

    events: tuple[Event, ...]
    sources: dict[str, int]
    notes: tuple[str, ...] = ()

    def times(self, kind: str, side: str) -> list[float]:
        """Times [s] of the events of a `kind`, "initial_contact" or "toe_off", and a `side`, "left" or "right"."""
        return [event.time for event in self.events if (event.kind, event.side) == (kind, side)]


def find_events(feet: Feet, recording: Recording | None = None, method: str = "auto") -> Events:
    """The initial contacts and toe-offs of a capture, from its `feet` and what the file holds beside its points.

    "auto" believes the file's events first, then its force plates, and takes from the paths of the feet those that
    neither of them has. The file's are left out if they fit the feet better with sides exchanged, or by another clock.

    Raises:
        MotionError: `method` isn't one of `METHODS`, or `recording` has nothing for it.
    """
    checked_choice(method, "method", METHODS)
    recording = recording or Recording()
    found = {
        "file": recording.events, "plates": plate_events(recording.plates, feet), "kinematics": kinematic_events(feet),
    }  # fmt: skip
    notes: tuple[str, ...] = ()
    if method != "auto":
        found = {method: found[method]}
    elif wrong := _wrong(found["file"], found["kinematics"]):
        found["file"] = ()
        notes = (f"the file's events {wrong}, so they are left out",)
    kept: list[Event] = []
    sources = {}
    for name, events in found.items():
        new = [event for event in events if not any(_same(event, other) for other in kept)]
        kept += new
        sources[name] = len(new)
    if not kept and method in ("file", "plates"):
        raise MotionError(f"the capture has no events from {method}: use method='auto' or 'kinematics'")
    return Events(tuple(sorted(kept, key=lambda event: event.time)), {k: n for k, n in sources.items() if n}, notes)


def _wrong(marked: Sequence[Event], seen: Sequence[Event]) -> str:
    """What is wrong with `marked` events, by those seen in the paths of the feet: sides, or all times alike; or ""."""
    other = {"left": "right", "right": "left"}
    fits = sum(any(_same(a, b) for b in seen) for a in marked)
    fits_exchanged = sum(any(_same(replace(a, side=other[a.side]), b) for b in seen) for a in marked)
    if fits_exchanged > max(2 * fits, _FEW):
        return "name the wrong sides, or other times"
    off = []
    for kind in ("initial_contact", "toe_off"):
        late = [a.time - b.time for a in marked for b in seen if a.kind == kind and _same(a, b)]
        off.append(float(np.median(late)) if len(late) >= _FEW else 0.0)
    return f"are {np.mean(off):+.2f} s from what the feet do" if min(off) > _SHIFT or max(off) < -_SHIFT else ""


def _same(a: Event, b: Event) -> bool:
    return (a.kind, a.side) == (b.kind, b.side) and abs(a.time - b.time) < _SAME


def plate_events(plates: Sequence[ForcePlate], feet: Feet) -> tuple[Event, ...]:
    """Initial contacts of the feet whose heel, and toe-offs of those whose toe is on a plate, in the order of time.

    The `feet` tell whose step it is. One that lands beside the `plates` and rolls onto one tells its toe-off only, and
    one that rolls over a plate's edge its initial contact only.
    """
    found: list[Event] = []
    for plate in plates:
        for start, end in _loadings(plate):
            side = _whose(plate, feet, start, end)
            if side is None:
                continue
            flat = round(0.5 * (start + end) * feet.fps)  # the frame in the middle of stance
            tip = feet.toe[side] + _TIP * (feet.toe[side] - feet.heel[side])[flat]
            for event, path in (
                (Event(start, "initial_contact", side), feet.heel[side]),
                (Event(end, "toe_off", side), tip),
            ):
                frame = round(event.time * feet.fps)
                if 0 < frame < len(path) - 1 and _on_plate(path[frame], plate.corners):
                    found.append(event)
    return tuple(sorted(found, key=lambda event: event.time))


def _loadings(plate: ForcePlate) -> list[tuple[float, float]]:
    """Start and end [s] of each stance on a plate."""
    up = plate.force[:, 2]
    return [
        (start / plate.fps, end / plate.fps)
        for start, end in runs(up > _LOADED)
        if _STANCE[0] <= (end - start) / plate.fps <= _STANCE[1] and up[start:end].max() >= _STEPS_ON
    ]


def _whose(plate: ForcePlate, feet: Feet, start: float, end: float) -> str | None:
    """The side of the foot that stands on the centre of pressure in the middle of a loading; None if it is unclear."""
    middle = 0.5 * (start + end)
    sample, frame = round(middle * plate.fps), round(middle * feet.fps)
    if not 0 < frame < len(feet.pelvis) - 1 or not np.isfinite(plate.centre[sample]).all():
        return None
    standing = {}
    for side in feet.sides:
        ends = np.stack([feet.heel[side], feet.toe[side]])
        # Runners' heels have risen by the middle of stance: the slower end stands.
        speed = np.linalg.norm(ends[:, frame + 1] - ends[:, frame - 1], axis=-1).min() * feet.fps / 2
        if np.linalg.norm((ends[:, frame].mean(0) - plate.centre[sample])[:2]) < _REACH and speed < _AT_REST:
            standing[side] = speed
    return next(iter(standing)) if len(standing) == 1 else None


def _on_plate(point: np.ndarray, corners: np.ndarray) -> bool:
    centre = corners.mean(0)[:2]
    across = [0.5 * (corners[i] + corners[i + 1] - corners[i - 1] - corners[i - 2])[:2] / 2 for i in (1, 2)]
    for half in across:
        length = np.linalg.norm(half)
        if not abs((point[:2] - centre) @ half) <= length * (length + _BESIDE):
            return False
    return True


def kinematic_events(feet: Feet, after: float | None = None) -> tuple[Event, ...]:
    """Initial contacts and toe-offs of `feet`, in the order of time.

    Who walks backwards lands on the toes and leaves with the heel, so these change places. Where paths are too rough to
    show how a heel is stopped, contacts are `after` it is furthest ahead [s], and as close to either end there is none.
    """
    front, back = (feet.toe, feet.heel) if backward_share(feet) > 0.5 else (feet.heel, feet.toe)
    ways, fps = directions(feet), feet.fps
    found = []
    for side in feet.sides:
        ahead = candidates(feet, front[side], ways)
        if after is None:
            contacts = _impacts(front[side], ahead, ways, fps, on_treadmill(feet))
        else:
            contacts = [k / fps + after for k in ahead if after * fps < k < len(ways) - 1 - after * fps]
        found += [Event(t, "initial_contact", side) for t in contacts if _seen(front[side], t, fps)]
        found += [Event(t, "toe_off", side) for t in _departures(feet, back[side], ways) if _seen(back[side], t, fps)]
    return tuple(sorted(found, key=lambda event: event.time))


def candidates(feet: Feet, heel: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Frames of initial contacts according to Zeni et al. (2008): a heel is furthest ahead of the pelvis of `feet`.

    `heel` is (frames, 3) [m], and `ways` the direction of progression (frames, 2) of `directions`.
    """
    return _peaks(_ahead(feet, heel, ways), feet.fps)


def directions(feet: Feet) -> np.ndarray:
    """Direction of progression at each frame (frames, 2): that of the path of the `feet`'s pelvis over about a stride.

    On a treadmill it is opposite to the belt's; zero if somebody stands throughout.
    """
    carried = belt(feet)
    if carried is not None:
        way = np.broadcast_to(-carried, (len(feet.pelvis), 2))
    elif len(feet.pelvis) > 1:
        way = np.gradient(smoothed(feet.pelvis[:, :2], feet.fps, _HEADING), axis=0)
        way[np.linalg.norm(way, axis=-1) * feet.fps < _STANDS] = np.nan  # who stands has the direction that he had
        way = np.nan_to_num(bridged(way))
    else:
        way = np.zeros_like(feet.pelvis[:, :2])
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return way / np.where(length > 0, length, 1.0)


def backward_share(feet: Feet) -> float:
    """Share of the frames in which the `feet`, while they are low, point against the direction of progression."""
    ways, against = directions(feet), [np.zeros(0)]
    for side in feet.sides:
        foot, height = (feet.toe[side] - feet.heel[side])[:, :2], bridged(feet.toe[side] + feet.heel[side])[:, 2]
        along = (foot * ways).sum(-1) < _BACKWARDS * np.linalg.norm(foot, axis=-1)
        against.append(along[height <= np.median(height)])
    pointing = np.concatenate(against)
    return float(pointing.sum() / max(len(pointing), 1))


def _ahead(feet: Feet, foot: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Distance (frames,) [m] of a point of the foot ahead of the pelvis."""
    apart = smoothed(foot, feet.fps, _SLOW) - smoothed(feet.pelvis, feet.fps, _SLOW)
    return (apart[:, :2] * ways).sum(-1)


def _peaks(signal: np.ndarray, fps: float) -> np.ndarray:
    """Frames at which the signal peaks, the first and the last included if it falls from there."""
    low = np.min(signal)
    padded = np.concatenate([[low], signal, [low]])
    peaks = find_peaks(padded, distance=max(round(_STEP * fps), 1), prominence=_SWING)[0]
    return peaks - 1


def _impacts(heel: np.ndarray, found: np.ndarray, ways: np.ndarray, fps: float, treadmill: bool) -> list[float]:
    """Times [s] of the impact after each candidate; none if the heel is still on its way when the capture ends."""
    if len(heel) < 3:
        return []
    speed = _speed(heel, ways, fps, _FAST, treadmill)
    acceleration = np.gradient(np.gradient(smoothed(heel, fps, _FAST)[:, 2]))
    times = []
    for k in found:
        first, last = max(k - round(_LANDING[0] * fps), 0), k + round(_LANDING[1] * fps)
        slow = first + np.flatnonzero(speed[first : last + 1] < min(_STOPS, 0.5 * speed[k]))
        # A capture that begins with the heel at rest doesn't show its contact, nor one that ends before the heel stops.
        resting = k == 0 and speed[0] < _STOPS
        if resting or not slow.size or not 0 < slow[0] < len(heel) - 1:
            continue
        begin, end = max(slow[0] - round(_NEAR * fps), 1), min(slow[0] + round(_NEAR * fps), len(heel) - 2)
        hardest = begin + int(np.argmax(acceleration[begin : end + 1]))
        times.append(_summit(acceleration, hardest) / fps)
    return times


def _departures(feet: Feet, toe: np.ndarray, ways: np.ndarray) -> list[float]:
    """Times [s] of toe-off: of each candidate, or sooner where the toe is then faster than anybody's who walks."""
    if len(toe) < 3:
        return []
    behind = _ahead(feet, toe, -ways)
    speed = _speed(toe, ways, feet.fps, _SLOW, on_treadmill(feet))
    times = []
    for k in _peaks(behind, feet.fps):
        slow = np.flatnonzero(speed[:k] < _LEAVES)
        if not 0 < k < len(toe) - 1 or not slow.size:
            continue  # it left the ground before the capture begins, or is still on it at the end
        if speed[k] <= _LEAVES:
            times.append(_summit(behind, k) / feet.fps)
        else:
            before, after = speed[slow[-1] : slow[-1] + 2]
            times.append(float(slow[-1] + (_LEAVES - before) / (after - before)) / feet.fps)
    return times


def _speed(foot: np.ndarray, ways: np.ndarray, fps: float, cutoff: float, treadmill: bool) -> np.ndarray:
    """Velocity ahead (frames,) [m/s] of a point of the foot over the floor, or over the belt of a treadmill."""
    velocity = np.gradient(smoothed(foot, fps, cutoff)[:, :2], axis=0) * fps
    speed = (velocity * ways).sum(-1)
    return speed - np.percentile(speed, _BELT) if treadmill else speed


def _summit(signal: np.ndarray, frame: int) -> float:
    """Vertex [frames] of the parabola through a peak and its neighbours."""
    if not 0 < frame < len(signal) - 1:
        return float(frame)
    before, at, after = signal[frame - 1 : frame + 2]
    bend = before - 2 * at + after
    return float(frame + np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else float(frame)


def _seen(path: np.ndarray, time: float, fps: float) -> bool:
    """Whether an event is neither in a gap of the point's path nor at its edge."""
    around = max(round(_AROUND * fps), 1)
    gaps = [(a, b) for a, b in runs(~np.isfinite(path).all(-1)) if (b - a) / fps > _GAP]
    return not any(first - around <= time * fps < last + around for first, last in gaps)
