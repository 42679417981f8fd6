"""Lift people who move freely: turn, stop, hurry, step aside, run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.special import expit, logit
from threadpoolctl import ThreadpoolController

from motionenv._core.representation import OneLine
from motionenv.body import EDGES
from motionenv.errors import GapError
from motionenv.lifting.free.feet import FootRays, lift_feet
from motionenv.lifting.free.posture_network import BODY_UNIT, RATE, PostureNetwork, Proposal, propose, shipped_network
from motionenv.lifting.free.rays import Rays, rays_of
from motionenv.lifting.free.smoother import DEFAULTS, Fit, Settings, smooth
from motionenv.lifting.side_labels import continuous_labels, exchanged, find_swaps, swapped_back
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.types import MARKERS, Camera, Points

_M = {name: i for i, name in enumerate(MARKERS)}
#: Longest stretch that is fitted at once, and the overlap of two stretches [s]: memory stays bounded.
_STRETCH, _OVERLAP = 40.0, 2.0
#: Time [s] without at least so many markers after which somebody is absent, and least frames of those shown again.
_ABSENT, _SHOWN, _LEAST = 2.0, 4, 5
_RECENTLY = 1.0  # [s] before and after a marker is seen for which bands of its places hold
#: Height of a standing ankle's centre: mean and deviation [m]; markers and detectors define it differently.
_ANKLE, _ANKLE_DEVIATION = 0.095, 0.02
#: Deviation of the logarithm of the floor's distance: without noise, and its increase with it and with the squared sine
#: of the angle by which the camera looks down; chosen on laboratories' people and CMU's (`free_walking.size`).
_FLOOR_DEVIATION = (0.004, 0.1, 0.03)
#: Deviation of the logarithm of adults' stature, women and men together (mean 1.69 m, deviation 0.095 m).
_STATURE_DEVIATION = 0.056
#: [m] stature of whose body unit is `BODY_UNIT`, and the deviation of its logarithm for people of one stature.
_STATURE, _PROPORTIONS_DEVIATION = 1.72, 0.02
_SEEN_DEVIATION = 0.005  # of the logarithm of the size of somebody at a known distance
#: Greatest surprise. People left out never exceed it as they were captured; clips of exaggerated styles do in 5 % of
#: the frames, people who sit or cycle in 79 % and more (`motionenv bench free_walking.unlike`).
SURPRISE = 0.17
MOSTLY = 0.9  # least share of the frames in which bands hold if a motion is plausible
_LEAST_CONFIDENCE = 0.1  # relative to the median: nothing is ignored only for its confidence
_SIZES = (-0.4, 0.2)  # logarithm of a person's size relative to an adult's: from 1.15 m to 2.1 m
_ELEVATIONS = np.radians(np.arange(-20, 61, 5))
#: Log-odds per logarithm of the ratio of two misfits, and probability that a detector exchanged all left and right.
#: Logistic regression on people left out gives 38 to 78 (`motionenv bench free_walking.mirrored`).
_EVIDENCE, _EXCHANGED = 40.0, 0.01
_SURER = 0.05  # by how much less certain of a mirror image the network may be if that is to be fitted, in logarithms
_LIKELY = 0.01  # least probability that is told
#: A picture was made wider if the network is by so much surer of points that are as much narrower, and narrower if it
#: is hardly less sure of wider ones; in either case as sure as of walkers. In logarithms
#: (`motionenv bench lifting.wrong_input`).
_MADE_WIDER, _MADE_NARROWER, _SURE = (9 / 16, 0.1), (1.5, -0.04), -2.8
_LOOKED = 128  # frames by which an unknown elevation, or a mirror image, is judged
_FOOT_DETECTED = 0.012  # [m] deviation of a detector's heels and toes, as of its ankles (Needham et al. 2021)
_DETECTED = 0.025  # [m] by which a detector's joints are elsewhere for as long as a sequence lasts
_SPREAD = KEYPOINT_SETS["coco-17"].spread  # how far they are, by joint; most detectors learn from COCO's pictures
_HEADING = 0.15  # [s] deviation of the Gaussian that smooths headings


@dataclass(frozen=True, eq=False, repr=False)
class OtherMotion(OneLine):
    """The motion if left and right were exchanged in all points: the body faces another way.

    Attributes:
        positions: (frames, 15, 3) [m], as `FreeFit.positions`.
        probability: posterior probability that this is the true motion.
    """

    positions: np.ndarray
    probability: float


@dataclass(frozen=True, eq=False, repr=False)
class FreeFit(OneLine):
    """Motion of somebody who moves freely.

    Attributes:
        positions: (frames, 15, 3) [m] in the camera's world; NaN where nobody is seen for two seconds. A camera of
            unknown pose is at its origin and looks along y; z points up.
        deviations: (frames, 15, 3) [m] of the positions about the pelvis, calibrated on people left out; the size's
            uncertainty is part of them.
        contact: (frames, 2) probability that the left and right foot stand.
        swapped: (frames, 2) where left and right of arms and of legs were exchanged in the points.
        weights: (frames, 15) of the robust loss: about 1 for inliers, near 0 for outliers, 0 for missing points.
        unit: [m] the body unit, `BODY_UNIT` for an adult 1.72 m tall.
        unit_deviation: standard deviation of the logarithm of `unit`: the size of everything is uncertain by so much.
        noise: [m] standard deviation of the points at the person.
        origin: (3,) [m] mean position of the camera.
        focal: [pixels] its focal length, given or guessed.
        focal_deviation: standard deviation of its logarithm: ways towards the camera are uncertain by so much.
        surprise: (frames,) how unlike those of people who walk, turn or run the postures are; above `SURPRISE` too
            unlike for `deviations` to hold.
        other: the other motion that the points may show, if that is likely enough to be told.
        posed: whether the camera's pose was known.
        height: [m] the person's given stature; None if it wasn't.
        foot_rays: towards heels and toes; None if the points don't show them.
        bias: [m] by which a detector's joints are elsewhere for as long as the sequence lasts, as part of `deviations`.
        shape: 1 if people look as if their picture had been made wider, -1 if narrower, else 0.
    """

    positions: np.ndarray
    deviations: np.ndarray
    contact: np.ndarray
    swapped: np.ndarray
    weights: np.ndarray
    unit: float
    unit_deviation: float
    noise: float
    origin: np.ndarray
    focal: float
    surprise: np.ndarray
    other: OtherMotion | None = None
    posed: bool = False
    focal_deviation: float = 0.0
    height: float | None = None
    foot_rays: FootRays | None = None
    bias: float = 0.0
    shape: int = 0
    _stretches: tuple[tuple[Fit, slice], ...] = ()

    def draws(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray | None]:
        """Motions (`count`, frames, 15, 3) [m] by `rng`, as of `motionenv.lifting.Lifted.draws`; and feet, if seen."""
        lasting = rng.standard_normal((2, count, len(MARKERS), 3))
        lasting[:, :, _M["pelvis"]] = 0.0
        passing, off = np.zeros((2, count, *self.positions.shape))
        share, square = np.zeros((2, len(self.positions)))
        for fit, part in self._stretches:
            ends = _ends(part.stop - part.start)
            passing[:, part] += ends[:, None, None] * fit.passing(count, rng)
            off[:, part] += ends[:, None, None] * fit.lasting_for(lasting[0])
            share[part] += ends
            square[part] += ends**2
        share[share == 0] = np.nan
        # What passes is independent in two stretches, what lasts is the same: where they are blended, as wide as one.
        passing /= np.sqrt(np.where(square > 0, square, np.nan))[:, None, None]
        off = self.unit * (passing + off / share[:, None, None]) + self.bias * lasting[1][:, None]
        size = np.exp(self.unit_deviation * rng.standard_normal((count, 1, 1, 1)))
        places = self.origin + size * (self.positions - self.origin + off)
        feet = self.feet(places, rng)
        # Of a longer lens, people are as much further away, and so are the ways towards the camera.
        ways = self.positions[:, [_M["pelvis"]]] - self.origin
        away = np.nanmean(ways, axis=(0, 1)) / np.linalg.norm(np.nanmean(ways, axis=(0, 1)))
        further = size * np.expm1(self.focal_deviation * rng.standard_normal((count, 1, 1, 1)))
        further = further * (ways @ away)[..., None] * away
        return places + further, None if feet is None else feet + further

    def feet(self, places: np.ndarray, rng: np.random.Generator | None = None) -> np.ndarray | None:
        """Heels and toes (..., frames, 4, 3) [m] of motions `places` (..., frames, 15, 3), or None without their rays.

        See `motionenv.lifting.free.feet.lift_feet`, also for `rng`.
        """
        return None if self.foot_rays is None else lift_feet(places, self.foot_rays, rng)

    @property
    def misfit(self) -> float:
        """Mean surprise, relative to `SURPRISE`."""
        return float(np.nanmean(self.surprise) / SURPRISE)

    @property
    def plausible(self) -> bool:
        """Whether 90 % of the frames or more show somebody who walks, turns or runs, of a size that people have."""
        alike = float((self.surprise[np.isfinite(self.surprise)] <= SURPRISE).mean()) >= MOSTLY
        return alike and bool(_SIZES[0] < np.log(self.unit / BODY_UNIT) < _SIZES[1])


def undetermined(seen: np.ndarray, fps: float) -> np.ndarray:
    """Which markers (frames, 15) aren't determined: the network supposes them, and is surer than it should be.

    These are those that aren't `seen` (frames, 15) for a second before and after, and all of them where not even one
    leg is. Bands would cover 57 % of upper bodies that are never seen, and without knees and ankles 49 % of the rest
    (`motionenv bench free_walking.parts`).
    """
    lately = ndimage.maximum_filter1d(seen, 2 * round(_RECENTLY * fps) + 1, axis=0, mode="constant")
    legs = [lately[:, [_M[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle")]] for side in ("left", "right")]
    return ~lately | ~np.any([leg.all(axis=1) for leg in legs], axis=0)[:, None]


def heading_of(positions: np.ndarray, fps: float) -> np.ndarray:
    """Direction in which a body faces, (frames,) [rad] from x towards y.

    Args:
        positions: (frames, 15, 3) of the markers, of which hips and shoulders tell.
        fps: frame rate [Hz].
    """
    across = sum(
        positions[:, _M[f"left_{name}"], :2] - positions[:, _M[f"right_{name}"], :2] for name in ("hip", "shoulder")
    )
    smooth_ = ndimage.gaussian_filter1d(across, _HEADING * fps, axis=0, mode="nearest")
    heading = np.arctan2(-smooth_[:, 0], smooth_[:, 1])
    known = np.isfinite(heading)
    heading[known] = np.unwrap(heading[known])
    return heading


def limb_lengths(positions: np.ndarray) -> dict[str, float]:
    """Limb lengths [m], the median over time and the mean of both sides, of `positions` (frames, 15, 3)."""
    out: dict[str, list[float]] = {}
    for a, b in EDGES:
        name = f"{MARKERS[a]} to {MARKERS[b]}".replace("left_", "").replace("right_", "")
        length = np.nanmedian(np.linalg.norm(positions[:, a] - positions[:, b], axis=-1))
        out.setdefault(name, []).append(float(length))
    return {name: float(np.mean(lengths)) for name, lengths in out.items()}


def fit_freely(
    points: Points, camera: Camera | Sequence[Camera] | np.ndarray | None = None, *,
    distortion: Sequence[float] | None = None, elevation: float | None = 0.0, height: float | None = None,
    distance: float | None = None, network: PostureNetwork | None = None, settings: Settings = DEFAULTS,
    on_progress: Callable[[float], None] | None = None,
) -> FreeFit:  # fmt: skip
    """Fit somebody's motion to `points` in pixels.

    Args:
        points: one person, in pixels.
        camera, distortion, elevation, height, on_progress: as in `motionenv.lift`.
        distance: mean distance [m] of the person from the camera, if it is known.
        network: another one than the shipped one.
        settings: weights of the terms.

    Raises:
        GapError: never four markers at once.
        MotionError: cameras or coefficients that don't fit, see `rays.rays_of`.
    """
    network = network or shipped_network()
    with _libraries().limit(limits=1, user_api="blas"):  # threads would only wait for each other over small matrices
        if elevation is None and (camera is None or isinstance(camera, np.ndarray)):
            elevation = _elevation(network, points, camera, distortion)
        fit = _fit(network, points, camera, distortion, elevation or 0.0, height, distance, settings, on_progress)
        labelled = swapped_back(points, fit.swapped)
        return replace(fit, shape=picture_shape(network, labelled, camera, distortion, elevation or 0.0))


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def _fit(
    network, points: Points, camera, distortion, elevation: float, height, distance, settings: Settings, on_progress
) -> FreeFit:
    """The fit as labelled, or as labels are continuous: the motion decides; and as `other` the mirror image, if likely.

    Labels are never overruled.
    """
    labels = continuous_labels(points)
    starts = [np.zeros_like(labels), labels] if labels.any() else [labels]
    doubt = partial(_doubt, network, camera=camera, distortion=distortion, elevation=elevation)

    def attempt(start: np.ndarray, **asked) -> FreeFit:
        fit = fit_labelled(
            network, swapped_back(points, start), camera, distortion=distortion, elevation=elevation,
            height=height, distance=distance, settings=settings, **asked,
        )  # fmt: skip
        return replace(fit, swapped=fit.swapped ^ start)

    tell = on_progress or (lambda share: None)
    fits = [attempt(start, tell=lambda share, before=number: tell((before + share) / len(starts)))
            for number, start in enumerate(starts)]  # fmt: skip
    best = min(fits, key=lambda fit: fit.misfit)
    if doubt(swapped_back(points, ~best.swapped)) > doubt(swapped_back(points, best.swapped)) + _SURER:
        return best
    mirrored = attempt(~best.swapped, swaps=False)
    probability = float(expit(_EVIDENCE * np.log(best.misfit / mirrored.misfit) + logit(_EXCHANGED)))
    return replace(best, other=OtherMotion(mirrored.positions, probability)) if probability >= _LIKELY else best


def fit_labelled(
    network: PostureNetwork, points: Points, camera: Any, *, distortion: Sequence[float] | None = None,
    elevation: float = 0.0, height: float | None = None, distance: float | None = None, settings: Settings = DEFAULTS,
    swaps: bool = True, tell: Callable[[float], None] = lambda share: None,
) -> FreeFit:  # fmt: skip
    """Fit all stretches, and find the size of everything; a camera that moves does so in metres, so once more then.

    Arguments are those of `fit_freely`, with a known elevation; `swaps` says whether sides may have been exchanged in
    some frames, and `tell` is called with the share that is done.
    """
    seen = points.positions if points.feet is None else np.concatenate([points.positions, points.feet], axis=1)
    rays = rays_of(seen, camera, distortion, elevation)
    feet = rays.directions[:, len(MARKERS) :]
    rays = replace(rays, directions=rays.directions[:, : len(MARKERS)])
    detected = points.confidence is not None
    if detected:
        settings = replace(
            settings, least_ray=settings.detector_ray, tail=settings.detector_tail, posture=settings.detector_posture
        )
    sections = _sections(rays.directions, points)
    unit, passes = BODY_UNIT, 2 if np.ptp(rays.origins, axis=0).any() else 1
    for again in range(passes):
        fits = []
        for part in sections:
            fits.append(_fitted(network, rays, points, part, settings, unit, swaps))
            tell((again + len(fits) / len(sections)) / passes)
        size = partial(_unit, rays=rays, stature=height, distance=distance)
        units = np.array([size(one.fit, part=part) for one, part in zip(fits, sections, strict=True)])
        precision = 1 / units[:, 1] ** 2
        unit = float(np.exp((precision * np.log(units[:, 0])).sum() / precision.sum()))
    joined = replace(_joined(fits, sections, rays, unit, float(units[:, 1].min())), height=height)
    if points.feet is not None:  # exchanged as the legs are
        feet = np.where(joined.swapped[:, 1, None, None], feet[:, [2, 3, 0, 1]], feet)
        noise = _FOOT_DETECTED if detected else joined.noise
        joined = replace(joined, foot_rays=FootRays(feet, rays.origins, noise))
    return replace(joined, deviations=np.hypot(joined.deviations, _DETECTED), bias=_DETECTED) if detected else joined


def _elevation(network: PostureNetwork, points: Points, camera, distortion) -> float:
    """Angle [rad] by which a camera looks down: that at which the network is most certain of the postures that it sees.

    On 18 sequences of people left out it errs by 3 degrees in the median (5 of them by more than 8).
    """
    doubts = [_doubt(network, points, camera, distortion, angle) for angle in _ELEVATIONS]
    best = int(np.clip(np.argmin(doubts), 1, len(doubts) - 2))
    before, here, after = doubts[best - 1 : best + 2]
    curvature = before - 2 * here + after
    shift = np.clip(0.5 * (before - after) / curvature, -1, 1) if curvature > 0 else 0.0
    return float(_ELEVATIONS[best] + shift * (_ELEVATIONS[1] - _ELEVATIONS[0]))


def _doubt(network: PostureNetwork, points: Points, camera, distortion, elevation: float) -> float:
    """Mean logarithm of the network's deviations for the first postures that it sees."""
    directions = rays_of(points.positions, camera, distortion, elevation).directions
    stride = max(1, round(points.fps / RATE))
    shown = directions[_sections(directions, points)[0]][: _LOOKED * stride : stride]
    return float(np.log(propose(network, shown, points.fps / stride).spread).mean())


def picture_shape(
    network: PostureNetwork, points: Points, camera: Camera | Sequence[Camera] | np.ndarray | None,
    distortion: Sequence[float] | None, elevation: float,
) -> int:  # fmt: skip
    """`FreeFit.shape`, by the network's doubt of `points` and of wider and narrower ones; 0 of less than a second."""
    doubt = partial(_doubt, network, camera=camera, distortion=distortion, elevation=elevation)
    middle, given = np.nanmean(points.positions, axis=(0, 1)) * [1, 0], doubt(points)
    for shape, (ratio, least) in ((1, _MADE_WIDER), (-1, _MADE_NARROWER)):
        other = doubt(replace(points, positions=middle + (points.positions - middle) * [ratio, 1]))
        if other < min(given - least, _SURE) and len(points.positions) >= points.fps:
            return shape
    return 0


def _sections(directions: np.ndarray, points: Points) -> list[slice]:
    """Overlapping stretches of the `points` and their rays (frames, 15, 3), interrupted where nobody is seen."""
    fps = points.fps
    shown = np.flatnonzero(np.isfinite(directions[..., 0]).sum(axis=1) >= _SHOWN)
    length, overlap = round(_STRETCH * fps), round(_OVERLAP * fps)
    sections = []
    for run in np.split(shown, np.flatnonzero(np.diff(shown) > _ABSENT * fps) + 1):
        if len(run) < _LEAST:
            continue
        first, end = int(run[0]), int(run[-1]) + 1
        starts = range(first, max(end - overlap, first + 1), length - overlap)
        sections += [slice(start, min(start + length, end)) for start in starts]
    if not sections:
        raise GapError(f"{points.name or 'this sequence'} never shows four markers at once for five frames")
    return sections


def _fitted(network, rays: Rays, points: Points, part: slice, settings: Settings, unit: float, swaps: bool):
    """The fit of one stretch, a `_Stretch`, with left and right as they should be, or as they are if not `swaps`."""
    directions = rays.directions[part]
    precision = _precision(points.confidence, np.isfinite(directions[..., 0]), part)
    origins = (rays.origins[part] - rays.origins[part].mean(axis=0)) / unit
    swapped = np.zeros((len(directions), 2), dtype=bool)
    for _ in range(3):
        proposal = propose(network, directions, points.fps)
        fit = smooth(directions, origins, precision, proposal.posture, proposal.spread, points.fps, settings)
        if not swaps:
            break
        found = find_swaps(directions, fit.places - origins[:, None], fit.noise)
        if not found.any():
            break
        swapped ^= found
        directions, precision = exchanged(directions, found), exchanged(precision, found)
    seen = np.isfinite(directions)
    if not seen.all():  # the network sees more once the fit fills the gaps, but it is no surer than it was
        ways = fit.places - origins[:, None]
        filled = np.where(seen, directions, ways / np.linalg.norm(ways, axis=-1, keepdims=True))
        proposal = replace(proposal, posture=propose(network, filled, points.fps).posture)
        fit = smooth(directions, origins, precision, proposal.posture, proposal.spread, points.fps, settings)
    return _Stretch(fit, swapped, _surprise(fit, proposal, points.fps))


def _precision(confidence: np.ndarray | None, seen: np.ndarray, part: slice) -> np.ndarray:
    """Relative precision (frames, 15) of the rays: a detector's errors by joint, inverse to its confidence."""
    if confidence is None:
        return np.ones(seen.shape)
    given = np.where(seen, np.nan_to_num(confidence[part]), 0.0)
    usual = float(np.median(given[seen])) if seen.any() else 1.0
    return (np.maximum(given / max(usual, 1e-6), _LEAST_CONFIDENCE) * np.median(_SPREAD) / _SPREAD) ** 2


@dataclass(frozen=True)
class _Stretch:
    """The fit of one stretch, where left and right were exchanged (frames, 2), and the surprise (frames,)."""

    fit: Fit
    swapped: np.ndarray
    surprise: np.ndarray


def _surprise(fit: Fit, proposal: Proposal, fps: float) -> np.ndarray:
    """The network's uncertainty times its distance from what the rays show, averaged over a second."""
    others = np.arange(len(MARKERS)) != _M["pelvis"]
    off = (fit.places - fit.places[:, [_M["pelvis"]]] - proposal.posture)[:, others] / proposal.spread[:, others, None]
    each = proposal.spread[:, others].mean(axis=1) * (1 + np.sqrt((off**2).mean(axis=(1, 2))))
    return ndimage.uniform_filter1d(each, max(1, min(round(fps), len(each))), mode="nearest")


def _unit(fit: Fit, rays: Rays, part: slice, stature: float | None, distance: float | None) -> tuple[float, float]:
    """The body unit [m] and the deviation of its logarithm: by the distance, or the floor and stature, or people's."""
    away = float(np.linalg.norm(fit.places[:, _M["pelvis"]], axis=-1).mean())
    if distance is not None:
        return distance / away, _SEEN_DEVIATION
    known = np.log(BODY_UNIT * (stature or _STATURE) / _STATURE)
    guesses = [(known, _PROPORTIONS_DEVIATION if stature else _STATURE_DEVIATION)]
    height = rays.origins[part, 2].mean()
    below = _ANKLE / BODY_UNIT - fit.floor
    feet = fit.weights[:, [_M["left_ankle"], _M["right_ankle"]]].any()  # the floor is under those that are seen
    if rays.posed and height > 0 and below > 0 and feet:
        of_floor = np.dot(_FLOOR_DEVIATION, [1, fit.noise, (fit.places[:, _M["pelvis"], 2].mean() / away) ** 2])
        guesses.append((np.log(height / below), np.hypot(_ANKLE_DEVIATION / height, of_floor)))
    precision = np.array([1 / deviation**2 for _, deviation in guesses])
    mean = precision @ [value for value, _ in guesses] / precision.sum()
    return float(np.exp(mean)), float(precision.sum() ** -0.5)


def _joined(stretches: list[_Stretch], sections, rays: Rays, unit: float, unit_deviation: float) -> FreeFit:
    """All stretches in metres, blended where they overlap."""
    frames = len(rays.directions)
    count = len(MARKERS)
    total: dict = {"positions": np.zeros((frames, count, 3)), "deviations": np.zeros((frames, count, 3)),
             "contact": np.zeros((frames, 2)), "weights": np.zeros((frames, count)),
             "surprise": np.zeros(frames)}  # fmt: skip
    share, swapped = np.zeros(frames), np.zeros((frames, 2), dtype=bool)
    for stretch, part in zip(stretches, sections, strict=True):
        fit, length = stretch.fit, part.stop - part.start
        ends = _ends(length)
        values = {"positions": fit.places * unit + rays.origins[part].mean(axis=0),
                  "deviations": fit.deviations * unit, "contact": fit.contact, "weights": fit.weights,
                  "surprise": stretch.surprise}  # fmt: skip
        for name, value in values.items():
            total[name][part] += value * ends.reshape(-1, *[1] * (value.ndim - 1))
        share[part] += ends
        swapped[part] = stretch.swapped
    share[share == 0] = np.nan  # nobody is there
    for value in total.values():
        value /= share.reshape(-1, *[1] * (value.ndim - 1))
    about = total["positions"] - total["positions"][:, [_M["pelvis"]]]
    total["deviations"] = np.hypot(total["deviations"], unit_deviation * about)
    noise = unit * float(np.mean([stretch.fit.noise for stretch in stretches]))
    return FreeFit(
        **total, swapped=swapped, unit=unit, unit_deviation=unit_deviation, noise=noise,
        origin=rays.origins.mean(axis=0), focal=rays.focal, posed=rays.posed, focal_deviation=rays.focal_deviation,
        _stretches=tuple((stretch.fit, part) for stretch, part in zip(stretches, sections, strict=True)),
    )  # fmt: skip


def _ends(length: int) -> np.ndarray:
    """Weights (length,) of a stretch's frames where stretches overlap: they fall towards both ends."""
    return np.minimum(np.arange(length), np.arange(length)[::-1]) + 1.0
