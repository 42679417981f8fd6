"""The whole way from the points of one camera to a walk in three dimensions: what `motionenv lift` does."""

import math
from dataclasses import dataclass
from functools import cached_property, partial
from numbers import Real

import numpy as np

from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.estimation.lifting.checks import check_points, check_series, unswapped
from motionenv.estimation.lifting.refined import BAND, Refined
from motionenv.estimation.lifting.refining import Start, refine
from motionenv.estimation.lifting.series import Series, fourier_points
from motionenv.estimation.lifting.unknown import ELEVATIONS, Views, find_view
from motionenv.models.harmonics import Walker
from motionenv.models.overground import gait
from motionenv.models.store import load
from motionenv.models.walkerprior import WalkerPrior
from motionenv.types import MARKERS, Camera, Markers, Motion, Points

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_PLAUSIBLE = 0.01  # probability from which on another view is told
#: Log-odds against a given view from which on points contradict it. On six of CMU's walks the true view has less than
#: 1, one 10 degrees off 9 to 160, 30 degrees off more than 100, and exchanged sides at 10 degrees and more at least 68.
_CONTRADICTED = 50.0
#: Misfit from which on a walk is unlike any that the prior knows: people left out have 9 to 103, with noise, gaps,
#: outliers and five markers missing; walks played backwards 309 and more.
UNLIKE = 150.0


@dataclass(frozen=True, eq=False)
class OtherView:
    """A view that the points leave possible.

    Attributes:
        alpha, elevation: [rad].
        probability: from 0 to 1, beside the best view and all others.
    """

    alpha: float
    elevation: float
    probability: float


@dataclass(frozen=True, eq=False)
class Lifted:
    """A walk in three dimensions, with what is known about it and how well.

    Attributes:
        refined: the posterior: walker, view, way, and their covariance.
        series: the two-dimensional Fourier representation that it began with.
        others: views that the points leave possible, most probable first.
        swapped: (frames, 2) where left and right of arms and legs were exchanged in the points, which was undone.
        points: what was lifted, left and right as they should be.
        contradiction: the view that the points themselves say, where one was given that they speak against: it isn't
            that, or, where the two have opposite signs, left and right are exchanged throughout. Bands don't hold then.
        misfit: minus the logarithm of the posterior density at the best view, up to a constant, by the closed form (eq.
            4.6). Above `UNLIKE` the walk isn't like those that the prior was learned from, and bands don't hold.

    Bands and deviations were found to hold for people left out of CMU's capture. Joint centres that were made in
    another way, as those of other data sets, shift them: the view by some degrees.
    """

    refined: Refined
    series: Series
    others: tuple[OtherView, ...]
    swapped: np.ndarray
    points: Points
    contradiction: OtherView | None
    misfit: float

    @cached_property
    def walker(self) -> Walker:
        """The walk as a Fourier series: zero phase as in `motionenv.models.harmonics`, not at the first frame."""
        found = self.refined
        stride = gait(found.coefficients).stride_length
        return Walker(found.coefficients, found.frequency, stride * found.frequency, name=self.points.name)

    @property
    def band(self) -> np.ndarray:
        """(frames, 15, 3) [m]: positions ± this hold 90 % of the truths, of people like those learned from."""
        return BAND * self.refined.deviations

    def markers(self) -> Markers:
        """The 15 markers, frame by frame as the points.

        Without a camera the walker goes along x from the origin, carried by the foot that stands, as far as its steps
        take it: a picture without perspective doesn't show how far that is. With one it goes where it was seen.
        """
        found = self.refined
        if found.camera is not None:
            return Markers(MARKERS, found.positions, self.points.fps, name=self.points.name)
        positions = gait(found.coefficients).positions(found.phases)
        return Markers(MARKERS, positions, self.points.fps, name=self.points.name)

    def motion(self) -> Motion:
        """The cylinder body, with joint angles, that does what `markers` do; limbs are as long as the walker's."""
        found = self.refined
        if found.camera is None:
            return gait(found.coefficients).motion(found.phases, self.points.fps, name=self.points.name)
        nodes = np.concatenate([found.positions, found.positions[:, _SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
        skeleton = fit_skeleton(nodes)
        return Motion(fit_poses(nodes, skeleton, self.points.fps), skeleton, self.points.fps, self.points.name)


def lift(
    points: Points,
    alpha: float | None = None,
    *,
    prior: WalkerPrior | str = "walk/prior",
    elevation: float | None = 0.0,
    scale: float | None = None,
    camera: Camera | None = None,
    robust: bool = True,
) -> Lifted:
    """The 3D walk that 2D points of one camera show, the view from which they do, and how sure both are.

    Where points are missing, for a while or throughout, the prior fills them. Orthographic points say all angles but
    for what a symmetric walker leaves open; see `Lifted.others`. Left and right exchanged throughout are the view from
    the other side: `Lifted.contradiction` tells where the view is known.

    Args:
        points: of one walker who goes straight ahead at a steady pace, 1.5 strides or more.
        alpha: view angle [rad] of `motionenv.estimation.lifting.geometry`; None finds it, over the full circle.
        prior: a `WalkerPrior`, or the name or path of one.
        elevation: angle [rad] by which the camera looks down; None finds it. A `camera` has its own.
        scale: pixels per metre at the walker; None finds it. Points in metres have none.
        camera: a pinhole camera with its pose in a world whose ground is z = 0; takes perspective into account.
        robust: whether points far off count less.

    Raises:
        MotionError: units, settings or points that don't go together; a motion that isn't periodic.
        GapError: fewer than 1.5 strides, or too few points.
    """
    model = load(prior) if isinstance(prior, str) else prior
    if not isinstance(model, WalkerPrior):
        raise MotionError(f"lifting needs a WalkerPrior such as walk/prior, got {type(model).__name__}")
    _check(points, alpha, elevation, scale, camera)
    check_points(points, scale)
    points, swapped = unswapped(points)
    series = fourier_points(points)
    check_series(series)
    if camera is not None:
        elevation = float(-np.arcsin(np.clip(camera.R[2, 2], -1, 1)))
    best_views = partial(
        find_view,
        model,
        series.coefficients,
        variance=None,
        phase="unknown",
        elevation="unknown" if elevation is None else elevation,
        scale=1.0 if points.unit == "m" else "unknown" if scale is None else scale,
        offset="unknown",
    )
    views = best_views(alphas=alpha)
    free = views if alpha is None else best_views()
    unknown = [name for name, given in (("alpha", alpha), ("elevation", elevation), ("scale", scale)) if given is None]
    if points.unit == "m" or camera is not None:
        unknown = [name for name in unknown if name != "scale"]
    found = refine(model, points, _start(model, views, series), camera=camera, unknown=tuple(unknown), robust=robust)
    contradiction = _contradiction(views, free)
    return Lifted(found, series, _others(views), swapped, points, contradiction, float(free.objective))


def _check(points, alpha, elevation, scale, camera) -> None:
    """Refuse settings that don't go together.

    Raises:
        MotionError: names them.
    """
    if not isinstance(points, Points):
        raise MotionError(f"points must be motionenv Points, got {type(points).__name__}: make them with read_points")
    for name, given in (("alpha", alpha), ("elevation", elevation), ("scale", scale)):
        if given is not None and not (isinstance(given, Real) and math.isfinite(given)):
            raise MotionError(f"{name} must be a finite number, or None where it isn't known; got {given!r}")
    if camera is not None and not isinstance(camera, Camera):
        raise MotionError(f"camera must be a motionenv Camera, or None; got {type(camera).__name__}")
    if elevation is not None and not ELEVATIONS[0] <= elevation <= ELEVATIONS[1]:
        low, high = np.degrees(ELEVATIONS)
        raise MotionError(f"elevation must lie between {low:g} and {high:g} degrees, got {np.degrees(elevation):g}")
    if scale is not None and (points.unit == "m" or scale <= 0):
        raise MotionError(f"scale is pixels per metre, above 0, for points in pixels; got {scale!r} for {points.unit}")
    if camera is not None and points.unit != "px":
        raise MotionError("a camera goes with points in pixels; these are in metres: leave the camera out")


def _start(model, views: Views, series: Series) -> Start:
    """The closed-form estimate at the best view; phase 0 of the series is its first frame."""
    w = model.inverse_transform(views.scores)
    return Start(
        w, float(views.alpha), series.frequency, float(-views.phase), float(views.elevation), float(views.scale)
    )


def _contradiction(given: Views, free: Views) -> OtherView | None:
    """The best of all views, where it is far more probable than the given one."""
    odds = float(given.objective - free.objective)
    if odds < _CONTRADICTED:
        return None
    return OtherView(float(free.alpha), float(free.elevation), float(1 / (1 + np.exp(-odds))))


def _others(views: Views) -> tuple[OtherView, ...]:
    """Other views with their probabilities, as far as they count."""
    rest = views.alternatives
    if rest is None:
        return ()
    odds = np.exp(views.objective - rest.objective)
    odds = np.where(np.isfinite(odds), odds, 0.0)
    share = odds / (1 + odds.sum())
    return tuple(
        OtherView(float(rest.alpha[i]), float(rest.elevation[i]), float(share[i]))
        for i in np.argsort(-share)
        if share[i] >= _PLAUSIBLE
    )
