"""Straight walks whose speed changes: the same person's walks at several speeds, blended in phase.

Phase advances with the stride frequency at the speed. Each foot stands where the body passes over it, so that steps
become longer and shorter with the speed, and feet don't slide. Below the slowest of the walks, their movements become
smaller towards those of who stands, and steps shorter and slower alike: people's walk ratio, step length over cadence,
stays (Sekiya et al. 1996, J Hum Mov Stud 30, 241-257).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.errors import ModelError, MotionError
from motionenv.models.paths._steps import Steps, runs, smooth, steps_of
from motionenv.models.types import Request
from motionenv.types import FPS_RANGE, SPEED_RANGE, Motion, Skeleton

_TICK = 0.01  # [s] of the clock on which speed and phase are integrated
_BEYOND = 3.0  # [s] before and after, in which the speed stays
_EASE = 0.3  # [s] standard deviation of the smoothing of the speed
_BRAKE = 1.0  # [m/s²] before the path's end
_RESTS = 0.02  # [m/s] below which somebody stands
_SLOWEST = 0.6  # [m/s] of the walks that are blended
_BETWEEN = 0.25  # [m/s] between their speeds
_RATE = 120.0  # [Hz] at which they are made
_SWAY = (0.05, 0.25)  # [m], and at most as a share of the way: by which a body moves before its first and after its last step
_SHOWN = 6.0  # [s] of a walk that shows its stride frequency
_AHEAD = 0.03  # stands the pelvis before the ankles, in body heights
#: Columns of a walk's signals after the 25 of the poses.
_ANKLES, _YAWS, _REACH, _STEP, _SIDE, _STANDS = (slice(25 + 2 * i, 27 + 2 * i) for i in range(6))


@dataclass(frozen=True, eq=False)
class Pace:
    """Speed over time.

    Attributes:
        times: (ticks,) [s], from before the start to after the end.
        speeds: (ticks,) [m/s].
        way: (ticks,) [m] gone since the start.
    """

    times: np.ndarray
    speeds: np.ndarray
    way: np.ndarray

    @property
    def typical(self) -> float:
        """Mean speed [m/s] while walking, within what models take."""
        moves = self.speeds[self.speeds > _RESTS]
        return float(np.clip(moves.mean(), *SPEED_RANGE[:2])) if len(moves) else 1.0


def pace_of(speed, seconds: float, length: float = np.inf) -> Pace:
    """The pace that `speed` asks for during `seconds` [s], with a stop after `length` [m].

    Args:
        speed: see `walk_along`; a number, a function, or rows.
        seconds: duration [s].
        length: of the path [m].

    Raises:
        MotionError: no speeds, or speeds out of range.
    """
    beyond = round(_BEYOND / _TICK)
    times = _TICK * np.arange(-beyond, int(np.ceil(seconds / _TICK)) + beyond + 1)
    asked = np.clip(times, 0.0, seconds)
    try:
        if callable(speed):
            speeds = np.array([float(speed(float(t))) for t in asked])
        else:
            rows = np.asarray(speed, dtype=np.float64)
            rows = np.array([[0.0, float(rows)]]) if rows.ndim == 0 else rows
            if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or not (np.diff(rows[:, 0]) > 0).all():
                raise ValueError
            speeds = np.interp(asked, *rows.T)
    except (TypeError, ValueError):
        raise MotionError(
            "speed must be a number, a function of the time, or rows (time, speed) with increasing times, "
            f"got {speed!r}"
        ) from None
    for value in (np.min(speeds), np.max(speeds)):
        checked_number(float(value), "speed", 0.0, SPEED_RANGE[1], SPEED_RANGE[2])
    speeds = smooth(speeds, _EASE / _TICK)
    way = np.empty(len(times))
    way[: beyond + 1] = np.cumsum(speeds[: beyond + 1]) * _TICK
    way[: beyond + 1] -= way[beyond]
    for i in range(beyond, len(times) - 1):
        speeds[i] = min(speeds[i], np.sqrt(2 * _BRAKE * max(length - way[i], 0.0)))
        way[i + 1] = way[i] + speeds[i] * _TICK
    speeds[-1] = speeds[-2]
    return Pace(times, np.where(speeds < _RESTS, 0.0, speeds), way)


@dataclass(frozen=True, eq=False)
class _Source:
    """A straight walk at an even speed, as signals over phase; a phase is whole where the body passes the left foot.

    Attributes:
        signals: (frames, 37), poses and the columns above; the root's x and y are about their mean way. A step is 3.4
            after 40 % of the way from the third place of the foot to the fourth.
        frequency: strides per second [Hz].
        first: phase of the first frame.
        passes: phases (n, 2) at which the body passes the places of the left and the right foot.
        lifts, lands: phases (m,) at which a foot leaves and meets the floor.
    """

    signals: np.ndarray
    frequency: float
    first: float
    passes: np.ndarray
    spans: list


def paced(make: Callable, pace: Pace, request: Request) -> tuple[Steps, Skeleton]:
    raise NotImplementedError
