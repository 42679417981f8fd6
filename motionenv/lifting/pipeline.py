"""The lifting pipeline from 2D points to motion in 3D, as `motionenv lift` runs it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from numbers import Real

import numpy as np
from scipy.stats import chi

from motionenv._core.precompilation import precompile
from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number, checked_whole
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.lifting.fourier_fit import Series, fourier_points
from motionenv.lifting.free.lifter import MOSTLY, SURPRISE, FreeFit, fit_freely, heading_of, limb_lengths, undetermined
from motionenv.lifting.free.posture_network import BODY_UNIT
from motionenv.lifting.free.smoother import contacts
from motionenv.lifting.posterior import BAND, WalkPosterior
from motionenv.lifting.side_labels import swapped_back, unswapped
from motionenv.lifting.steady import steady_walk
from motionenv.lifting.validation import check_points, check_series, check_strides
from motionenv.lifting.views.unknown_view import ELEVATIONS, Views, find_view
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.locomotion import gait
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from motionenv.types import HEIGHT_RANGE, MARKERS, Camera, Markers, Motion, Points

_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_PLAUSIBLE = 0.01  # least probability of an alternative view that is reported
#: Log-odds above which the points contradict a given view. On six CMU walks the true view has less than 1, a view 10
#: degrees off 9 to 160, 30 degrees off more than 100, and swapped sides (view angles from 10 degrees) at least 68.
_CONTRADICTED = 50.0
_CLOSE = 0.05  # [m]
_ACROSS = 1000.0  # [pixels] of points in metres that are fitted freely


@dataclass(frozen=True, eq=False)
class OtherView:
    """A view, `alpha` and `elevation` [rad], that also fits the points; `probability` is posterior, among all views."""

    alpha: float
    elevation: float
    probability: float


@dataclass(frozen=True, eq=False, repr=False)
class Lifted(OneLine):
    """A person's motion in 3D with its uncertainty.

    A straight, steady walk is a Fourier walker with a view (`posterior`, paper B); any other motion is fitted frame by
    frame (`free`). One of the two is None.

    Attributes:
        points: the lifted points, with swaps corrected.
        swapped: (frames, 2) where left and right of arms and legs were swapped in the input.
        posterior: walker, view and path, with their covariance.
        series: the 2D Fourier series that the posterior is given.
        others: alternative views of a steady walk, most probable first; for other motion see `FreeFit.other`.
        contradiction: set if the given view contradicts the points: the view that fits them. Either the given view is
            wrong, or, if the two have opposite signs, left and right are swapped throughout. `band` is then invalid.
        free: positions, contacts and weights of a motion that isn't a steady walk.

    Bands and deviations were calibrated on held-out people of the CMU data. Data sets that define joint centres in
    another way bias them: the view by some degrees.
    """

    points: Points
    swapped: np.ndarray
    posterior: WalkPosterior | None = None
    series: Series | None = None
    others: tuple[OtherView, ...] = ()
    contradiction: OtherView | None = None
    free: FreeFit | None = None

    def _shown(self) -> str:
        kind = "any motion" if self.posterior is None else "a steady walk"
        seen = "" if self.posterior is None else f", seen at {np.degrees(self.posterior.alpha):.0f}°"
        return f"{len(self.points.positions)} frames of {kind}{seen}{'' if self.plausible else ', implausible'}"

    @property
    def misfit(self) -> float:
        """Distance of the motion from the people learned from: `WalkPosterior.misfit`, or `FreeFit.misfit`."""
        return self._fit.misfit

    @property
    def plausible(self) -> bool:
        """Whether this is a motion like those learned from, and `determined` in nine of ten frames that show somebody.

        Else `band` is invalid.
        """
        present = np.isfinite(self.positions).all(axis=(1, 2))
        return self._fit.plausible and bool(self.determined[present].any(axis=1).mean() >= MOSTLY)

    @property
    def positions(self) -> np.ndarray:
        """Marker positions (frames, 15, 3) [m] in the frame of `WalkPosterior.positions` or `FreeFit.positions`."""
        return self._fit.positions

    @property
    def unlike(self) -> np.ndarray:
        """Frames (frames,) that show something else than what was learned from: sitting, an animal, noise."""
        if self.free is not None:
            return ~(self.free.surprise <= SURPRISE)  # also where nobody is seen
        return np.full(len(self.positions), not self.plausible)

    @cached_property
    def determined(self) -> np.ndarray:
        """Which markers (frames, 15) of free motion the points determine; others are what people usually do.

        Points determine a marker that is seen within a second, as long as all of a leg is.
        """
        if self.free is None:
            return np.ones(self.positions.shape[:2], dtype=bool)
        return ~undetermined(np.isfinite(self.points.positions).all(axis=-1), self.points.fps)

    @property
    def band(self) -> np.ndarray:
        """(frames, 15, 3) [m]: `positions` about the pelvis ± band cover 90 % of true ones.

        NaN in frames `unlike`, and for markers that aren't `determined`.
        """
        holds = self.determined & ~self.unlike[:, None]
        return np.where(holds[..., None], BAND * self._fit.deviations, np.nan)

    def draws(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """`count` motions (count, frames, 15, 3) [m] that the points may show, in the frame of `positions`.

        They come from the posterior about `positions`: coordinates of a frame, frames and joints belong together in a
        draw, so that angles, times and lengths can be taken from each. About the pelvis they spread as far as `band`
        tells: the part of it that the network's and the detector's errors make lasts as long as the sequence does, and
        so does the size of everything. Their memory is 360 bytes per draw and frame.

        Args:
            count: number of draws.
            rng: source of randomness; the same state, the same draws.
        """
        return self.draws_with_feet(count, rng)[0]

    def draws_with_feet(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray | None]:
        """`draws` of `count` and `rng`, and left heel and toe, right heel and toe of each (count, frames, 4, 3) [m]."""
        count = checked_whole(count, "count", 1)
        if self.posterior is not None:
            return self.posterior.draws(count, rng), None
        assert self.free is not None
        return self.free.draws(count, rng)

    @property
    def feet(self) -> np.ndarray | None:
        """Left heel and toe and right heel and toe (frames, 4, 3) [m] of free motion, if the points show them."""
        return None if self.free is None else self.free.feet(self.positions)

    @property
    def heading(self) -> np.ndarray:
        """Direction in which the body faces (frames,) [rad], about z from x."""
        if self.posterior is not None:
            return np.zeros(len(self.positions))
        return heading_of(self.positions, self.points.fps)

    @property
    def contact(self) -> np.ndarray:
        """Probability (frames, 2) that the left and right foot stand."""
        if self.free is not None:
            return self.free.contact
        return contacts(self.markers().positions / BODY_UNIT, self.points.fps)[0]

    @property
    def confidence(self) -> np.ndarray:
        """Probability (frames, 15) that a marker is within 50 mm of its true place about the pelvis, or NaN."""
        deviation = np.where(self.determined, np.sqrt((self._fit.deviations**2).mean(axis=-1)), np.nan)
        return chi.cdf(_CLOSE / np.maximum(deviation, 1e-9), 3)

    @property
    def limb_lengths(self) -> dict[str, float]:
        """Lengths [m] of the person's limbs, the median over time and the mean of both sides."""
        return limb_lengths(self.positions)

    @cached_property
    def walker(self) -> FourierWalker:
        """The walk as a Fourier series, with phase 0 as defined in `fourier_series`, not at the first frame.

        Raises:
            MotionError: the motion isn't a steady walk.
        """
        found = self.posterior
        if found is None:
            raise MotionError("only a straight, steady walk is a Fourier walker: use markers() or motion()")
        stride = gait(found.coefficients).stride_length
        return FourierWalker(found.coefficients, found.frequency, stride * found.frequency, name=self.points.name)

    def markers(self) -> Markers:
        """The 15 markers (frames, 15, 3) [m], one frame per frame of the points.

        With a camera, positions are in the camera's world. Without one, a steady walker starts at the origin and goes
        along x; the distance follows from the stance foot, because an orthographic image does not show it.
        """
        found = self.posterior
        if found is None:
            return Markers(MARKERS, self.positions, self.points.fps, name=self.points.name)
        positions = gait(found.coefficients).positions(found.phases)
        return Markers(MARKERS, positions, self.points.fps, name=self.points.name)

    def motion(self) -> Motion:
        """Joint angles of the cylinder body that follow `markers`, with the person's limb lengths."""
        found = self.posterior
        if found is not None:
            return gait(found.coefficients).motion(found.phases, self.points.fps, name=self.points.name)
        return motion_of(self.positions, self.points.fps, self.points.name)

    @property
    def _fit(self) -> WalkPosterior | FreeFit:
        fit = self.free if self.posterior is None else self.posterior
        assert fit is not None
        return fit


def motion_of(positions: np.ndarray, fps: float, name: str = "") -> Motion:
    """Joint angles of the cylinder body that follow markers (frames, 15, 3) [m], with their limb lengths."""
    nodes = np.concatenate([positions, positions[:, _SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
    skeleton = fit_skeleton(nodes)
    return Motion(fit_poses(nodes, skeleton, fps), skeleton, fps, name)


def lift(
    points: Points, alpha: float | None = None, *, prior: WalkerPrior | str = "walk/prior",
    elevation: float | None = 0.0, scale: float | None = None,
    camera: Camera | Sequence[Camera] | np.ndarray | None = None, distortion: Sequence[float] | None = None,
    height: float | None = None, method: str = "auto",
    on_progress: Callable[[float], None] | None = None,
) -> Lifted:  # fmt: skip
    """Reconstruct a person's motion in 3D from the 2D points of one camera, with uncertainties.

    Points in pixels may show anybody who walks, turns, stops, steps aside or runs: they are fitted freely, which serves
    straight walks better than the steady walker, too (`benchmarks.free_walking.straight`). Points in metres, and those
    whose view or scale is given, are orthographic, and lifted as a steady walk.

    Missing points and markers are filled. Orthographic points determine all angles except those that a symmetric walker
    leaves ambiguous (see `Lifted.others`). Swapping left and right throughout is equivalent to a view from the other
    side; it is detected only if `alpha` is given (see `Lifted.contradiction`).

    Args:
        points: one person.
        alpha: view angle [rad] of a steady walk, see `motionenv.lifting.view_geometry`; None estimates it.
        prior: a `WalkerPrior`, or its name or path, for steady walks.
        elevation: angle [rad] by which the camera looks down; None estimates it. Ignored if `camera` has a pose.
        scale: pixels per metre at a steady walker; None estimates it. Must be None for points in metres.
        camera: pinhole camera with its pose in a world whose ground is z = 0, or one for each frame if it moves; its
            intrinsics (3, 3) [pixels] if the pose isn't known. None guesses intrinsics from the points.
        distortion: OpenCV's coefficients (k1, k2, p1, p2[, k3[, k4, k5, k6]]) of the camera's lens.
        height: the person's stature [m], from which the size of free motion follows; by default that of an adult, or by
            the floor if the camera's pose is known.
        method: "steady", "free", or "auto" as told above. "free" takes points in metres for scaled pixels.
        on_progress: called now and then with the share of free motion that is done.

    Raises:
        MotionError: incompatible units, arguments or points; for a steady walk, a motion that is not periodic.
        GapError: too few points, or for a steady walk fewer than 1.5 strides.
    """
    parallel = alpha is not None or scale is not None or (points.unit == "m" and method != "free")
    steady = method == "steady" or (method == "auto" and parallel)
    if steady:
        precompile("lift")
    model = load(prior) if isinstance(prior, str) else prior
    if not isinstance(model, WalkerPrior):
        raise MotionError(f"prior must be a WalkerPrior such as walk/prior, got {type(model).__name__}")
    if method not in ("auto", "steady", "free"):
        raise MotionError(f'method must be "auto", "steady" or "free", got {method!r}')
    _check(points, alpha, elevation, scale, camera)
    if method == "free" and parallel:
        raise MotionError("free motion needs points without alpha and scale: omit them, or method")
    if camera is not None and (method == "steady" or parallel):
        raise MotionError("a steady walk is lifted orthographically: omit camera, or method, alpha and scale")
    _check_height(height, steady)
    check_points(points, scale)
    if steady:
        return _steady(model, points, alpha, elevation, scale)
    points = _as_pixels(points)
    free = fit_freely(
        points, camera, distortion=distortion, elevation=elevation, height=height, on_progress=on_progress
    )
    return Lifted(swapped_back(points, free.swapped), free.swapped, free=free)


def _as_pixels(points: Points) -> Points:
    """Points in metres in a picture's plane, which are scaled pixels, as pixels again; their scale is arbitrary."""
    if points.unit == "px":
        return points
    low, high = (edge(points.positions, axis=(0, 1)) for edge in (np.nanmin, np.nanmax))
    from_corner = (points.positions - [low[0], high[1]]) * [1.0, -1.0]
    return replace(points, positions=from_corner * _ACROSS / (high - low).max(), unit="px")


def _steady(model: WalkerPrior, points: Points, alpha, elevation, scale) -> Lifted:
    """Lift a straight and steady walk: Fourier series, view, and the walker."""
    try:
        check_strides(points)
        points, swapped = unswapped(points)
        series = fourier_points(points)
        check_series(series)
    except MotionError as error:
        raise type(error)(f'{error}; or lift any motion by method="free" (--method free)') from error
    best_views = partial(
        find_view, model, series.coefficients, variance=None, phase="unknown",
        elevation="unknown" if elevation is None else elevation,
        scale=1.0 if points.unit == "m" else "unknown" if scale is None else scale, offset="unknown",
    )  # fmt: skip
    views = best_views(alphas=alpha)
    free = views if alpha is None else best_views()
    unknown = [name for name, given in (("alpha", alpha), ("elevation", elevation), ("scale", scale)) if given is None]
    if points.unit == "m":
        unknown = [name for name in unknown if name != "scale"]
    found = steady_walk(model, points, series, views, tuple(unknown))
    return Lifted(points, swapped, found, series, _others(views), _contradiction(views, free))


def _check_height(height: float | None, steady: bool) -> None:
    if height is not None:
        checked_number(height, "height", *HEIGHT_RANGE)
        if steady:
            raise MotionError("height is of free motion, lifted from pixels: omit it, or method, alpha and scale")


def _check(points, alpha, elevation, scale, camera) -> None:
    if not isinstance(points, Points):
        raise MotionError(f"points must be Points, got {type(points).__name__}: read them with motionenv.read_points")
    for name, given in (("alpha", alpha), ("elevation", elevation), ("scale", scale)):
        if given is not None and not (isinstance(given, Real) and math.isfinite(given)):
            raise MotionError(f"{name} must be a finite number, or None if it is unknown; got {given!r}")
    if not (camera is None or isinstance(camera, Camera | np.ndarray | list | tuple)):
        raise MotionError(f"camera must be a Camera, one per frame, intrinsics or None, got {type(camera).__name__}")
    if elevation is not None and not ELEVATIONS[0] <= elevation <= ELEVATIONS[1]:
        low, high = np.degrees(ELEVATIONS)
        raise MotionError(f"elevation must be from {low:g} to {high:g} degrees, got {np.degrees(elevation):g}")
    if scale is not None and (points.unit == "m" or scale <= 0):
        raise MotionError(
            f"scale must be above 0 (pixels per metre) and needs points in pixels; got {scale!r} for {points.unit}"
        )
    if camera is not None and points.unit != "px":
        raise MotionError("camera needs points in pixels; these are in metres: omit the camera")


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
