"""A generative model of what detectors of 2D keypoints do to the points of a film.

Lengths are relative to the person's height h in the picture and to the OKS constant σ of each keypoint, the spread of
human annotators (https://cocodataset.org/#keypoints-eval), whose unit is the square root of the silhouette's area.
That is 0.41 h for a standing adult: 35 % (front) to 23 % (side) of a skin of 1.8 m² (Fanger 1970) at h = 1.75 m.

Where the numbers come from:
    total spread    Ronchi & Perona (ICCV 2017) classify the errors of two detectors on COCO; Moon et al. (PoseFix, CVPR
                    2019) give the rates by keypoint. Of 100 keypoints of people seen whole, 10 to 20 have jitter (OKS
                    0.5 to 0.85). Student's t with 4 degrees of freedom does that at a scale of 0.17 σ h per axis.
    bias            Needham et al. (Sci Rep 2021): 30 to 50 mm in space at hip and knee, 1 to 15 mm at the ankle, so
                    0.12 σ h per axis, a third of it at the ankle; the rest of the spread, 0.12 σ h, changes in time.
    memory          Zeng et al. (SmoothNet, ECCV 2022): mean error and acceleration error on Human3.6M at 50 Hz. If half
                    the variance is bias, first-order autoregression has a time constant of 0.2 s (CPN), 0.8 s (HRNet),
                    1.3 s (RLE) or 1.5 s (Hourglass).
    misses, swaps   PoseFix's rates: 2 % of heads, 5 % of shoulders and ankles, 10 % of other keypoints lie elsewhere
                    (OKS 0.1 to 0.5), 3 % of the upper and 6 % of the lower keypoints on the other side. They hold for
                    photos full of people and detectors of 2017, of AP 0.6; `severity` scales them. That half of them
                    suits films of one person and detectors of AP 0.75 is an assumption, as are the lengths of episodes,
                    the share of whole limbs among swaps (one half), the gaps, and the confidence.
"""

from dataclasses import dataclass, fields

import numpy as np

from motionenv._core.validation import checked_number, random_generator
from motionenv.errors import MotionError
from motionenv.types import MARKERS, Points

_AREA = 0.41  # square root of the silhouette's area, relative to height
_TAIL = 4.0  # degrees of freedom
_ELSEWHERE = np.sqrt(-2 * np.log([0.5, 0.1]))  # distances [2 σ √area] at which OKS is 0.5 and 0.1
_REACH = 0.896  # from the head to the lower ankle of `motionenv.body.from_height`, relative to height
_WIDTH = 0.158  # mean width of its shoulders and hips, relative to height
_CERTAIN, _DOUBT, _EVIDENCE = 0.6, 0.3, 12.0  # confidence: mean 0.3 + 0.6 OKS, as of a Beta with 12 observations

# Per marker or pair: σ (sternum and pelvis: of the means of shoulders and hips), and the rate of misses
_SIGMA = {"head": 0.035, "sternum": 0.05, "pelvis": 0.076, "shoulder": 0.079, "elbow": 0.072, "wrist": 0.062,
          "hip": 0.107, "knee": 0.087, "ankle": 0.089}  # fmt: skip
_MISSED = {"head": 0.02, "sternum": 0.05, "shoulder": 0.05, "ankle": 0.05}
_SWAPPED = {"shoulder": 0.03, "elbow": 0.03, "wrist": 0.03, "hip": 0.06, "knee": 0.06, "ankle": 0.06}
_PARTS = [name.split("_")[-1] for name in MARKERS]
_SIGMAS = np.array([_SIGMA[part] for part in _PARTS])
_BIASED = np.array([1 / 3 if part == "ankle" else 1.0 for part in _PARTS])
_LEFT, _RIGHT = ([MARKERS.index(f"{side}_{part}") for part in _SWAPPED] for side in ("left", "right"))
_TRUNK = [[MARKERS.index(f"{side}_{part}") for part in ("shoulder", "hip")] for side in ("left", "right")]
_HEAD, _ANKLES = MARKERS.index("head"), [MARKERS.index(f"{side}_ankle") for side in ("left", "right")]


@dataclass(frozen=True)
class DetectorErrors:
    """Errors of a detector; see the module for the sources of the defaults.

    Attributes:
        bias: scale per axis, in σ h, of an offset that belongs to person, marker and view: it changes as he turns.
        jitter: scale per axis, in σ h, of Student's t with 4 degrees of freedom, correlated in time.
        memory: time constant of that correlation [s]; 0 is white noise.
        severity: factor on the published rates of misses and of swaps of left and right.
        episode: mean duration of a miss or a swap [s].
        missing: share of the points that are missing.
        gap: mean duration of a gap [s].

    Example:
        >>> seen = DetectorErrors(missing=0.1).apply(points, rng=7)
    """

    bias: float = 0.12
    jitter: float = 0.12
    memory: float = 0.5
    severity: float = 0.5
    episode: float = 0.15
    missing: float = 0.05
    gap: float = 0.25

    def __post_init__(self):
        most = {"severity": 5.0, "missing": 0.95}
        for field in fields(self):
            checked_number(getattr(self, field.name), f"DetectorErrors.{field.name}", 0, most.get(field.name, np.inf))

    def apply(self, points: Points, rng, height=None) -> Points:
        """The points as a detector would give them, with its confidence; gaps stay gaps. The same seed, the same bytes.

        Args:
            points: where the markers are, in metres or pixels.
            rng: a numpy Generator or a seed.
            height: of the standing person in the picture, in the unit of the points: a number, or one per frame
                (frames,). None: from the distance of head and ankles.

        Raises:
            MotionError: no height above 0, or none given and head and ankles are never seen together.
        """
        rng = random_generator(rng)
        frames, fps = len(points.positions), points.fps
        h = _heights(points.positions, height)[:, None, None]
        swapped = self._swapped(rng, frames, fps)
        error = h * _SIGMAS[:, None] * (self._bias(rng, points.positions, h) + self._jitter(rng, frames, fps))
        missed = np.array([_MISSED.get(part, 0.1) for part in _PARTS]) * self.severity
        error = np.where(*_elsewhere(rng, _episodes(rng, frames, missed, self.episode * fps), h), error)
        gone = _episodes(rng, frames, np.full(len(MARKERS), self.missing), self.gap * fps)
        rows = np.arange(frames)[:, None]
        positions = np.where(gone[..., None], np.nan, points.positions[rows, swapped] + error)
        similarity = np.exp(-((error / (2 * _SIGMAS[:, None] * _AREA * h)) ** 2).sum(axis=-1) / 2)
        mean = _DOUBT + _CERTAIN * similarity
        confidence = rng.beta(_EVIDENCE * mean, _EVIDENCE * (1 - mean))
        confidence[np.isnan(positions).any(axis=-1)] = 0.0
        return Points(positions, fps, points.unit, points.truth, points.name, confidence)

    def _bias(self, rng, positions: np.ndarray, h: np.ndarray) -> np.ndarray:
        """Offsets (frames, 15, 2) [σ h], of constant variance over all views."""
        front, side = rng.standard_normal((2, len(MARKERS), 2)) * self.bias * _BIASED[:, None]
        left, right = (positions[:, trunk, 0] for trunk in _TRUNK)
        facing = _filled((left - right).mean(axis=1) / (_WIDTH * h[:, 0, 0]), 0.0)
        facing = np.clip(facing, -1, 1)[:, None, None]
        return facing * front + np.sqrt(1 - facing**2) * side

    def _jitter(self, rng, frames: int, fps: float) -> np.ndarray:
        """Student's t in the plane (frames, 15, 2) [σ h]: a normal process with the radii of Student's t."""
        from scipy.signal import lfilter  # slow to import

        keep = np.exp(-1 / (fps * self.memory)) if self.memory > 0 else 0.0
        noise = rng.standard_normal((frames, len(MARKERS), 2))
        noise[1:] *= np.sqrt(1 - keep**2)
        normal = lfilter([1.0], [1.0, -keep], noise, axis=0)
        squared = np.maximum((normal**2).sum(axis=-1, keepdims=True), np.finfo(float).tiny)
        return self.jitter * normal * np.sqrt(_TAIL * np.expm1(squared / _TAIL) / squared)

    def _swapped(self, rng, frames: int, fps: float) -> np.ndarray:
        """Index (frames, 15) of the marker at whose place each one is detected; pairs alone, or arms or legs whole."""
        rates = 1 - np.sqrt(1 - np.minimum(np.array(list(_SWAPPED.values())) * self.severity, 1.0))
        alone = _episodes(rng, frames, rates, self.episode * fps)
        whole = _episodes(rng, frames, rates[[0, 3]], self.episode * fps).repeat(3, axis=1)
        order = np.tile(np.arange(len(MARKERS)), (frames, 1))
        order[:, _LEFT], order[:, _RIGHT] = (
            np.where(alone | whole, other, own) for own, other in ((_LEFT, _RIGHT), (_RIGHT, _LEFT))
        )
        return order


def _elsewhere(rng, missed: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where (frames, 15, 1) points are missed, and their offsets (frames, 15, 2), the same throughout an episode."""
    radius, angle = rng.uniform(*_ELSEWHERE, missed.shape), rng.uniform(0, 2 * np.pi, missed.shape)
    offset = radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    begins = np.diff(missed, axis=0, prepend=False)
    since = np.maximum.accumulate(np.where(begins, np.arange(len(missed))[:, None], 0), axis=0)
    held = np.take_along_axis(offset, since[..., None], axis=0)
    return missed[..., None], held * 2 * _SIGMAS[:, None] * _AREA * h


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


def _heights(positions: np.ndarray, height) -> np.ndarray:
    """The person's height (frames,) in the unit of the positions (frames, 15, 2)."""
    if height is None:
        below = np.abs(positions[:, _ANKLES, 1] - positions[:, [_HEAD], 1])
        height = _filled(below.max(axis=1), np.nan) / _REACH
    try:
        heights = np.broadcast_to(np.asarray(height, dtype=np.float64), len(positions))
    except (TypeError, ValueError):
        heights = np.zeros(1)
    if not ((heights > 0) & np.isfinite(heights)).all():
        raise MotionError(
            "height must be the person's height in the picture, one number or one per frame, above 0, in the unit of "
            "the points; without it, head and both ankles must be seen together in some frame"
        )
    return heights


def _filled(values: np.ndarray, otherwise: float) -> np.ndarray:
    """`values` (frames,) with gaps interpolated; all `otherwise` if there are none."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else np.full(len(values), otherwise)
