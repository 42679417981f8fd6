"""The lifting pipeline from 2D points to motion in 3D, as `motionenv lift` runs it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from numbers import Real

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.special import expit
from scipy.stats import chi

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number, checked_whole
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.errors import MotionError
from motionenv.lifting.free.lifter import MOSTLY, SURPRISE, FreeFit, fit_freely, heading_of, limb_lengths, undetermined
from motionenv.lifting.side_labels import swapped_back
from motionenv.lifting.validation import check_points
from motionenv.types import HEIGHT_RANGE, MARKERS, Camera, Markers, Motion, Points

#: Half-width of the central 90 % interval of a Gaussian, in standard deviations.
BAND = 1.6448536269514722
_ELEVATIONS = (-15.0, 45.0)  # [degrees] by which a camera may look down
_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_CLOSE = 0.05  # [m]
#: Points in metres are what a camera sees from so many times their extent, on a picture so many pixels across.
_AFAR, _ACROSS = 15.0, 1000.0
#: What a reader of what is lifted from them should know.
FROM_AFAR = (
    "points in metres are taken to be without perspective: ways towards the camera follow from the feet, and are too "
    "short by about a fifth"
)
_ROUNDS = 2
_LIFTED, _AHEAD = 0.02, 0.5  # [m], [s]
#: Deviation of the logarithm of ways towards the camera, which are too short by a fifth for walkers of CMU.
_WAYS = 0.25
_PELVIS, _ANKLES = MARKERS.index("pelvis"), [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]


@dataclass(frozen=True, eq=False, repr=False)
class Lifted(OneLine):
    """A person's motion in 3D with its uncertainty.

    Attributes:
        points: the lifted points, with swaps corrected.
        swapped: (frames, 2) where left and right of arms and legs were swapped in the input.
        free: positions, contacts and weights of the motion, fitted frame by frame.

    Bands and deviations were calibrated on held-out people of the CMU data. Data sets that define joint centres in
    another way bias them.
    """

    points: Points
    swapped: np.ndarray
    free: FreeFit

    def _shown(self) -> str:
        return f"{len(self.points.positions)} frames{'' if self.plausible else ', implausible'}"

    @property
    def misfit(self) -> float:
        """Distance of the motion from the people learned from: `FreeFit.misfit`."""
        return self.free.misfit

    @property
    def plausible(self) -> bool:
        """Whether this is a motion like those learned from, and `determined` in nine of ten frames that show somebody.

        Else `band` is invalid.
        """
        present = np.isfinite(self.positions).all(axis=(1, 2))
        return self.free.plausible and bool(self.determined[present].any(axis=1).mean() >= MOSTLY)

    @property
    def positions(self) -> np.ndarray:
        """Marker positions (frames, 15, 3) [m] in the frame of `FreeFit.positions`."""
        return self.free.positions

    @property
    def unlike(self) -> np.ndarray:
        """Frames (frames,) that show something else than what was learned from: sitting, an animal, noise."""
        return ~(self.free.surprise <= SURPRISE)  # also where nobody is seen

    @cached_property
    def determined(self) -> np.ndarray:
        """Which markers (frames, 15) the points determine; others are what people usually do.

        Points determine a marker that is seen within a second, as long as all of a leg is.
        """
        return ~undetermined(np.isfinite(self.points.positions).all(axis=-1), self.points.fps)

    @property
    def band(self) -> np.ndarray:
        """(frames, 15, 3) [m]: `positions` about the pelvis ± band cover 90 % of true ones.

        NaN in frames `unlike`, and for markers that aren't `determined`.
        """
        holds = self.determined & ~self.unlike[:, None]
        return np.where(holds[..., None], BAND * self.free.deviations, np.nan)

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
        return self.free.draws(checked_whole(count, "count", 1), rng)

    @property
    def feet(self) -> np.ndarray | None:
        """Left heel and toe and right heel and toe (frames, 4, 3) [m], if the points show them."""
        return self.free.feet(self.positions)

    @property
    def heading(self) -> np.ndarray:
        """Direction in which the body faces (frames,) [rad], about z from x."""
        return heading_of(self.positions, self.points.fps)

    @property
    def contact(self) -> np.ndarray:
        """Probability (frames, 2) that the left and right foot stand."""
        return self.free.contact

    @property
    def confidence(self) -> np.ndarray:
        """Probability (frames, 15) that a marker is within 50 mm of its true place about the pelvis, or NaN."""
        deviation = np.where(self.determined, np.sqrt((self.free.deviations**2).mean(axis=-1)), np.nan)
        return chi.cdf(_CLOSE / np.maximum(deviation, 1e-9), 3)

    @property
    def limb_lengths(self) -> dict[str, float]:
        """Lengths [m] of the person's limbs, the median over time and the mean of both sides."""
        return limb_lengths(self.positions)

    def markers(self) -> Markers:
        """The 15 markers (frames, 15, 3) [m], one frame per frame of the points."""
        return Markers(MARKERS, self.positions, self.points.fps, name=self.points.name)

    def motion(self) -> Motion:
        """Joint angles of the cylinder body that follow `markers`, with the person's limb lengths."""
        return motion_of(self.positions, self.points.fps, self.points.name)


def motion_of(positions: np.ndarray, fps: float, name: str = "") -> Motion:
    """Joint angles of the cylinder body that follow markers (frames, 15, 3) [m], with their limb lengths."""
    nodes = np.concatenate([positions, positions[:, _SHOULDERS].mean(axis=1, keepdims=True)], axis=1)
    skeleton = fit_skeleton(nodes)
    return Motion(fit_poses(nodes, skeleton, fps), skeleton, fps, name)


def lift(
    points: Points, *, camera: Camera | Sequence[Camera] | np.ndarray | None = None,
    distortion: Sequence[float] | None = None, elevation: float | None = 0.0, height: float | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> Lifted:  # fmt: skip
    """Reconstruct a person's motion in 3D from the 2D points of one camera, with uncertainties.

    The points may show anybody who walks, turns, stops, steps aside or runs. Missing ones are filled, and where left
    and right were exchanged for a while, they are exchanged back.

    Points in metres are taken to be seen from afar, without perspective: they tell the person's size, but ways towards
    the camera only by the feet that stand.

    Args:
        points: one person.
        camera: pinhole camera with its pose in a world whose ground is z = 0, or one for each frame if it moves; its
            intrinsics (3, 3) [pixels] if the pose isn't known. None guesses intrinsics from the points.
        distortion: OpenCV's coefficients (k1, k2, p1, p2[, k3[, k4, k5, k6]]) of the camera's lens.
        elevation: angle [rad] by which the camera looks down; None estimates it. Ignored if `camera` has a pose.
        height: the person's stature [m], from which the size follows; by default that of an adult, or by the floor if
            the camera's pose is known. Must be None for points in metres.
        on_progress: called now and then with the share that is done.

    Raises:
        MotionError: incompatible units, arguments or points.
        GapError: too few points.
    """
    _check(points, elevation, camera, height)
    check_points(points)
    if points.unit == "m":
        free = _fitted_from_afar(points, elevation, on_progress or (lambda share: None))
    else:
        free = fit_freely(
            points, camera, distortion=distortion, elevation=elevation, height=height, on_progress=on_progress
        )
    return Lifted(swapped_back(points, free.swapped), free.swapped, free)


def _fitted_from_afar(points: Points, elevation: float | None, tell: Callable[[float], None]) -> FreeFit:
    """The fit to points in metres, seen without perspective, by cameras that are far away.

    As a camera sees people who come nearer grow, it would find that nobody does. So the points are made to grow as
    those of somebody would who walks as the standing feet tell.
    """
    low, high = (edge(points.positions, axis=(0, 1)) for edge in (np.nanmin, np.nanmax))
    extent = float((high - low).max())
    scale, distance, middle = _ACROSS / extent, _AFAR * extent, 0.5 * (low + high)
    inner = np.array([[_AFAR * _ACROSS, 0, 0], [0, _AFAR * _ACROSS, 0], [0, 0, 1.0]])
    way = np.zeros(len(points.positions))
    for round_ in range(_ROUNDS):
        grow = (distance / (distance + way))[:, None, None] * [scale, -scale]
        free = fit_freely(
            replace(
                points, positions=(points.positions - middle) * grow, unit="px",
                feet=None if points.feet is None else (points.feet - middle) * grow,
            ),
            inner, elevation=elevation, distance=distance,
            on_progress=partial(lambda before, share: tell((before + share) / _ROUNDS), round_),
        )  # fmt: skip
        way = _way_of(free.positions, points.fps)
    return replace(free, focal_deviation=_WAYS)


def _way_of(positions: np.ndarray, fps: float) -> np.ndarray:
    """The way along y (frames,) [m] of somebody at `positions`, about its mean, by the foot that stands.

    It is the one that goes backwards fastest, relative to the pelvis. Which way that is tells the lower one.
    """
    ankles = positions[:, _ANKLES]
    steps = -np.gradient(ankles[..., 1] - positions[:, [_PELVIS], 1], axis=0)
    steps = np.nan_to_num(steps)
    lower = expit(np.nan_to_num(ankles[:, ::-1, 2] - ankles[..., 2]) / _LIFTED)
    ahead = np.sign(gaussian_filter1d((lower * steps).sum(axis=1), _AHEAD * fps, mode="nearest"))
    way = np.cumsum(ahead * (ahead[:, None] * steps).max(axis=1))
    return way - way.mean()


def _check(points, elevation, camera, height) -> None:
    if not isinstance(points, Points):
        raise MotionError(f"points must be Points, got {type(points).__name__}: read them with motionenv.read_points")
    if elevation is not None and not (isinstance(elevation, Real) and math.isfinite(elevation)):
        raise MotionError(f"elevation must be a finite number, or None if it is unknown; got {elevation!r}")
    if not (camera is None or isinstance(camera, Camera | np.ndarray | list | tuple)):
        raise MotionError(f"camera must be a Camera, one per frame, intrinsics or None, got {type(camera).__name__}")
    low, high = _ELEVATIONS
    if elevation is not None and not low <= math.degrees(elevation) <= high:
        raise MotionError(f"elevation must be from {low:g} to {high:g} degrees, got {math.degrees(elevation):g}")
    if height is not None:
        checked_number(height, "height", *HEIGHT_RANGE)
    if points.unit == "m" and (given := "camera" if camera is not None else "height" if height is not None else None):
        raise MotionError(f"{given} needs points in pixels; these are in metres: omit {given}")
