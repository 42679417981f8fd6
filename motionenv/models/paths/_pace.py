"""Straight walks whose speed changes: the same person's walks at several speeds, blended in phase.

Phase advances with the stride frequency at the speed. Each foot stands where the body passes over it, so that steps
become longer and shorter with the speed, and feet don't slide. Below the slowest of the walks, their movements become
smaller towards those of who stands, and steps shorter and slower alike: people's walk ratio, step length over cadence,
stays (Sekiya et al. 1996, J Hum Mov Stud 30, 241-257).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from motionenv._core.runs import runs
from motionenv._core.validation import checked_number
from motionenv.arguments import Request
from motionenv.errors import ModelError, MotionError
from motionenv.models.paths._steps import Steps, even_way, smooth, steps_of
from motionenv.types import SPEED_RANGE, Motion, Skeleton

_TICK = 0.01  # [s] of the clock on which speed and phase are integrated
_BEYOND = 3.0  # [s] before and after, in which the speed stays
_EASE = 0.3  # [s] standard deviation of the smoothing of the speed
_BRAKE = 1.0  # [m/s²] before the path's end
_RESTS = 0.02  # [m/s] below which somebody stands
_SLOWEST = 0.6  # [m/s] of the walks that are blended
_BETWEEN = 0.25  # [m/s] between their speeds
RATE = 120.0  #: [Hz] at which walks to blend are made
_SOON = (0.4, 1.0)  # [s] after and before, within which who starts or stops has the cadence of the greater speed
_SWAY = (
    0.02,
    0.25,
)  # [m], and at most as a share of the way: by which a body moves before its first and after its last step
_OVER = 0.4  # strides, standard deviation of the smoothing of a walk's way
_SHOWN = 12.0  # [s] of a walk that shows its stride frequency
_AHEAD = 0.055  # by which balls of feet are before the pelvis of who stands, in body heights
_EDGE = 1e-6  # [cycles]
_FAR = 10.0  # [cycles] beyond the first and the last contact
_LEFT, _PASSES_AT, _LANDS_AT, _LEAVES_AT = 1, 2, 3, 4  # columns of a walk's stances
#: Columns of a walk's signals after the 25 of the poses.
_ANKLES, _YAWS, _REACH, _STEP, _SIDE, _STANDS = (slice(25 + 2 * i, 27 + 2 * i) for i in range(6))


@dataclass(frozen=True, eq=False)
class Pace:
    """Speed over time."""

    times: np.ndarray  # (ticks,) [s], from before the start to after the end
    speeds: np.ndarray  # (ticks,) [m/s]
    way: np.ndarray  # (ticks,) [m] gone since the start

    @property
    def typical(self) -> float:
        """Mean speed [m/s] while walking, within what models take."""
        moves = self.speeds[self.speeds > _RESTS]
        return float(np.clip(moves.mean(), *SPEED_RANGE[:2])) if len(moves) else 1.0


def pace_of(speed: Any, seconds: float, length: float = np.inf) -> Pace:
    """The pace that `speed`, as of `walk_along`, asks for during `seconds` [s], with a stop after `length` [m].

    Raises:
        MotionError: no speeds, or speeds out of range.
    """
    beyond = round(_BEYOND / _TICK)
    times = _TICK * np.arange(-beyond, int(np.ceil(seconds / _TICK)) + beyond + 1)
    asked = np.clip(times, 0.0, seconds)
    speeds = np.array([speed(float(t)) for t in asked], dtype=np.float64) if callable(speed) else _read(speed, asked)
    for value in (np.min(speeds), np.max(speeds)):
        checked_number(float(value), "speed", 0.0, SPEED_RANGE[1], SPEED_RANGE[2])
    speeds = _or_rest(np.minimum(smooth(speeds, _EASE / _TICK), speeds.max()))  # rounding may exceed it
    way = np.empty(len(times))
    way[: beyond + 1] = np.cumsum(speeds[: beyond + 1]) * _TICK
    way[: beyond + 1] -= way[beyond]
    for i in range(beyond, len(times) - 1):
        speeds[i] = _or_rest(min(speeds[i], np.sqrt(2 * _BRAKE * max(length - way[i], 0.0))))
        way[i + 1] = way[i] + speeds[i] * _TICK
    speeds[-1] = speeds[-2]
    return Pace(times, speeds, way)


def _or_rest(speeds):
    return np.where(speeds < _RESTS, 0.0, speeds)


def _read(speed, times: np.ndarray) -> np.ndarray:
    """Speeds at `times` (ticks,) [s] from a number or rows (time, speed)."""
    try:
        rows = np.asarray(speed, dtype=np.float64)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    rows = np.array([[0.0, float(rows)]]) if rows.ndim == 0 else rows
    if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or not (np.diff(rows[:, 0]) > 0).all():
        wanted = "a number, a function of the time, or rows (time, speed) with increasing times"
        raise MotionError(f"speed must be {wanted}, got {speed!r}", "speed")
    return np.interp(times, *rows.T)


@dataclass(frozen=True, eq=False)
class _Source:
    """A straight walk at an even speed, as signals over phase, which is whole where the body passes the left foot.

    Signals (frames, 37) are poses, the root's x and y about their even way, and the columns above; a foot's step is 3.4
    after 40 % of its way from its place 3 to its place 4. Stances, of the left and of the right foot, are rows (number,
    y [m], phase at which the body passes the foot, at which it lands, at which it leaves).
    """

    signals: np.ndarray
    frequency: float  # strides per second
    first: float  # phase of the first frame
    stances: list[np.ndarray]

    def at(self, phase) -> np.ndarray:
        """Signals (n, 37) at phases (n,)."""
        frame = np.clip((phase - self.first) * RATE / self.frequency, 0.0, len(self.signals) - 1.001)
        before = frame.astype(np.intp)
        share = (frame - before)[:, None]
        return (1.0 - share) * self.signals[before] + share * self.signals[before + 1]


@dataclass(frozen=True, eq=False)
class _Course:
    """Blend over phase of the sources, walks at `speeds` (sources,) [m/s]."""

    speeds: np.ndarray
    pace: Pace
    phases: np.ndarray  # (ticks,) at the pace's times

    def blend(self, own: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """The mean (n,) of the sources' `own` (sources, n), by their shares at `phase` (n,)."""
        when = np.interp(phase, self.phases, self.pace.times)
        shares = _shares(self.speeds, np.interp(when, self.pace.times, self.pace.speeds))
        return np.einsum("nk,kn->n", shares, own)

    def moments(self, own: np.ndarray, near: np.ndarray) -> np.ndarray:
        """The mean phases (n,) of events at the sources' `own` phases (sources, n), which are `near` (n,).

        Blended twice, because the shares depend a little on when an event is.
        """
        return self.blend(own, self.blend(own, near))


def paced(make: Callable, pace: Pace, learned: float, request: Request) -> tuple[Steps, Skeleton]:
    """The steps of a straight walk at a pace, for a `request`, and the body.

    Args:
        make: makes a straight walk of the person from a duration [s] and a speed [m/s], at 120 frames/s.
        pace: speed over time.
        learned: least speed that the model learned from [m/s].
        request: of which frame rate and duration count.

    Raises:
        ModelError: the model's walk has no steps.
    """
    moving = pace.speeds[pace.speeds > 0]
    slowest = max(_SLOWEST, learned)
    most = max(moving.max(initial=slowest), slowest)
    least = max(moving.min(initial=most), slowest)
    speeds = np.linspace(least, most, 1 + int(np.ceil((most - least) / _BETWEEN)))
    frequencies = [_source(make(_SHOWN, v)).frequency for v in speeds]
    window = round(sum(_SOON) / _TICK) + 1
    soon = maximum_filter1d(pace.speeds, window, origin=window // 2 - round(_SOON[0] / _TICK))
    rate = np.interp(soon, speeds, frequencies) * np.sqrt(np.minimum(soon / least, 1.0))
    cycles = 1.25 * rate.sum() * _TICK + len(runs(pace.speeds == 0)) + 2.0
    walks = [make(cycles / f, v) for f, v in zip(frequencies, speeds, strict=True)]
    sources = [_source(walk) for walk in walks]
    start = max(source.first for source in sources)
    clock = np.arange(request.frames) / request.fps
    phases, rests = _phases(pace, rate, sources[0], start)
    phase, speed, way = (np.interp(clock, pace.times, values) for values in (phases, pace.speeds, pace.way))
    skeleton = walks[0].skeleton
    shares = _shares(speeds, speed)
    course = _Course(speeds, pace, phases)
    rows = _blended(sources, phase, shares, course)
    calm = np.minimum(speed / least, 1.0)
    still, moved = _still(sources[0]), slice(_STEP.start)
    rows[:, moved] = still + (calm * (2.0 - calm))[:, None] * (rows[:, moved] - still)
    rows[:, 0] += way
    balls = _balls(rows, sources, course, rests, skeleton.height)
    ankles, yaws, reach, stands = (rows[:, part] for part in (_ANKLES, _YAWS, _REACH, _STANDS))
    return Steps(rows[:, :25], balls, ankles, yaws, reach, stands > 0.5, request.fps), skeleton


def _source(walk: Motion) -> _Source:
    """The signals of a straight walk."""
    steps = steps_of(walk)
    frames = np.arange(len(walk.poses))
    root = steps.poses[:, :2]
    where = [np.reshape(runs(stands), (-1, 2)) for stands in steps.stands.T]
    if min(map(len, where)) < 4 or root[-1, 0] <= root[0, 0]:
        raise ModelError("this model's walk has no steps: it can go along a path only at one speed, and not stop")
    even = even_way(root, _OVER * np.median(np.diff(where[0][1:-1, 0])))
    places = [np.array([steps.balls[a:b, side].mean(axis=0) for a, b in spans]) for side, spans in enumerate(where)]
    passes = [np.interp(place[:, 0], even[:, 0], frames) for place in places]
    inner = passes[0][1:-1]
    length = (inner[-1] - inner[0]) / round((inner[-1] - inner[0]) / np.median(np.diff(inner)))
    origin = np.median(inner - length * np.round((inner - inner[0]) / length))
    origin += length * np.floor(-origin / length + 0.5)  # the first frame's phase is within half a cycle of 0
    signals = np.concatenate([steps.poses, steps.ankles, steps.yaws, steps.reach, np.zeros((len(frames), 4)),
                              steps.stands], axis=1)  # fmt: skip
    signals[:, :2] -= even
    stances = []
    for side, (spans, place, passed) in enumerate(zip(where, places, passes, strict=True)):
        number = np.round((passed - origin) / length - 0.5 * side)
        reach = (place[-1, 0] - place[0, 0]) / (number[-1] - number[0])
        x = np.concatenate([[place[0, 0] - reach], place[:, 0], [place[-1, 0] + reach]])
        step = np.interp(steps.balls[:, side, 0], x, np.concatenate([[number[0] - 1], number, [number[-1] + 1]]))
        left = place[:, 1] - np.interp(passed, frames, even[:, 1])
        signals[:, _STEP.start + side] = step
        signals[:, _SIDE.start + side] = steps.balls[:, side, 1] - np.interp(step, number, place[:, 1])
        rows = np.column_stack([number, left, *((np.array(t) - origin) / length for t in (passed, *spans.T))])
        stances.append(np.vstack([rows[0] - [1, 0, 1, 1, 1], rows]))  # that from which the first frame's step comes
    return _Source(signals, walk.fps / length, -origin / length, stances)


def _still(source: _Source) -> np.ndarray:
    """Poses, ankles, feet's directions and legs' reach (31,) of who stands: the walk's means, on straight legs."""
    still = source.signals.mean(axis=0)
    stands = source.signals[:, _STANDS] > 0.5
    for side in range(2):
        own = source.signals[stands[:, side]]
        still[_ANKLES.start + side] = np.quantile(own[:, _ANKLES.start + side], 0.2)
        still[_REACH.start + side] = np.quantile(own[:, _REACH.start + side], 0.95)
    return still[: _STEP.start]


def _shares(speeds: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Weights (n, sources) of the walks at increasing `speeds` for each of `speed` (n,) [m/s]."""
    if len(speeds) == 1:
        return np.ones((len(speed), 1))
    return np.stack([np.interp(speed, speeds, row) for row in np.eye(len(speeds))], axis=-1)


def _phases(pace: Pace, rate: np.ndarray, source: _Source, start: float) -> tuple[np.ndarray, list]:
    """Phase (ticks,), and of each rest the first and the last phase, and where it is [m].

    Every walk from a rest begins as a foot leaves the floor, and to a rest ends as one meets it; in between, phase is
    stretched by the few percent that this takes.
    """
    swings = np.sort(np.concatenate([np.column_stack([s[:-1, 4], s[1:, 3]]) for s in source.stances]), axis=0)
    phases, rests, before, now = np.empty(len(rate)), [], 0, start
    for first, stop in runs(pace.speeds > 0):
        began = int(np.searchsorted(pace.times, 0.0)) if first == 0 else first
        steps = rate[began:stop] * _TICK
        gone, ease = pace.way[began:stop] - pace.way[began], min(_SWAY[0], _SWAY[1] * np.ptp(pace.way[began:stop]))
        ahead = swings[swings[:, 0] >= now]
        if first > 0:
            rests.append((now if before else ahead[0, 0], ahead[0, 0], pace.way[first]))
            phases[before:first] = np.linspace(*rests[-1][:2], first - before)
            now, ahead = ahead[0, 0], ahead[1:]
            steps[gone < ease] = 0.0
        stops = stop < len(rate)
        if stops:
            steps[gone[-1] - gone < ease] = 0.0
        total = steps.sum()
        share = (ahead[np.abs(np.log((ahead[:, 1] - now) / total)).argmin(), 1] - now) / total if stops else 1.0
        phases[began:stop] = now + share * np.cumsum(steps)
        phases[first:began] = now - np.cumsum(rate[first:began][::-1])[::-1] * _TICK
        before, now = stop, float(phases[stop - 1])
    if before < len(rate):
        now = now if before else float(swings[swings[:, 0] >= now][0, 0])
        phases[before:] = now
        rests.append((now, now, pace.way[-1]))
    return phases, rests


def _blended(sources: list[_Source], phase: np.ndarray, shares: np.ndarray, course: _Course) -> np.ndarray:
    """Signals (frames, 37) at phases (frames,), of the sources by their `shares` (frames, sources).

    Each foot's signals are taken at phases shifted so that it lands and leaves at the same time in all sources:
    otherwise the mean of walks in which it stands and walks in which it doesn't yet would slide.
    """
    rows = sum(w[:, None] * source.at(phase) for w, source in zip(shares.T, sources, strict=True))
    for side in range(2):
        columns = [part.start + side for part in (_ANKLES, _YAWS, _REACH, _STEP, _SIDE, _STANDS)]
        own = np.stack([_own(sources, side, column) for column in (_LANDS_AT, _LEAVES_AT)], axis=-1)
        events = np.stack([course.moments(own[..., i], own[0, :, i]) for i in range(2)], axis=-1).ravel()
        knots = np.concatenate([[events[0] - _FAR], events, [events[-1] + _FAR]])
        foot = 0.0
        for share, source, at in zip(shares.T, sources, own, strict=True):
            shifted = np.interp(phase, knots, np.concatenate([[at[0, 0] - _FAR], at.ravel(), [at[-1, 1] + _FAR]]))
            foot = foot + share[:, None] * source.at(shifted)[:, columns]
        rows[:, columns] = foot
    return rows


def _own(sources: list[_Source], side: int, column: int) -> np.ndarray:
    """A column of the stances of a foot, (sources, n), for the numbers of the first source's."""
    number = sources[0].stances[side][:, 0]
    return np.array([np.interp(number, s.stances[side][:, 0], s.stances[side][:, column]) for s in sources])


def _balls(rows, sources: list[_Source], course: _Course, rests: list, height: float) -> np.ndarray:
    """Balls of the feet (frames, 2, 2) [m]: where the body passes over them, and at a rest a little before it."""
    balls = np.empty((len(rows), 2, 2))
    for side in range(2):
        number, _, _, lands, lifts = sources[0].stances[side].T
        passes = _own(sources, side, _PASSES_AT)
        passed = course.moments(passes, number + 0.5 * side)
        left = course.blend(_own(sources, side, _LEFT), passed)
        x = np.interp(passed, course.phases, course.pace.way)
        for begins, ends, at in rests:
            x[(lands <= ends + _EDGE) & (lifts >= begins - _EDGE)] = at + _AHEAD * height
        step = rows[:, _STEP.start + side]
        balls[:, side, 0] = np.interp(step, number, np.maximum.accumulate(x))
        balls[:, side, 1] = np.interp(step, number, left) + rows[:, _SIDE.start + side]
    return balls
