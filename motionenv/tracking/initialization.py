"""Automatic initialisation: find the first pose of a track by annealed particle search over the first images.

Hypotheses are walkers of the functional model (Ormoneit et al. 2005, section 5, set the first pose by hand): a gait
from a bank, at any phase and heading. Each supposes which part of the body the foreground of the first image shows: all
of it, or what an occluder or the picture's edge leaves. It is placed on the ground so that the height and centre of its
outline match that, and then walks through all images. The likelihood of the images, tempered so that a fixed fraction
of hypotheses is effective, resamples them; noise that decreases from round to round perturbs them (Deutscher & Reid
2005). The remaining hypotheses are the candidates. If left and right are ambiguous, both remain.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from motionenv._core.validation import checked_fps, checked_whole, random_generator
from motionenv.body import limb_segments
from motionenv.errors import MotionError
from motionenv.likelihoods.base import ImageLikelihood, apparent, log_nobody
from motionenv.models.paths.bending import TURN_RATE
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkingModel
from motionenv.tracking.priors.base import Start, systematic, tempered
from motionenv.types import Camera, Skeleton

_GAITS = 48  # walkers in the bank
_BANK_FPS = 60.0
_SPARE = 3.0  # [s] extra length of the gaits, so that the first image can have any phase
_MOST_PICTURES = 8  # most images that are scored, equally spaced
_LARGE = 0.15  # least area of a foreground component, relative to the largest, that counts as part of the body
_EDGE = 0.7  # [pixels] standard deviation of a box's edges; of somebody small in the picture it moves the start far
_HIDDEN = 0.4  # share of the hypotheses of which something hides a part
_LEAST_SEEN = 0.25  # of a body's height, where something hides its head or its feet
_NARROW = 0.2  # [body heights] farthest that the body's centre is beside that of what is seen of it
_EXTREME = 5.0  # standard deviations of the largest and the smallest body
_BEYOND = 5.0  # pictures' sizes beyond which nobody's outline is followed
_DISTANT = 0.03  # standard deviation of the log of a candidate's distance
_SETTLED = 5  # iterations that place a walker at the outline
_STEP = 0.25  # largest step of one iteration, relative to the distance from the camera
_NEAREST = 1.0  # [m] least distance from the camera
_ROUNDS = 7
_COOLING = 0.7  # factor on the noise from round to round
_UNSEEN = 0.02  # probability that somebody isn't seen at all in a picture
_KEPT = 0.02  # effective fraction of the hypotheses
_OTHER_GAIT = 0.3  # probability of switching the gait in each round
_EXCHANGED = 0.1  # probability of swapping left and right, and of reflecting in depth
# Standard deviations of the first round's noise: time [s], heading [rad], forward and sideways position [m].
_MOMENT, _HEADING, _PLACE = 0.06, 0.25, 0.06
_PACE, _PACES = 0.2, (0.6, 2.0)  # standard deviation of the log of a gait's pace, and least and greatest pace
# Mean and standard deviation of the log of statures of 6 to 17 years, relative to adults' (`motionenv.models.people`).
_CHILDREN = -0.143, 0.127
#: Log density (n,) of ground positions (n, 2) [m] and body sizes (n,).
Place = Callable[[np.ndarray, np.ndarray], np.ndarray]
#: Standard deviations (25,) of a candidate's pose: positions [m], then angles [rad].
SPREAD = np.concatenate([np.full(3, 0.03), [0.05, 0.05, 0.12], np.full(19, 0.08)])


@dataclass(frozen=True, eq=False)
class _Hypotheses:
    """N hypotheses: at the start, gait index, time in the gait [s], heading [rad] and ground position (N, 2) [m].

    Body size is relative to the likelihood's, pace relative to the gait's, and the turning rate is in rad/s.
    """

    gait: np.ndarray
    moment: np.ndarray
    heading: np.ndarray
    place: np.ndarray
    size: np.ndarray
    pace: np.ndarray
    turn: np.ndarray

    def take(self, which: np.ndarray) -> "_Hypotheses":
        return _Hypotheses(*(getattr(self, f.name)[which] for f in fields(self)))


@dataclass(frozen=True, eq=False)
class _Bank:
    """Gaits (gaits, frames, 25) that start at the origin along x, and their cycle durations (gaits,) [s]."""

    poses: np.ndarray
    cycles: np.ndarray


def automatic_start(
    likelihood: ImageLikelihood, observations: Sequence[Mapping[str, Any]], *, fps: float = 30.0, n: int = 10_000,
    candidates: int = 256, model: WalkingModel | str = "walk/fpca", size: float = 0.0, children: float = 0.0,
    place: Place | None = None, seed: int | np.random.Generator | None = None,
) -> Start:  # fmt: skip
    """Estimate candidates for the first pose from the first images.

    Args:
        likelihood: observation model that knows the camera and the body, such as a `SilhouetteLikelihood`. It is
            copied: repeated observations must not update its background model.
        observations: arguments of its `observe`, one per frame from the first; about ten determine heading and phase.
        fps: frame rate of the observations [Hz].
        n: number of hypotheses, at least 100.
        candidates: number of poses to return, equally weighted; likelier poses are repeated.
        model: `WalkingModel` of the hypotheses, or its name or path.
        size: standard deviation of the log of the body's size relative to the likelihood's skeleton; 0 if it is known.
        children: share of children of 6 to 17 years among people; the others' sizes are about 1, with deviation `size`.
        place: log density (n,), up to a constant, of ground positions (n, 2) [m] in the first image and sizes (n,), as
            a factor of the prior; None is uniform.
        seed: int or Generator.

    Returns:
        Candidate poses of the first frame, each with the pose one frame earlier and the body's height.

    Raises:
        MotionError: no observations, no foreground in the first image, or an argument out of range.
    """
    observations = list(observations)
    if not observations:
        raise MotionError("automatic_start needs at least one observation; about ten are better")
    n, candidates = checked_whole(n, "n", 100), checked_whole(candidates, "candidates", 1)
    fps, rng = checked_fps(fps), random_generator(seed)
    chosen = np.unique(np.linspace(0, len(observations) - 1, _MOST_PICTURES).round().astype(int))
    pictures = [(i / fps, seen) for i, seen in enumerate(_observed(likelihood, observations)) if i in chosen]
    boxes = bounding_boxes(pictures[0][1].foreground)
    bank = _build_bank(model, likelihood.skeleton, len(observations) / fps, rng)
    boxes = boxes[rng.integers(len(boxes), size=n)] + _EDGE * rng.standard_normal((n, 4))
    boxes = _whole_bodies(boxes, likelihood.camera, rng)
    walkers = _random_hypotheses(bank, likelihood, boxes, size, children, rng)
    for i in range(_ROUNDS):
        scores = _scores(bank, walkers, pictures[:: max(1, len(pictures) >> i)], size, children, place)
        drawn = walkers.take(systematic(tempered(scores, _KEPT * n), n, rng))
        walkers = _perturbed(bank, drawn, likelihood.camera, _COOLING**i, size, rng)
    scores = _scores(bank, walkers, pictures, size, children, place)
    best = walkers.take(systematic(tempered(scores, max(2.0, 0.5 * _KEPT * n)), candidates, rng))
    centre = likelihood.camera.centre[:2]
    farther = np.exp(_DISTANT * rng.standard_normal(candidates))[:, None]
    best = replace(best, place=centre + farther * (best.place - centre))
    poses = _poses(bank, best, 0.0)
    heights = likelihood.skeleton.height * best.size
    return Start(poses, np.zeros(len(poses)), _poses(bank, best, -1 / fps), SPREAD, heights)


def bounding_boxes(foreground: np.ndarray) -> np.ndarray:
    """First and last column, first and last row (m, 4) of the large components of `foreground` together, and of each.

    Together they are a body that an occluder parts; one of them is the body where others move too. `foreground`
    (height, width) are probabilities; without any, raises MotionError.
    """
    from scipy.ndimage import find_objects, label

    parts, count = label(foreground > 0.5, structure=np.ones((3, 3)))
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    if not count or sizes.max() < 8:
        raise MotionError("the first image has no foreground: start with a frame that shows the person")
    large = [s for s, k in zip(find_objects(parts), sizes, strict=True) if k > _LARGE * sizes.max()]
    each = np.array([(c.start, c.stop - 1, r.start, r.stop - 1) for r, c in large], dtype=np.float64)
    low, high = each.min(axis=0), each.max(axis=0)
    return np.vstack([[low[0], high[1], low[2], high[3]], each])[: None if len(each) > 1 else 1]


def _whole_bodies(boxes: np.ndarray, camera: Camera, rng: np.random.Generator) -> np.ndarray:
    """Boxes (n, 4) of whole bodies of which those of `boxes` (n, 4) are visible, with parts that are hidden at random.

    Whoever touches the picture's edge goes on beyond it; of others, something may hide the head, the feet or a side.
    """
    n, edges = len(boxes), np.array([0.5, camera.width - 1.5, 0.5, camera.height - 1.5])
    outside = np.where([True, False, True, False], boxes <= edges, boxes >= edges)
    hidden = rng.random(n) < _HIDDEN
    cut = outside | (hidden[:, None] & (rng.integers(4, size=n)[:, None] == np.arange(4)))
    more = (boxes[:, 3] - boxes[:, 2] + 1) * (1 / rng.uniform(_LEAST_SEEN, 1.0, n) - 1) * cut[:, 2:].any(axis=1)
    below = np.where(cut[:, 2:].all(axis=1), rng.random(n), cut[:, 3])  # share of what is hidden
    whole = boxes + np.stack([0 * more, 0 * more, -(1 - below) * more, below * more], axis=1)
    beside = _NARROW * (whole[:, 3] - whole[:, 2]) * rng.random(n)
    whole[:, :2] += ((cut[:, 1] * 1.0 - cut[:, 0]) * beside)[:, None]
    return whole


def _build_bank(model: WalkingModel | str, skeleton: Skeleton, seconds: float, rng: np.random.Generator) -> _Bank:
    """Gaits of random walkers with the body of a `skeleton`, for `seconds` of images."""
    walking = load(model) if isinstance(model, str) else model
    if not isinstance(walking, WalkingModel):
        raise MotionError(f"model must be a WalkingModel such as walk/fpca, got {type(walking).__name__}")
    strides = walking.sample(_GAITS, seed=rng)
    walks = walking.walks(
        _PACES[1] * seconds + _SPARE, _BANK_FPS, n=_GAITS, stride=strides, seed=rng, variation=0.0,
        skeleton=skeleton,
    )  # fmt: skip
    return _Bank(np.asarray(walks.poses), strides.seconds)


def _random_hypotheses(
    bank: _Bank, likelihood: ImageLikelihood, boxes: np.ndarray, size: float, children: float, rng: np.random.Generator
) -> _Hypotheses:
    """Hypotheses with random gait, phase and heading, placed to match their bounding boxes (n, 4)."""
    n = len(boxes)
    moment = 0.1 + rng.random(n) * (_SPARE - 1.0)
    heading = 2 * np.pi * (np.arange(n) + rng.random(n)) / n
    gait, sizes = rng.integers(len(bank.cycles), size=n), np.ones(n)
    if size:
        mean, wide = np.where(rng.random((n, 1)) < children, _CHILDREN, (0.0, size)).T
        drawn = np.exp(mean + wide * rng.standard_normal(n))
        sizes = np.where(rng.random(n) < 0.5, drawn, _sizes(likelihood, boxes))
        sizes = np.clip(sizes, *np.exp(_EXTREME * max(size, _CHILDREN[1] * (children > 0)) * np.array([-1, 1])))
    pace, turn = np.exp(_PACE * rng.standard_normal(n)) / np.sqrt(sizes), TURN_RATE * rng.standard_normal(n)
    walkers = _Hypotheses(gait, moment, heading, np.zeros((n, 2)), sizes, pace, turn)
    camera = likelihood.camera
    place = _initial_positions(camera, likelihood.skeleton, boxes)
    for _ in range(_SETTLED):
        walkers = replace(walkers, place=place)
        seen = apparent(_poses(bank, walkers, 0.0), sizes, camera)
        place = place + sizes[:, None] * _placement_shift(camera, limb_segments(seen, likelihood.skeleton), boxes)
    away = (place - camera.centre[:2]) @ _horizontal_unit(camera.R[2, :2])
    return replace(walkers, place=place + np.maximum(_NEAREST - away, 0.0)[:, None] * _horizontal_unit(camera.R[2, :2]))


def _sizes(likelihood: ImageLikelihood, boxes: np.ndarray) -> np.ndarray:
    """Body sizes (n,) of who fills boxes with his feet on the ground; infinite for feet above the horizon."""
    camera = likelihood.camera
    feet = np.stack([boxes[:, :2].mean(axis=1), boxes[:, 3] + 0.5, np.ones(len(boxes))])
    down = -np.linalg.solve(camera.K, feet).T @ camera.R[:, 2]
    depth = np.where(down > 0, camera.centre[2] / np.maximum(down, 1e-9), np.inf)
    return (boxes[:, 3] - boxes[:, 2] + 1) * depth / (abs(camera.K[1, 1]) * likelihood.skeleton.height)


def _initial_positions(camera: Camera, skeleton: Skeleton, boxes: np.ndarray) -> np.ndarray:
    """Positions (n, 2) on the rays through the boxes' centres at which a standing body has a box's height."""
    pixels = np.stack([boxes[:, :2].mean(axis=1), boxes[:, 2:].mean(axis=1), np.ones(len(boxes))])
    focal = np.sqrt(abs(np.linalg.det(camera.K[:2, :2])))
    depth = focal * skeleton.height / np.maximum(boxes[:, 3] - boxes[:, 2] + 1, 1.0)
    return ((depth * np.linalg.solve(camera.K, pixels)).T - camera.t) @ camera.R[:, :2]


def _placement_shift(camera: Camera, ends: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Ground shift (n, 2) [m] that moves limbs with end points (n, limbs, 2, 3) towards filling their boxes."""
    box = boxes.T
    pixels, depth = camera.project(ends.reshape(len(ends), -1, 3))
    sides = np.array([camera.width, camera.height])
    low, high = (np.clip(ends, -_BEYOND * sides, _BEYOND * sides) for ends in (pixels.min(axis=1), pixels.max(axis=1)))
    far = np.maximum(depth.mean(axis=1), _NEAREST)
    aside = (box[:2].mean(axis=0) - 0.5 * (low[:, 0] + high[:, 0])) * far / abs(camera.K[0, 0])
    # Moving away shrinks the outline and, if the camera looks down, moves it up: least squares of both.
    down, focal = -camera.R[2, 2], abs(camera.K[1, 1])
    tall = high[:, 1] - low[:, 1] + 1
    grows, moves = -tall * np.sqrt(1 - down**2) / far, -focal * down / far
    missing, above = box[3] - box[2] + 1 - tall, 0.5 * (box[2] + box[3] - low[:, 1] - high[:, 1])
    deeper = (grows * missing + moves * above) / (grows**2 + moves**2)
    deeper = np.clip(deeper, -_STEP * far, _STEP * far)
    return aside[:, None] * _horizontal_unit(camera.R[0, :2]) + deeper[:, None] * _horizontal_unit(camera.R[2, :2])


def _horizontal_unit(direction: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(direction))
    return direction / length if length > 1e-6 else direction


def _poses(bank: _Bank, walkers: _Hypotheses, seconds: float) -> np.ndarray:
    """Poses (n, 25) of the hypotheses `seconds` after the first image."""
    at = np.clip((walkers.moment + seconds * walkers.pace) * _BANK_FPS, 0, bank.poses.shape[1] - 1.001)
    began = bank.poses[walkers.gait, np.floor(walkers.moment * _BANK_FPS).astype(int), :2]
    first = at.astype(int)
    share = (at - first)[:, None]
    poses = (1 - share) * bank.poses[walkers.gait, first] + share * bank.poses[walkers.gait, first + 1]
    x, y = (walkers.size[:, None] * (poses[:, :2] - began)).T
    poses[:, 2] *= walkers.size
    half = 0.5 * seconds * walkers.turn  # the chord of an arc lies halfway between its directions
    x, y = x * np.sinc(half / np.pi), y * np.sinc(half / np.pi)
    c, s = np.cos(walkers.heading + half), np.sin(walkers.heading + half)
    poses[:, 0], poses[:, 1] = walkers.place[:, 0] + c * x - s * y, walkers.place[:, 1] + s * x + c * y
    poses[:, 5] += walkers.heading + 2 * half
    return poses


def _observed(likelihood: ImageLikelihood, observations: Sequence[Mapping[str, Any]]) -> Iterator[ImageLikelihood]:
    seeing = deepcopy(likelihood)
    if len(observations) > 1:
        seeing.forget()  # what was learned beside a wrong body
        for observation in observations:
            seeing.observe(**observation)
    for observation in observations:
        seeing.observe(**observation)
        yield deepcopy(seeing)


def _scores(
    bank: _Bank, walkers: _Hypotheses, pictures: Sequence[tuple[float, ImageLikelihood]], size: float, children: float,
    place: Place | None,
) -> np.ndarray:  # fmt: skip
    """Log posterior (n,) given images, as (seconds after the first, likelihood that has observed it), and priors."""
    total = -0.5 * (walkers.turn / TURN_RATE) ** 2
    total += _log_sizes(np.log(walkers.size), size, children) if size else 0.0
    total += place(walkers.place, walkers.size) if place else 0.0
    for seconds, likelihood in pictures:
        seen = _poses(bank, walkers, seconds)
        seen = apparent(seen, walkers.size, likelihood.camera) if size else seen
        there = np.nan_to_num(likelihood.log_likelihood(seen), nan=-1e9, neginf=-1e9)
        total += np.logaddexp(there, np.log(_UNSEEN) + log_nobody(likelihood, seen[0]))
    return total


def _log_sizes(logs: np.ndarray, size: float, children: float) -> np.ndarray:
    """Log density (n,), up to a constant, of logs of body sizes (n,)."""
    adults, (mean, wide) = -0.5 * (logs / size) ** 2, _CHILDREN
    young = -0.5 * ((logs - mean) / wide) ** 2 + np.log(size / wide)
    return np.logaddexp(adults + np.log(1 - children), young + np.log(children)) if children else adults


def _perturbed(
    bank: _Bank, walkers: _Hypotheses, camera: Camera, share: float, size: float, rng: np.random.Generator
) -> _Hypotheses:
    """Hypotheses with `share` of the first round's noise; some jump to ambiguous alternatives."""
    n = len(walkers.moment)
    gait = np.where(rng.random(n) < _OTHER_GAIT, rng.integers(len(bank.cycles), size=n), walkers.gait)
    what = rng.random(n)
    half = np.where(what < 2 * _EXCHANGED, 0.5 * bank.cycles[gait], 0.0)
    moment = walkers.moment + half + share * _MOMENT * rng.standard_normal(n)
    moment = np.where(moment > _SPARE - 0.5, moment - bank.cycles[gait], moment)
    across = np.arctan2(camera.R[0, 1], camera.R[0, 0])
    heading = np.where(what < _EXCHANGED, 2 * across - walkers.heading, walkers.heading)
    heading += share * _HEADING * rng.standard_normal(n)
    place = walkers.place + share * _PLACE * rng.standard_normal((n, 2))
    grown = np.exp(share * 0.5 * size * rng.standard_normal(n)) if size else np.ones(n)
    place = camera.centre[:2] + grown[:, None] * (place - camera.centre[:2])  # looks as tall as before
    pace = np.clip(walkers.pace * np.exp(0.5 * share * _PACE * rng.standard_normal(n)), *_PACES)
    turn = np.where(what < _EXCHANGED, -walkers.turn, walkers.turn) + 0.5 * share * TURN_RATE * rng.standard_normal(n)
    return _Hypotheses(gait, np.clip(moment, 0.05, _SPARE - 0.5), heading, place, grown * walkers.size, pace, turn)
