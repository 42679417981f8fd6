"""The lifting pipeline from 2D points to a 3D walk, as `motionenv lift` runs it."""

import math
from dataclasses import dataclass
from functools import cached_property, partial
from numbers import Real

import numpy as np

from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.lifting.fourier_fit import Series, fourier_points
from motionenv.lifting.posterior import BAND, WalkPosterior
from motionenv.lifting.refinement import Start, refine
from motionenv.lifting.validation import check_points, check_series, unswapped
from motionenv.lifting.views.unknown_view import ELEVATIONS, Views, find_view
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.locomotion import gait
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from motionenv.types import MARKERS, Camera, Markers, Motion, Points

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_PLAUSIBLE = 0.01  # least probability of an alternative view that is reported
#: Log-odds above which the points contradict a given view. On six CMU walks the true view has less than 1, a view 10
#: degrees off 9 to 160, 30 degrees off more than 100, and swapped sides (view angles from 10 degrees) at least 68.
_CONTRADICTED = 50.0
#: Misfit above which a walk is outside the prior's population: the 99 % quantile of people left out.
#: `motionenv bench lifting.misfit` chooses it on ten people for the eleventh: 1.7 % are false alarms.
MISFIT_LIMIT = 1.2


@dataclass(frozen=True, eq=False)
class OtherView:
    """A view, `alpha` and `elevation` [rad], that also fits the points; `probability` is posterior, among all views."""

    alpha: float
    elevation: float
    probability: float


@dataclass(frozen=True, eq=False)
class Lifted:
    """A 3D walk with its uncertainty.

    Attributes:
        posterior: walker, view and path, with their covariance.
        series: the 2D Fourier series from which refinement started.
        others: alternative views, most probable first.
        swapped: (frames, 2) where left and right of arms and legs were swapped in the input.
        points: the lifted points, with swaps corrected.
        contradiction: set if the given view contradicts the points: the view that fits them. Either the given view is
            wrong, or, if the two have opposite signs, left and right are swapped throughout. `band` is then invalid.

    Bands and deviations were calibrated on held-out people of the CMU data. Data sets that define joint centres in
    another way bias them: the view by some degrees.
    """

    posterior: WalkPosterior
    series: Series
    others: tuple[OtherView, ...]
    swapped: np.ndarray
    points: Points
    contradiction: OtherView | None

    @property
    def misfit(self) -> float:
        """`WalkPosterior.misfit`: how far the walk is from the prior's people; above `MISFIT_LIMIT` too far."""
        return self.posterior.misfit

    @property
    def plausible(self) -> bool:
        """Whether the fit converged to a walk like those that the prior was fitted to; else `band` is invalid."""
        return self.posterior.converged and self.misfit <= MISFIT_LIMIT

    @cached_property
    def walker(self) -> FourierWalker:
        """The walk as a Fourier series, with phase 0 as defined in `fourier_series`, not at the first frame."""
        found = self.posterior
        stride = gait(found.coefficients).stride_length
        return FourierWalker(found.coefficients, found.frequency, stride * found.frequency, name=self.points.name)

    @property
    def band(self) -> np.ndarray:
        """(frames, 15, 3) [m]: `positions` ± band covers 90 % of true positions, for people like those in the prior."""
        return BAND * self.posterior.deviations

    def markers(self) -> Markers:
        """The 15 markers (frames, 15, 3) [m], one frame per frame of the points.

        Without a camera the walker starts at the origin and walks along x; the distance follows from the stance foot,
        because an orthographic image does not show it. With a camera, positions are in the camera's world.
        """
        found = self.posterior
        if found.camera is not None:
            return Markers(MARKERS, found.positions, self.points.fps, name=self.points.name)
        positions = gait(found.coefficients).positions(found.phases)
        return Markers(MARKERS, positions, self.points.fps, name=self.points.name)

    def motion(self) -> Motion:
        """Joint angles of the cylinder body that follow `markers`, with the walker's limb lengths."""
        found = self.posterior
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
    """Reconstruct the 3D walk and the view from the 2D points of one camera, with uncertainties.

    The prior fills missing points and missing markers. Orthographic points determine all angles except those that a
    symmetric walker leaves ambiguous (see `Lifted.others`). Swapping left and right throughout is equivalent to a view
    from the other side; it is detected only if `alpha` is given (see `Lifted.contradiction`).

    Args:
        points: one person walking straight ahead at a steady pace, at least 1.5 strides.
        alpha: view angle [rad], see `motionenv.lifting.view_geometry`; None estimates it over the full circle.
        prior: a `WalkerPrior`, or its name or path.
        elevation: angle [rad] by which the camera looks down; None estimates it. Ignored if `camera` is given.
        scale: pixels per metre at the walker; None estimates it. Must be None for points in metres.
        camera: pinhole camera with its pose in a world whose ground is z = 0; enables perspective.
        robust: whether to weight outliers down.

    Raises:
        MotionError: incompatible units, arguments or points; a motion that is not periodic.
        GapError: fewer than 1.5 strides, or too few points.
    """
    model = load(prior) if isinstance(prior, str) else prior
    if not isinstance(model, WalkerPrior):
        raise MotionError(f"prior must be a WalkerPrior such as walk/prior, got {type(model).__name__}")
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
    return Lifted(found, series, _others(views), swapped, points, _contradiction(views, free))


def _check(points, alpha, elevation, scale, camera) -> None:
    if not isinstance(points, Points):
        raise MotionError(f"points must be Points, got {type(points).__name__}: read them with motionenv.read_points")
    for name, given in (("alpha", alpha), ("elevation", elevation), ("scale", scale)):
        if given is not None and not (isinstance(given, Real) and math.isfinite(given)):
            raise MotionError(f"{name} must be a finite number, or None if it is unknown; got {given!r}")
    if camera is not None and not isinstance(camera, Camera):
        raise MotionError(f"camera must be a Camera or None, got {type(camera).__name__}")
    if elevation is not None and not ELEVATIONS[0] <= elevation <= ELEVATIONS[1]:
        low, high = np.degrees(ELEVATIONS)
        raise MotionError(f"elevation must be from {low:g} to {high:g} degrees, got {np.degrees(elevation):g}")
    if scale is not None and (points.unit == "m" or scale <= 0):
        raise MotionError(
            f"scale must be above 0 (pixels per metre) and needs points in pixels; got {scale!r} for {points.unit}"
        )
    if camera is not None and points.unit != "px":
        raise MotionError("camera needs points in pixels; these are in metres: omit the camera")


def _start(model, views: Views, series: Series) -> Start:
    """The closed-form estimate at the best view. Phase 0 of the series is its first frame."""
    w = model.inverse_transform(views.scores)
    return Start(
        w, float(views.alpha), series.frequency, float(-views.phase), float(views.elevation), float(views.scale)
    )


def _contradiction(given: Views, free: Views) -> OtherView | None:
    """The best view over the full circle, if it is far more probable than the given one."""
    odds = float(given.objective - free.objective)
    if odds < _CONTRADICTED:
        return None
    return OtherView(float(free.alpha), float(free.elevation), float(1 / (1 + np.exp(-odds))))


def _others(views: Views) -> tuple[OtherView, ...]:
    """Alternative views with probabilities of at least `_PLAUSIBLE`."""
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
