"""Maximum a posteriori positions of the markers in all frames, from rays, proposed postures and what bodies do.

Gauss-Newton on all frames at once, in units of the body's size, in a frame whose z axis points up:

    rays        a marker lies on the ray on which it was seen; errors are angles with heavy tails
    posture     the markers lie about the pelvis as proposed, and move as proposed
    limbs       their lengths are constant, and the same on both sides
    pelvis      accelerates as people do
    feet        one that stands is on the floor, and stays

The scale of the world is not known here: lengths are in body units, as the proposed postures are.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np
from scipy import ndimage
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs

from motionenv.errors import MotionError
from motionenv.types import MARKERS

_M = {name: i for i, name in enumerate(MARKERS)}
_PELVIS = _M["pelvis"]
_ANKLES = np.array([_M["left_ankle"], _M["right_ankle"]])
#: Segments (a, b) of constant length; those of the two sides share a length.
_PAIRS = (("pelvis", "{}_hip"), ("sternum", "{}_shoulder"), ("{}_shoulder", "{}_elbow"), ("{}_elbow", "{}_wrist"),
          ("{}_hip", "{}_knee"), ("{}_knee", "{}_ankle"), ("pelvis", "{}_shoulder"))  # fmt: skip
_LIMBS = [
    ("pelvis", "sternum"), ("sternum", "head"),
    *((a.format(side), b.format(side)) for a, b in _PAIRS for side in ("left", "right")),
    ("left_hip", "right_hip"), ("left_shoulder", "right_shoulder"),
]  # fmt: skip
_A = np.array([_M[a] for a, _ in _LIMBS])
_B = np.array([_M[b] for _, b in _LIMBS])
_SHARED = np.array([0, 1, *np.repeat(np.arange(2, 9), 2), 9, 10])  # index of the length
_SPINE = np.array([0, 6, 7])  # from sternum to ankle along the body: these lengths define the body unit
_NOISE, _LEAST_JUMPS = 0.03, 30  # noise if fewer third differences than these are known
#: What the network's errors, which last for seconds, add to the posterior deviations, relative to those that it states,
#: for people left out who differ in style, proportions and joints as in training.
_UNSEEN = np.where([name.endswith("hip") for name in MARKERS], 0.5, 0.83)
#: Factors on them along the line of sight and across it: rays show what is across. With both 1, bands of turns and of
#: walks to all sides hold 62 to 65 % of the errors in depth, and all of those across.
_DEPTH, _ACROSS = 2.4, 0.5
#: Errors that last belong together along limbs, and turn hips and shoulders: a joint, another, their correlation.
_TOGETHER = (
    ("right_hip", "left_hip", -0.96), ("left_shoulder", "left_hip", 0.85), ("right_shoulder", "right_hip", 0.85),
    ("head", "sternum", 0.74),
    *((f"{side}_{a}", f"{side}_{b}", r) for side in ("left", "right")
      for a, b, r in (("elbow", "shoulder", 0.78), ("wrist", "elbow", 0.68), ("ankle", "knee", 0.63))),
)  # fmt: skip
#: Its errors are smaller where it is closer to what the rays show, as it is to plain walks: they follow the square of
#: the distance, in stated deviations. Which distance is usual, by how much less with noise (beyond a share of the least
#: that is assumed), and bounds; chosen on people of laboratories, as captured and in other styles
#: (`motionenv bench free_walking.coverage`).
_DISTANCE, _DISTANCE_NOISE, _ASSUMED, _CLOSER, _FARTHER = 0.7, 12.0, 0.6, 0.35, 1.3
#: [s] over which draws are smoothed, and widened again: the random walk of the velocity term has a tremor that errors
#: don't have, whose correlation over 0.1 s is 0.7 to 0.8.
_CALM = 0.08
#: Noise is taken to be larger in the first rounds, so that outliers don't decide where the fit goes.
_FIRST_NOISE, _COOLING = 0.2, 0.5


@dataclass(frozen=True)
class Settings:
    """Weights of the terms; lengths are in body units (0.43 m for an adult), times in seconds.

    They were chosen on CMU people whom network and models hadn't seen: `motionenv bench free_walking.tune`.
    """

    posture: float = 2.0  # factor on the proposed deviations: their errors last several frames
    velocity: float = 0.35  # of a marker about the pelvis, relative to what is proposed [1/s]
    limb: float = 0.03
    acceleration: tuple[float, float, float] = (6.0, 6.0, 12.0)  # of the pelvis [1/s²]
    floor: float = 0.06
    sliding: float = 0.5  # of a foot that stands [1/s]
    least_ray: float = 0.004  # least error of a ray, relative to the body's apparent size
    tail: float = 12.0  # squared error at which Geman and McClure's loss gives a ray a quarter of its weight
    #: The same of a detector's points: differences over time don't show errors that last, and limbs are exchanged.
    #: Chosen for the angles of hips and knees, on five people of laboratories (`motionenv bench lifting.degrees`).
    detector_ray: float = 0.1
    detector_tail: float = 4.0
    detector_posture: float = 1.4
    rounds: int = 7


DEFAULTS = Settings()


@dataclass
class Fit:
    """Fit of all frames.

    Attributes:
        places: (frames, 15, 3) positions from the origin of the rays' frame [body units].
        deviations: (frames, 15, 3) standard deviations about the pelvis [body units].
        contact: (frames, 2) probability that the left and right foot stand.
        floor: height of a standing ankle [body units].
        noise: standard deviation of a ray's error, relative to the body's apparent size.
        weights: (frames, 15) of the rays' robust loss, 0 for missing ones.
        limbs: (11,) lengths [body units].
        lasting: (frames, 15, 3, 3) roots of the covariances of what lasts for seconds, as part of `deviations`.
        equations: makes the normal equations of the last round anew, of which draws are taken.
    """

    places: np.ndarray
    contact: np.ndarray
    floor: float
    noise: float
    weights: np.ndarray
    limbs: np.ndarray
    deviations: np.ndarray = field(default_factory=lambda: np.zeros(0))
    lasting: np.ndarray = field(default_factory=lambda: np.zeros(0))
    equations: "Callable[[], _System] | None" = None
    fps: float = 30.0

    def passing(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draws (count, frames, 15, 3) [body units] of errors of `places` that pass within a moment."""
        assert self.equations is not None
        drawn = self.equations().sample(count, rng)
        others = np.arange(len(MARKERS)) != _PELVIS
        drawn[:, :, others] -= drawn[:, :, [_PELVIS]]
        calm = ndimage.gaussian_filter1d(drawn, _CALM * self.fps, axis=1, mode="nearest")
        drawn = calm * np.sqrt((drawn**2).mean(axis=(0, 1)) / (calm**2).mean(axis=(0, 1)))
        drawn[:, :, others] += drawn[:, :, [_PELVIS]]
        return drawn

    def lasting_for(self, numbers: np.ndarray) -> np.ndarray:
        """Errors (count, frames, 15, 3) [body units] that last, for standard normal numbers (count, 15, 3)."""
        return np.einsum("tmab,mk,nkb->ntma", self.lasting, _mixing(), numbers, optimize=True)


def smooth(
    rays: np.ndarray, origins: np.ndarray, precision: np.ndarray, posture: np.ndarray, spread: np.ndarray, fps: float,
    settings: Settings,
) -> Fit:  # fmt: skip
    """Fit all frames.

    Args:
        rays: (frames, 15, 3) unit vectors towards the markers; NaN where a marker isn't seen.
        origins: (frames, 3) of the rays [body units].
        precision: (frames, 15) relative precision of the rays: 1 where nothing is known about it.
        posture: (frames, 15, 3) proposed positions relative to the pelvis [body units].
        spread: (frames, 15) their standard deviations [body units].
        fps: frame rate [Hz].
        settings: weights of the terms.
    """
    seen = np.isfinite(rays[..., 0])
    across = _across(np.nan_to_num(rays))
    size = _apparent(rays, posture, seen, fps)
    noise = max(_noise(rays, size), settings.least_ray)
    fit = Fit(posture.copy(), np.zeros((len(rays), 2)), 0.0, noise, seen * precision, _lengths(posture))
    whole = fit.limbs[_SPINE].sum()
    distance = np.repeat((1 / size)[:, None], len(MARKERS), axis=1)
    terms = partial(_assembled, rays, origins, posture, spread, fps, settings)
    for round_ in range(settings.rounds + 1):
        expected = max(fit.noise, _FIRST_NOISE * _COOLING**round_) * size[:, None] * distance
        last = partial(terms, replace(fit), expected, round_)
        fit.places, covariance = last().solve(round_ == settings.rounds)
        if covariance is not None:
            unseen = _UNSEEN * _strangeness(fit, posture, spread, settings.least_ray) * spread
            fit.lasting = unseen[..., None, None] * _stretched(rays)
            fit.deviations = np.sqrt(_about(covariance) + (fit.lasting**2).sum(axis=-1))
            fit.equations, fit.fps = last, fps
            break
        ways = fit.places - origins[:, None]
        off = ((across @ ways[..., None]) ** 2).sum(axis=(-2, -1)) / expected**2
        fit.weights = seen * precision / (1 + off * precision / settings.tail) ** 2
        distance = np.linalg.norm(ways, axis=-1)
        fit.limbs = _lengths(fit.places)
        fit.limbs *= whole / fit.limbs[_SPINE].sum()  # proportions only: else the body grows from round to round
        fit.contact, fit.floor = contacts(fit.places, fps)
    return fit


def _stretched(rays: np.ndarray) -> np.ndarray:
    """Matrices (frames, 1, 3, 3) that stretch along the mean ray and shrink across it, as errors that last do."""
    view = np.nan_to_num(rays).sum(axis=1, keepdims=True)
    view = view / np.maximum(np.linalg.norm(view, axis=-1, keepdims=True), 1e-9)
    return _ACROSS * np.eye(3) + (_DEPTH - _ACROSS) * view[..., :, None] * view[..., None, :]


@cache
def _mixing() -> np.ndarray:
    """Matrix (15, 15) that gives independent standard normal numbers the correlations `_TOGETHER`."""
    mixing = np.eye(len(MARKERS))
    for joint, other, correlation in _TOGETHER:
        own = np.sqrt(1 - correlation**2) * mixing[_M[joint]]
        mixing[_M[joint]] = own + correlation * mixing[_M[other]]
    return mixing


def _assembled(
    rays, origins, posture, spread, fps: float, settings: Settings, fit: Fit, expected, round_: int
) -> "_System":
    """The normal equations of a round, linearised at `fit`, with deviations (frames, 15) of the rays `expected`."""
    system, across, weights = _System(len(rays)), _across(np.nan_to_num(rays)), fit.weights / expected**2
    system.rays(across, weights, origins)
    system.posture(posture, 1 / (settings.posture * spread) ** 2)
    system.velocity(posture, fps / settings.velocity / np.sqrt(fps))
    system.pelvis(fps**1.5 / np.array(settings.acceleration))
    if round_ > 0:
        system.farther(across, weights, fit.places - origins[:, None])
        system.limbs(fit.places, fit.limbs, 1 / settings.limb)
    if round_ > 1:
        system.feet(fit.contact, fit.floor, 1 / settings.floor, np.sqrt(fps) / settings.sliding)
    return system


def _strangeness(fit: Fit, posture: np.ndarray, spread: np.ndarray, least: float) -> float:
    """Squared distance of the network's postures from what the rays show, relative to that of people it didn't see."""
    others = np.arange(len(MARKERS)) != _PELVIS
    off = (fit.places - fit.places[:, [_PELVIS]] - posture)[:, others] / spread[:, others, None]
    usual = _DISTANCE / (1 + _DISTANCE_NOISE * (fit.noise - _ASSUMED * least))
    return float(np.clip((off**2).mean() / usual**2, _CLOSER, _FARTHER))


def contacts(places: np.ndarray, fps: float) -> tuple[np.ndarray, float]:
    """Probability (frames, 2) that a foot stands, and the height of a standing ankle, both from ankles [body units]."""
    ankles = places[:, _ANKLES]
    velocity = np.gradient(ankles, axis=0) * fps if len(ankles) > 1 else np.zeros_like(ankles)
    speed = np.linalg.norm(velocity, axis=-1)
    height = ankles[..., 2]
    floor = float(np.quantile(height.min(axis=1), 0.15))
    for _ in range(3):
        chance = 1 / (1 + np.exp((height - floor - 0.16) / 0.04)) / (1 + np.exp((speed - 1.8) / 0.4))
        if chance.sum() < 1:
            break
        floor = float((chance * height).sum() / chance.sum())
    return chance, floor


def _about(covariance: np.ndarray) -> np.ndarray:
    """Variances (frames, 15, 3) of positions about the pelvis, from covariances (frames, 45, 45)."""
    count = len(MARKERS)
    blocks = covariance.reshape(-1, count, 3, count, 3)
    own = np.einsum("tmama->tma", blocks)
    shared = np.einsum("tmaa->tma", blocks[:, :, :, _PELVIS])
    return np.maximum(own + own[:, [_PELVIS]] - 2 * shared, 0.0)


def _lengths(places: np.ndarray) -> np.ndarray:
    """Limb lengths (11,), the median over frames and the mean of the two sides."""
    each = np.median(np.linalg.norm(places[:, _A] - places[:, _B], axis=-1), axis=0)
    return np.bincount(_SHARED, each) / np.bincount(_SHARED)


def _across(rays: np.ndarray) -> np.ndarray:
    """Projections (frames, 15, 3, 3) across the rays; zero rays give the identity."""
    return np.eye(3) - rays[..., :, None] * rays[..., None, :]


def _apparent(rays, posture, seen, fps: float) -> np.ndarray:
    """The body unit's apparent size (frames,) [rad]: how wide the rays spread relative to the posture, over 0.5 s."""
    middle = np.nan_to_num(rays).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)[:, None]
    view = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    flat = _across(view[:, None])[:, 0]
    wide = np.einsum("tab,tmb->tma", flat, np.where(seen[..., None], rays, 0.0) - middle[:, None] * seen[..., None])
    bodies = np.einsum("tab,tmb->tma", flat, posture)
    bodies = (bodies - bodies.mean(axis=1, keepdims=True)) * seen[..., None]
    enough = seen.sum(axis=1) >= 4
    size = np.sqrt((wide**2).sum(axis=(1, 2)) / np.maximum((bodies**2).sum(axis=(1, 2)), 1e-9))
    frames = np.arange(len(rays))
    size = np.interp(frames, frames[enough], size[enough])
    return ndimage.median_filter(size, max(1, round(fps / 2)), mode="nearest")


def _noise(rays: np.ndarray, size: np.ndarray) -> float:
    """Standard deviation of a ray's error, relative to the apparent size, from third differences over time.

    Residuals of the fit would tell too little of it: positions that are free to follow noise leave none.
    """
    jumps = np.diff(rays, n=3, axis=0) / size[3:, None, None]
    square = (jumps**2).sum(axis=-1)
    known = square[np.isfinite(square)]
    if len(known) < _LEAST_JUMPS:
        return _NOISE
    return float(np.sqrt(np.median(known) / 1.386 / 20))  # median of chi² of 2 degrees of freedom; 1 + 9 + 9 + 1


class _System:
    """The normal equations of all terms."""

    def __init__(self, frames: int):
        count = len(MARKERS)
        self.own = np.zeros((frames, count, 3, count, 3))
        self.next = np.zeros((max(frames - 1, 0), count, 3, count, 3))
        self.second = np.zeros((max(frames - 2, 0), 3, 3))  # of the pelvis
        self.right = np.zeros((frames, count, 3))

    def rays(self, across, weights, origins) -> None:
        """Squared distances from the rays."""
        each = across * weights[..., None, None]
        index = np.arange(len(MARKERS))
        self.own[:, index, :, index] += each.swapaxes(0, 1)
        self.right += np.einsum("tmab,tb->tma", each, origins)

    def farther(self, across, weights, ways) -> None:
        """Errors are angles: noise mustn't shrink as markers come closer along their `ways` from the camera."""
        off = ((across @ ways[..., None]) ** 2).sum(axis=-2)
        self.right += weights[..., None] * off / (ways**2).sum(axis=-1, keepdims=True) * ways

    def posture(self, posture, precision) -> None:
        """Positions about the pelvis; precision (frames, 15)."""
        self._add(self.own, _about_pelvis(precision))
        self.right += _about_pelvis(precision) @ posture

    def velocity(self, posture, weight: float) -> None:
        """Changes of the positions about the pelvis from frame to frame."""
        if len(posture) < 2:
            return
        graph = _about_pelvis(np.full((1, len(MARKERS)), weight**2))[0]
        change = graph @ np.diff(posture, axis=0)
        for part, sign in ((slice(None, -1), -1), (slice(1, None), 1)):
            self._add(self.own[part], graph)
            self.right[part] += sign * change
        self._add(self.next, -graph)

    def pelvis(self, weights: np.ndarray) -> None:
        """Second differences of the pelvis; weights (3,)."""
        p, square = _PELVIS, weights**2
        if len(self.second) == 0:
            return
        for axis in range(3):
            own, next_ = self.own[:, p, axis, p, axis], self.next[:, p, axis, p, axis]
            own[:-2] += square[axis]
            own[1:-1] += 4 * square[axis]
            own[2:] += square[axis]
            next_[:-1] -= 2 * square[axis]
            next_[1:] -= 2 * square[axis]
            self.second[:, axis, axis] += square[axis]

    def limbs(self, places, lengths, weight: float) -> None:
        """Lengths of limbs, in their present directions."""
        way = places[:, _A] - places[:, _B]
        way = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
        square = weight**2 * way[..., :, None] * way[..., None, :]
        pull = weight**2 * lengths[_SHARED][:, None] * way
        for k, (a, b) in enumerate(zip(_A, _B, strict=True)):
            for one, other, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                self.own[:, one, :, other] += sign * square[:, k]
            self.right[:, a] += pull[:, k]
            self.right[:, b] -= pull[:, k]

    def feet(self, contact, floor: float, height: float, sliding: float) -> None:
        """Standing ankles at the floor's height, and without horizontal motion."""
        both = contact[1:] * contact[:-1] * sliding**2
        for side, ankle in enumerate(_ANKLES):
            self.own[:, ankle, 2, ankle, 2] += contact[:, side] * height**2
            self.right[:, ankle, 2] += contact[:, side] * height**2 * floor
            for axis in (0, 1):
                self.own[:-1, ankle, axis, ankle, axis] += both[:, side]
                self.own[1:, ankle, axis, ankle, axis] += both[:, side]
                self.next[:, ankle, axis, ankle, axis] -= both[:, side]

    def solve(self, covariance: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Positions (frames, 15, 3), and on request each frame's covariance (frames, 45, 45)."""
        places, spread = solve(*self._blocks(), self.right.reshape(len(self.right), -1), covariance)
        return places.reshape(self.right.shape), spread

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draws (count, frames, 15, 3) from the Gaussian whose precision these equations are, about its mean."""
        return sample(*self._blocks(), count, rng).reshape(count, *self.right.shape)

    def _blocks(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, slice]:
        n = 3 * len(MARKERS)
        own, next_ = (blocks.reshape(-1, n, n) for blocks in (self.own, self.next))
        return own, next_, self.second, slice(3 * _PELVIS, 3 * _PELVIS + 3)

    @staticmethod
    def _add(blocks: np.ndarray, graph: np.ndarray) -> None:
        """Add a coupling of markers (..., 15, 15) that is the same along each axis."""
        for axis in range(3):
            blocks[:, :, axis, :, axis] += graph


def _about_pelvis(precision: np.ndarray) -> np.ndarray:
    """Coupling (frames, 15, 15) of markers with the pelvis by precision (frames, 15)."""
    precision = precision.copy()
    precision[:, _PELVIS] = 0.0
    graph = precision[:, :, None] * np.eye(len(MARKERS))
    graph[:, :, _PELVIS] -= precision
    graph[:, _PELVIS, :] -= precision
    graph[:, _PELVIS, _PELVIS] += precision.sum(axis=1)
    return graph


def solve(
    diagonal: np.ndarray, next_: np.ndarray, second: np.ndarray, few: slice, right: np.ndarray, covariance: bool = False
) -> tuple[np.ndarray, np.ndarray | None]:
    """The solution (frames, n) and, on request, each frame's covariance (frames, n, n), which is part of the inverse.

    Frame after frame is eliminated, then substituted backwards. What a frame depends on is all of the next one and,
    in the second next one, the few unknowns that couple with it.

    Args:
        diagonal: (frames, n, n) of each frame; changed in place.
        next_: (frames - 1, n, n) between a frame (rows) and the next one (columns); changed in place.
        second: (frames - 2, m, m) between the `few` unknowns of a frame (rows) and those of the second next one.
        few: which m of the n unknowns these are.
        right: (frames, n).
        covariance: whether to compute covariances.
    """
    values = right.copy()
    factors, gains = _eliminated(diagonal, next_, second, few, values)
    frames = len(values)
    for k in range(frames - 1, -1, -1):
        values[k] = dpotrs(factors[k], values[k], lower=True)[0]
        if k < frames - 1:
            values[k] -= gains[k] @ _later(values, k, few)
    return values, _covariances(factors, gains, few) if covariance else None


def sample(
    diagonal: np.ndarray, next_: np.ndarray, second: np.ndarray, few: slice, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Draws (count, frames, n) from the Gaussian of mean 0 whose precision is the matrix of `solve`.

    Backwards, each frame is drawn given the later ones. All other arguments are as of `solve`.
    """
    frames, n = diagonal.shape[:2]
    factors, gains = _eliminated(diagonal, next_, second, few, np.zeros((frames, n)))
    drawn = rng.standard_normal((frames, n, count))
    for k in range(frames - 1, -1, -1):
        drawn[k] = dtrtrs(factors[k], drawn[k], lower=True, trans=1)[0]
        if k < frames - 1:
            drawn[k] -= gains[k] @ _later(drawn, k, few)
    return np.moveaxis(drawn, -1, 0)


def _later(values: np.ndarray, k: int, few: slice) -> np.ndarray:
    """Values on which frame `k` depends: those of the next frame, and the few of the second next one."""
    return np.concatenate([values[k + 1], values[k + 2, few]]) if k + 2 < len(values) else values[k + 1]


def _eliminated(own, next_, second, few: slice, values) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Cholesky factors of the eliminated frames, and gains on what they depend on; arguments change in place."""
    frames, n = values.shape
    factors: list[np.ndarray] = []
    gains: list[np.ndarray] = []
    coupling = np.zeros((n, n + second.shape[-1]))
    for k in range(frames):
        factor, failed = dpotrf(own[k], lower=True)
        if failed:
            raise MotionError("the frames don't determine a motion: give more points, or a longer stretch")
        factors.append(factor)
        if k == frames - 1:
            break
        coupling[:, :n] = next_[k]
        if k < frames - 2:
            coupling[few, n:] = second[k]
        else:
            coupling = coupling[:, :n]
        gain = dpotrs(factor, coupling, lower=True)[0]
        gains.append(gain)
        product = coupling.T @ gain
        own[k + 1] -= product[:n, :n]
        values[k + 1] -= gain[:, :n].T @ values[k]
        if k < frames - 2:
            next_[k + 1][:, few] -= product[:n, n:]
            own[k + 2][few, few] -= product[n:, n:]
            values[k + 2, few] -= gain[:, n:].T @ values[k]
    return factors, gains


def _covariances(factors: list[np.ndarray], gains: list[np.ndarray], few: slice) -> np.ndarray:
    """Diagonal blocks of the inverse (frames, n, n), from the last frame backwards."""
    frames, n = len(factors), len(factors[0])
    out = np.empty((frames, n, n))
    later = np.zeros((0, 0))  # covariance of what the frame depends on
    for k in range(frames - 1, -1, -1):
        out[k] = dpotrs(factors[k], np.eye(n), lower=True)[0]
        if k == frames - 1:
            later = out[k]
            continue
        across = -gains[k] @ later
        out[k] -= across @ gains[k].T
        out[k] = 0.5 * (out[k] + out[k].T)  # what rounding leaves of asymmetry would grow from frame to frame
        shared = across[:, :n][:, few]
        later = np.block([[out[k], shared], [shared.T, out[k + 1][few, few]]])
    return out
