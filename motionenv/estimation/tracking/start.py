"""Where a track begins, found from the first pictures alone: a wide search over walkers, phases, headings and places.

Hypotheses are walkers of the functional model (Ormoneit et al. 2005, section 5, gives the first pose by hand): one of
a bank of gaits, at any moment of its cycle, heading anywhere. Each is put on the ground where its outline has the
height and the middle of what the first picture shows, and walks on through all pictures; the likelihood of these,
flattened so that a share of the hypotheses counts, says which are drawn again and moved by less and less: an annealed
particle search (Deutscher & Reid 2005). Those that are left are the candidates: both of them where left and right can't
be told apart.
"""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from motionenv.body import limb_segments
from motionenv.errors import MotionError
from motionenv.estimation.likelihood import Looking
from motionenv.estimation.numeric import checked_whole
from motionenv.estimation.tracking.priors import Start, systematic
from motionenv.models.store import load
from motionenv.models.walking import WalkingModel
from motionenv.types import Camera, Skeleton, checked_fps

_GAITS = 48  # walkers in the bank
_BANK_FPS = 60.0
_SPARE = 3.0  # [s] by which gaits are longer than the pictures: any moment of a cycle can come first
_MOST_PICTURES = 8  # that are scored, equally spaced
_LARGE = 0.15  # of the largest thing in the picture: what is part of the body too
_SETTLED = 5  # steps that put a walker where his outline is
_STEP = 0.25  # of the distance, that each of them covers at most
_NEAREST = 1.0  # [m] from the camera
_ROUNDS = 7
_COOLING = 0.7  # of the noise, from round to round
_KEPT = 0.02  # share of the hypotheses that counts
_OTHER_GAIT = 0.3  # share that takes another gait in each round
_EXCHANGED = 0.1  # share whose left and right change places, and as many that are reflected in depth
# Standard deviations of the first round's noise: moment [s], heading [rad], ahead and aside [m].
_MOMENT, _HEADING, _PLACE = 0.06, 0.25, 0.06
#: How uncertain the entries of a candidate are: positions [m], then angles [rad].
SPREAD = np.concatenate([np.full(3, 0.03), np.full(3, 0.05), np.full(19, 0.08)])


@dataclass(frozen=True, eq=False)
class _Walkers:
    """N hypotheses: a gait of the bank, the moment in it [s], heading [rad] and place (N, 2) [m] at the start."""

    gait: np.ndarray
    moment: np.ndarray
    heading: np.ndarray
    place: np.ndarray

    def take(self, which: np.ndarray) -> "_Walkers":
        return _Walkers(*(getattr(self, f.name)[which] for f in fields(self)))


@dataclass(frozen=True, eq=False)
class _Bank:
    """Gaits (gaits, frames, 25) from the origin along x, and how long a cycle of each takes (gaits,) [s]."""

    poses: np.ndarray
    cycles: np.ndarray


def automatic_start(
    likelihood: Looking,
    observations: Sequence[Mapping[str, Any]],
    *,
    fps: float = 30.0,
    n: int = 10_000,
    candidates: int = 64,
    model: WalkingModel | str = "walk/fpca",
    seed=None,
) -> Start:
    """Candidates for the first pose, from the first pictures alone.

    Args:
        likelihood: of observations, which knows the camera and the body, such as an `ObservationModel`; it stays as it
            is, for one that learns the background would learn from pictures that it sees again and again.
        observations: what its `observe` takes, one per frame from the first on; about ten tell heading and phase.
        fps: frames per second of the observations.
        n: hypotheses, from 100.
        candidates: how many poses to return; equally likely, the likelier ones come more often.
        model: that makes the hypotheses: a `WalkingModel`, or the name or path of one.
        seed: int or Generator.

    Returns:
        The first frame's poses, each with the pose one frame earlier.

    Raises:
        MotionError: no observations, nobody in the first of them, or numbers out of range.
    """
    observations = list(observations)
    if not observations:
        raise MotionError("automatic_start needs at least one observation; about ten are better")
    n, candidates = checked_whole(n, "n", 100), checked_whole(candidates, "candidates", 1)
    fps, rng = checked_fps(fps), np.random.default_rng(seed)
    chosen = np.unique(np.linspace(0, len(observations) - 1, _MOST_PICTURES).round().astype(int))
    pictures = [(i / fps, seen) for i, seen in enumerate(_each_seen(likelihood, observations)) if i in chosen]
    box = bounding_box(pictures[0][1].foreground)
    bank = _made_bank(model, likelihood.skeleton, len(observations) / fps, rng)
    walkers = _anywhere(bank, likelihood, box, n, rng)
    for i in range(_ROUNDS):
        some = pictures[:: max(1, len(pictures) >> i)]
        drawn = walkers.take(_likely(_scores(bank, walkers, some), _KEPT * n, n, rng))
        walkers = _stirred(bank, drawn, likelihood.camera, _COOLING**i, rng)
    scores = _scores(bank, walkers, pictures)
    best = walkers.take(_likely(scores, max(2.0, 0.5 * _KEPT * n), candidates, rng))
    poses = _poses(bank, best, 0.0)
    return Start(poses, np.zeros(len(poses)), _poses(bank, best, -1 / fps), SPREAD)


def bounding_box(foreground: np.ndarray) -> np.ndarray:
    """First and last column, first and last row (4,) of the largest thing in a picture, and of what is nearly as large.

    Args:
        foreground: (height, width) probabilities.

    Raises:
        MotionError: there is nothing.
    """
    from scipy.ndimage import find_objects, label

    parts, count = label(foreground > 0.5, structure=np.ones((3, 3)))
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    if not count or sizes.max() < 8:
        raise MotionError("the picture shows nobody: no foreground to start from; begin with a frame that shows one")
    large = [s for s, k in zip(find_objects(parts), sizes, strict=True) if k > _LARGE * sizes.max()]
    rows, columns = zip(*large, strict=True)
    return np.array(
        [
            min(c.start for c in columns), max(c.stop for c in columns) - 1,
            min(r.start for r in rows), max(r.stop for r in rows) - 1,
        ],
        dtype=np.float64,
    )  # fmt: skip


def _made_bank(model: WalkingModel | str, skeleton: Skeleton, seconds: float, rng: np.random.Generator) -> _Bank:
    """Gaits of many people with the body's height, for so many seconds of pictures."""
    walking = load(model) if isinstance(model, str) else model
    if not isinstance(walking, WalkingModel):
        raise MotionError(f"automatic_start needs a WalkingModel such as walk/fpca, got {type(walking).__name__}")
    strides = walking.sample(_GAITS, seed=rng)
    walks = walking.synthesize(
        seconds + _SPARE, _BANK_FPS, n=_GAITS, stride=strides, seed=rng, variation=0.0, height=skeleton.height
    )
    return _Bank(np.asarray(walks.poses), strides.seconds)


def _anywhere(bank: _Bank, likelihood: Looking, box: np.ndarray, n: int, rng: np.random.Generator) -> _Walkers:
    """Walkers (n) of any gait, moment and heading, where the outline's box says."""
    moment = 0.1 + rng.random(n) * (_SPARE - 1.0)
    heading = 2 * np.pi * (np.arange(n) + rng.random(n)) / n
    walkers = _Walkers(rng.integers(len(bank.cycles), size=n), moment, heading, np.zeros((n, 2)))
    camera = likelihood.camera
    place = np.broadcast_to(_first_place(camera, likelihood.skeleton, box), (n, 2))
    for _ in range(_SETTLED):
        walkers = replace(walkers, place=place)
        place = place + _towards(camera, limb_segments(_poses(bank, walkers, 0.0), likelihood.skeleton), box)
    away = (place - camera.centre[:2]) @ _level(camera.R[2, :2])
    return replace(walkers, place=place + np.maximum(_NEAREST - away, 0.0)[:, None] * _level(camera.R[2, :2]))


def _first_place(camera: Camera, skeleton: Skeleton, box: np.ndarray) -> np.ndarray:
    """Place (2,) of a standing body whose outline fills the box, on the ray through its middle."""
    pixel = np.array([box[:2].mean(), box[2:].mean(), 1.0])
    focal = np.sqrt(abs(np.linalg.det(camera.K[:2, :2])))
    depth = focal * skeleton.height / max(box[3] - box[2] + 1, 1.0)
    return (camera.R.T @ (depth * np.linalg.solve(camera.K, pixel) - camera.t))[:2]


def _towards(camera: Camera, ends: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Shift (n, 2) [m] on the ground of limbs whose ends are (n, limbs, 2, 3), so that they fill the box."""
    pixels, depth = camera.project(ends.reshape(len(ends), -1, 3))
    sides = np.array([camera.width, camera.height]) - 1.0
    low, high = np.clip(pixels.min(axis=1), 0, sides), np.clip(pixels.max(axis=1), 0, sides)
    far = np.maximum(depth.mean(axis=1), _NEAREST)
    aside = (box[:2].mean() - 0.5 * (low[:, 0] + high[:, 0])) * far / abs(camera.K[0, 0])
    # A step away makes the outline smaller, and where the camera looks down it moves up: least squares of both.
    down, focal = -camera.R[2, 2], abs(camera.K[1, 1])
    tall = high[:, 1] - low[:, 1] + 1
    grows, moves = -tall * np.sqrt(1 - down**2) / far, -focal * down / far
    missing, above = box[3] - box[2] + 1 - tall, 0.5 * (box[2] + box[3] - low[:, 1] - high[:, 1])
    deeper = (grows * missing + moves * above) / (grows**2 + moves**2)
    deeper = np.clip(deeper, -_STEP * far, _STEP * far)
    return aside[:, None] * _level(camera.R[0, :2]) + deeper[:, None] * _level(camera.R[2, :2])


def _level(direction: np.ndarray) -> np.ndarray:
    """A direction (2,) on the ground, of length one where it has any."""
    length = float(np.linalg.norm(direction))
    return direction / length if length > 1e-6 else direction


def _poses(bank: _Bank, walkers: _Walkers, seconds: float) -> np.ndarray:
    """Poses (n, 25) of the walkers `seconds` after the start."""
    at = np.clip((walkers.moment + seconds) * _BANK_FPS, 0, bank.poses.shape[1] - 1.001)
    began = bank.poses[walkers.gait, np.floor(walkers.moment * _BANK_FPS).astype(int), :2]
    first = at.astype(int)
    share = (at - first)[:, None]
    poses = (1 - share) * bank.poses[walkers.gait, first] + share * bank.poses[walkers.gait, first + 1]
    x, y = (poses[:, :2] - began).T
    c, s = np.cos(walkers.heading), np.sin(walkers.heading)
    poses[:, 0], poses[:, 1] = walkers.place[:, 0] + c * x - s * y, walkers.place[:, 1] + s * x + c * y
    poses[:, 5] += walkers.heading
    return poses


def _each_seen(likelihood: Looking, observations: Sequence[Mapping[str, Any]]) -> Iterator[Looking]:
    """The likelihood as it is after each of the observations, copied."""
    seeing = deepcopy(likelihood)
    for observation in observations:
        seeing.observe(**observation)
        yield deepcopy(seeing)


def _scores(bank: _Bank, walkers: _Walkers, pictures: Sequence[tuple[float, Looking]]) -> np.ndarray:
    """Log-likelihood (n,) of the pictures: the seconds after the first one, and the likelihood that has seen it."""
    total = np.zeros(len(walkers.moment))
    for seconds, likelihood in pictures:
        total += np.nan_to_num(likelihood.log_likelihood(_poses(bank, walkers, seconds)), nan=-1e9, neginf=-1e9)
    return total


def _likely(scores: np.ndarray, effective: float, n: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (n,), drawn by scores flattened until about `effective` of them count."""
    scores = scores - scores.max()
    low, high = 0.0, 1.0
    for _ in range(30):
        power = 0.5 * (low + high)
        weights = np.exp(power * scores)
        low, high = (power, high) if weights.sum() ** 2 / (weights**2).sum() > effective else (low, power)
    return systematic(np.exp(low * scores), n, rng)


def _stirred(bank: _Bank, walkers: _Walkers, camera: Camera, share: float, rng: np.random.Generator) -> _Walkers:
    """The walkers moved by `share` of the first round's noise; some are exchanged for what looks much like them."""
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
    return _Walkers(gait, np.clip(moment, 0.05, _SPARE - 0.5), heading, place)
