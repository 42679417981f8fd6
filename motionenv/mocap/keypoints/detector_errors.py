"""A generative model of what detectors of 2D keypoints do to the points of a film.

Its numbers, with their sources and what is assumed, are in `detector_errors.toml`. Lengths are relative to the height h
of the person in the picture and to the OKS constant σ of each keypoint.
"""

import tomllib
from dataclasses import dataclass, fields
from importlib.resources import files

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number, random_generator
from motionenv.errors import MotionError
from motionenv.types import MARKERS, Points

_TABLE = tomllib.loads(files(__package__).joinpath("detector_errors.toml").read_text(encoding="utf-8"))
#: COCO's size of each marker, and its bias relative to that; `TAIL`: degrees of freedom of what changes.
SIGMA, BIAS, _MISSED, _SWAPPED = (
    np.array([_TABLE["parts"][name.split("_")[-1]][column] for name in MARKERS])
    for column in ("sigma", "bias", "missed", "swapped")
)
_AREA, TAIL = _TABLE["area"], _TABLE["tail"]
_REACH = 0.896  # from the head to the lower ankle of `motionenv.body.from_height`, relative to height
_WIDTH = 0.158  # mean width of its shoulders and hips, relative to height
_HEAD = MARKERS.index("head")
_LEFT, _RIGHT = ([m for m, name in enumerate(MARKERS) if name.startswith(side)] for side in ("left", "right"))
_ARMS, _LEGS = slice(0, 3), slice(3, 6)  # of the pairs of left and right
_TRUNK = [0, 3]  # shoulders and hips among them


@dataclass(frozen=True, repr=False)
class DetectorErrors(OneLine):
    """Errors of a detector; see `detector_errors.toml` for the sources of the defaults.

    Attributes:
        bias: scale per axis, in σ h, of an offset that belongs to person, marker and view: it changes as he turns.
        jitter: scale per axis, in σ h, of Student's t with 4 degrees of freedom, correlated in time.
        memory: time constant of that correlation [s]; 0 is white noise.
        severity: factor on the published rates of misses and of swaps of left and right.
        episode: mean duration of a miss or a swap [s].
        missing: share of the points that are missing.
        gap: mean duration of a gap [s].

    Example:
        >>> exact = Points(np.full((30, 15, 2), 100.0) + np.arange(15)[:, None], 30, "px")
        >>> seen = DetectorErrors(missing=0.1).apply(exact, rng=7)
    """

    bias: float = 0.12
    jitter: float = 0.12
    memory: float = 0.5
    severity: float = 0.5
    episode: float = 0.15
    missing: float = 0.05
    gap: float = 0.25

    def __post_init__(self) -> None:
        most = {"severity": 5.0, "missing": 0.95}
        for field in fields(self):
            checked_number(getattr(self, field.name), f"DetectorErrors.{field.name}", 0, most.get(field.name, np.inf))

    def apply(self, points: Points, rng: int | np.random.Generator, height: float | None = None) -> Points:
        """The points as a detector would give them, with its confidence; gaps stay gaps. The same seed, the same bytes.

        Args:
            points: where the markers are, in metres or pixels.
            rng: a numpy Generator or a seed.
            height: of the standing person in the picture, in the unit of the points; None takes it in each frame from
                the distance of head and ankles.

        Raises:
            MotionError: no height above 0, or none given and head and ankles are never seen together.
        """
        rng = random_generator(rng)
        frames, fps = len(points.positions), points.fps
        h = _heights(points.positions, height)[:, None, None]
        swapped = self._swapped(rng, frames, fps)
        error = h * SIGMA[:, None] * (self._bias(rng, points.positions, h) + self._jitter(rng, frames, fps))
        missed = _episodes(rng, frames, _MISSED * self.severity, self.episode * fps)
        error = np.where(missed[..., None], h * _elsewhere(rng, missed), error)
        gone = _episodes(rng, frames, np.full(len(MARKERS), self.missing), self.gap * fps)
        rows = np.arange(frames)[:, None]
        positions = np.where(gone[..., None], np.nan, points.positions[rows, swapped] + error)
        similarity = np.exp(-((error / (2 * SIGMA[:, None] * _AREA * h)) ** 2).sum(axis=-1) / 2)
        mean = _TABLE["doubt"] + _TABLE["certain"] * similarity
        confidence = rng.beta(_TABLE["evidence"] * mean, _TABLE["evidence"] * (1 - mean))
        confidence[np.isnan(positions).any(axis=-1)] = 0.0
        return Points(positions, fps, points.unit, points.truth, points.name, confidence)

    def _bias(self, rng, positions: np.ndarray, h: np.ndarray) -> np.ndarray:
        """Offsets (frames, 15, 2) [σ h], of constant variance over all views."""
        front, side = rng.standard_normal((2, len(MARKERS), 2)) * self.bias * BIAS[:, None]
        width = (positions[:, _LEFT, 0] - positions[:, _RIGHT, 0])[:, _TRUNK].mean(axis=1) / h[:, 0, 0]
        facing = np.clip(_filled(width / _WIDTH, 0.0), -1, 1)[:, None, None]
        return facing * front + np.sqrt(1 - facing**2) * side

    def _jitter(self, rng, frames: int, fps: float) -> np.ndarray:
        """Student's t in the plane (frames, 15, 2) [σ h]: a normal process with the radii of Student's t."""
        from scipy.signal import lfilter  # slow to import

        keep = np.exp(-1 / (fps * self.memory)) if self.memory > 0 else 0.0
        noise = rng.standard_normal((frames, len(MARKERS), 2))
        noise[1:] *= np.sqrt(1 - keep**2)
        normal = lfilter([1.0], [1.0, -keep], noise, axis=0)
        squared = np.maximum((normal**2).sum(axis=-1, keepdims=True), np.finfo(float).tiny)
        return self.jitter * normal * np.sqrt(TAIL * np.expm1(squared / TAIL) / squared)

    def _swapped(self, rng, frames: int, fps: float) -> np.ndarray:
        """Index (frames, 15) of the marker at whose place each one is detected; pairs alone, or arms or legs whole."""
        rates = 1 - np.sqrt(1 - np.minimum(_SWAPPED[_LEFT] * self.severity, 1.0))
        swapped = _episodes(rng, frames, rates, self.episode * fps)
        whole = _episodes(rng, frames, rates[_TRUNK], self.episode * fps)
        swapped[:, _ARMS] |= whole[:, :1]
        swapped[:, _LEGS] |= whole[:, 1:]
        order = np.tile(np.arange(len(MARKERS)), (frames, 1))
        order[:, _LEFT] = np.where(swapped, _RIGHT, _LEFT)
        order[:, _RIGHT] = np.where(swapped, _LEFT, _RIGHT)
        return order


def _elsewhere(rng, missed: np.ndarray) -> np.ndarray:
    """Offsets (frames, 15, 2) [h] of missed points, which stay the same throughout an episode."""
    near, far = (2 * _AREA * SIGMA * np.sqrt(-2 * np.log(similarity)) for similarity in _TABLE["elsewhere"])
    radius, angle = rng.uniform(near, far, missed.shape), rng.uniform(0, 2 * np.pi, missed.shape)
    changes = np.diff(missed, axis=0, prepend=False) * np.arange(len(missed))[:, None]
    since = np.maximum.accumulate(changes, axis=0)
    offsets = radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.take_along_axis(offsets, since[..., None], axis=0)


def _episodes(rng, frames: int, share: np.ndarray, duration: float) -> np.ndarray:
    """States (frames, n) of stationary two-state Markov chains that are on a `share` (n,) of the time.

    Episodes last `duration` frames on average, more if the share is otherwise out of reach.
    """
    share = np.clip(share, 0.0, 0.99)
    end = np.minimum(1 / max(duration, 1.0), (1 - share) / np.maximum(share, 1e-12))
    begin = end * share / (1 - share)
    draws = rng.random((frames, len(share)))
    on = np.empty(draws.shape, dtype=bool)
    state = draws[0] < share
    for t, draw in enumerate(draws):
        on[t] = state = np.where(state, draw >= end, draw < begin) if t else state
    return on


def _heights(positions: np.ndarray, height: float | None) -> np.ndarray:
    """The person's height (frames,) in the unit of the positions (frames, 15, 2)."""
    if height is not None:
        return np.full(len(positions), checked_number(height, "height", above=0))
    below = np.abs(positions[:, [_LEFT[-1], _RIGHT[-1]], 1] - positions[:, [_HEAD], 1]).max(axis=1)
    if not (below > 0).any():
        raise MotionError("points must show head and both ankles in some frame: pass height=, that of the person")
    return _filled(np.where(below > 0, below, np.nan), np.nan) / _REACH


def _filled(values: np.ndarray, otherwise: float) -> np.ndarray:
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else np.full(len(values), otherwise)
