"""Plane curves to walk along, by their heading over arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.types import frozen

_SPACING = 0.01  # [m] between headings: an arc of 1 m radius is off by 12 µm at most between two
#: Least radius [m]: on a smaller one the inner foot would turn on the spot, and hips exceed their rotation.
LEAST_RADIUS = 0.6
_LONGEST = 11_000.0  # [m], an hour at the greatest speed
_FULL = 0.98  # share of LEAST_RADIUS's curvature that random paths use


@dataclass(frozen=True, eq=False, repr=False)
class WalkPath(OneLine):
    """A smooth curve on the ground, parameterised by arc length; straight before its start and beyond its end.

    Make one with `WalkPath.line`, `WalkPath.arc`, `WalkPath.through` or `random_path`.

    Attributes:
        headings: (n,) direction of the tangent [rad], 0 along x, 90° along y, continuous; at equal steps from the start
            to the end, between which the curve is an arc.
        length: arc length [m].
        start: (2,) where it begins [m].

    Raises:
        MotionError: fewer than two or non-finite headings, a length that isn't above 0 m, or a radius under 0.6 m.
    """

    headings: np.ndarray
    length: float
    start: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "headings", frozen(self.headings, (None,), "WalkPath.headings"))
        object.__setattr__(self, "start", frozen(self.start, (2,), "WalkPath.start"))
        object.__setattr__(self, "length", checked_number(self.length, "WalkPath.length", above=0, high=_LONGEST))
        if len(self.headings) < 2 or not (np.isfinite(self.headings).all() and np.isfinite(self.start).all()):
            raise MotionError("WalkPath needs two headings at least, and finite numbers")
        sharpest = np.abs(np.diff(self.headings)).max() / self._step
        if sharpest * LEAST_RADIUS > 1 + 1e-6:
            raise MotionError(
                f"the path turns with a radius of {1 / sharpest:.2g} m, but people need {LEAST_RADIUS} m to walk: "
                "make it rounder, or put its points further apart",
                "path",
            )

    @classmethod
    def line(cls, length: float, *, heading: float = 0.0, start: ArrayLike = (0.0, 0.0)) -> WalkPath:
        """A straight line of `length` [m] from `start` (2,) [m] in the direction `heading` [rad], 0 along x.

        Raises:
            MotionError: `length` isn't above 0 m, or a number isn't finite.
        """
        return cls(np.full(2, checked_number(heading, "heading", unit="radians")), length, np.asarray(start))

    @classmethod
    def arc(cls, radius: float, angle: float, *, heading: float = 0.0, start: ArrayLike = (0.0, 0.0)) -> WalkPath:
        """An arc of a circle from `start` (2,) [m], where its direction is `heading` [rad], 0 along x.

        `radius` [m] is at least 0.6; it turns by `angle` [rad], left if above 0, otherwise right.

        Raises:
            MotionError: `radius` is under 0.6 m, `angle` is 0, or a number isn't finite.
        """
        checked_number(radius, "radius", LEAST_RADIUS, _LONGEST, "metres")
        checked_number(angle, "angle", unit="radians")
        if angle == 0.0:
            raise MotionError("angle must not be 0: use WalkPath.line for a path that doesn't turn")
        length = radius * abs(angle)
        turn = np.linspace(0.0, angle, _count(length))
        return cls(checked_number(heading, "heading", unit="radians") + turn, length, np.asarray(start))

    @classmethod
    def through(cls, points: ArrayLike) -> WalkPath:
        """The cubic spline through `points` (n, 2) [m], at least two, parameterised by the distances between them.

        Raises:
            MotionError: fewer than two points, NaN, two equal ones in a row, or a turn with a radius under 0.6 m.
        """
        from scipy.interpolate import CubicSpline

        points = frozen(points, (None, 2), "points")
        steps = np.linalg.norm(np.diff(points, axis=0), axis=-1)
        if len(points) < 2 or not np.isfinite(points).all() or (steps == 0).any():
            raise MotionError(
                "points must be at least two finite (x, y) [m], of which no two in a row are equal", "path"
            )
        chords = np.concatenate([[0.0], np.cumsum(steps)])
        if chords[-1] > _LONGEST:
            raise MotionError(f"the way through the points must be {_LONGEST:g} m at most, got {chords[-1]:g}", "path")
        fine = np.linspace(0.0, chords[-1], 4 * _count(chords[-1]))
        velocity = CubicSpline(chords, points, bc_type="natural")(fine, 1)
        pace = np.linalg.norm(velocity, axis=-1)
        along = np.concatenate([[0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * np.diff(fine))])
        turned = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
        headings = np.interp(np.linspace(0.0, along[-1], _count(along[-1])), along, turned)
        return cls(headings, float(along[-1]), points[0])

    def position(self, s: ArrayLike) -> np.ndarray:
        """Points (..., 2) [m] of the curve at arc lengths `s` (...) [m]."""
        s = np.asarray(s, dtype=np.float64)
        inside = np.clip(s, 0.0, self.length)
        cell = np.minimum((inside / self._step).astype(np.intp), len(self.headings) - 2)
        rest = inside - cell * self._step
        before, turn = self.headings[cell], self._turns[cell] * (rest / self._step)
        over = rest * np.sinc(turn / (2 * np.pi))
        out = self._corners[cell] + over[..., None] * _direction(before + 0.5 * turn)
        return out + (s - inside)[..., None] * _direction(self.heading(s))

    def heading(self, s: ArrayLike) -> np.ndarray:
        """Direction (...) [rad] of the tangent at arc lengths `s` (...) [m], continuous along the path."""
        return np.interp(np.asarray(s, dtype=np.float64), self._arcs, self.headings)

    def curvature(self, s: ArrayLike) -> np.ndarray:
        """Curvature (...) [1/m] at arc lengths `s` (...) [m]: above 0 to the left, 0 beyond the ends."""
        s = np.asarray(s, dtype=np.float64)
        cell = np.clip((s / self._step).astype(np.intp), 0, len(self._turns) - 1)
        return np.where((s >= 0) & (s <= self.length), self._turns[cell] / self._step, 0.0)

    @property
    def _step(self) -> float:
        return self.length / (len(self.headings) - 1)

    @cached_property
    def _arcs(self) -> np.ndarray:
        return np.linspace(0.0, self.length, len(self.headings))

    @cached_property
    def _turns(self) -> np.ndarray:
        return np.diff(self.headings)

    @cached_property
    def _corners(self) -> np.ndarray:
        """Points (n, 2) at the headings: the chord of an arc is as long as the arc times sinc of half its turn."""
        middle = self.headings[:-1] + 0.5 * self._turns
        chords = self._step * np.sinc(self._turns / (2 * np.pi))[:, None] * _direction(middle)
        return self.start + np.concatenate([np.zeros((1, 2)), np.cumsum(chords, axis=0)])


def random_path(
    rng: np.random.Generator, length: float, *, radius: float = 2.0, scale: float = 3.0, heading: float = 0.0,
    start: ArrayLike = (0.0, 0.0),
) -> WalkPath:  # fmt: skip
    """A path that winds left and right: curvature is a smooth Gaussian process of `rng`, kept within ±1/radius.

    Args:
        length, heading, start: as in `WalkPath.line`; the heading is that at the start.
        radius: least radius of a turn [m], from 0.6; half as sharp turns are usual.
        scale: over which length curvature changes [m], from 0.5.

    Raises:
        MotionError: a number out of range.
    """
    checked_number(length, "length", above=0, high=_LONGEST, unit="metres")
    checked_number(radius, "radius", LEAST_RADIUS, unit="metres")
    checked_number(scale, "scale", 0.5, unit="metres")
    knots = rng.standard_normal(int(np.ceil(length / scale)) + 4)
    s = np.linspace(0.0, length, _count(length))
    # A cubic B-spline of white noise; tanh keeps it within its bounds, smoothly.
    knot, share = np.divmod(s / scale, 1.0)
    basis = np.stack([(1 - share) ** 3, 4 - 6 * share**2 + 3 * share**3, 1 + 3 * share * (1 + share - share**2),
                      share**3]) / 6  # fmt: skip
    noise = sum(b * knots[knot.astype(np.intp) + i] for i, b in enumerate(basis))
    curvature = _FULL / radius * np.tanh(noise)
    turn = np.concatenate([[0.0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * np.diff(s))])
    return WalkPath(checked_number(heading, "heading", unit="radians") + turn, length, np.asarray(start))


def _count(length: float) -> int:
    return max(int(np.ceil(length / _SPACING)), 1) + 1


def _direction(heading) -> np.ndarray:
    return np.stack([np.cos(heading), np.sin(heading)], axis=-1)
