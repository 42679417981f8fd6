r"""Silhouette and depth likelihood: p(J_t | φ_t) of paper A, section 5, and p(I_t | φ_t) of paper C.

A `SilhouetteLikelihood` uses only what an agent may know (the camera, an average body and the current observation) and
evaluates thousands of hypotheses.

    >>> import motionenv
    >>> from motionenv.likelihoods import SilhouetteLikelihood
    >>> from motionenv.render.cameras import view
    >>> walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
    >>> camera = view(0.0, width=64, height=64)
    >>> mask = motionenv.render.render(walk.poses[0], walk.skeleton, camera).limbs > 0
    >>> model = SilhouetteLikelihood(camera)
    >>> model.observe(mask=mask)                      # or depth=…, or rgb=…, background=…
    >>> model.log_likelihood(walk.poses).shape        # (N, 25) -> (N,)
    (30,)

**Silhouette.** A pixel is seen as foreground (y = 1) with probability 1 - misses inside the hypothesis' silhouette, and
with probability false_alarms outside. Colours determine y only up to a probability p, so

    p(pixel | body) = p (1 - misses) + (1 - p) misses,    p(pixel | none) = p false_alarms + (1 - p)(1 - false_alarms)

Both rates make the likelihood robust: they bound the log-odds of a pixel, and so the influence of occluders. The
log-likelihood is the sum of log p(pixel | none) over the image plus the sum of log-odds over the silhouette, which
needs one pass over the outline. Pixels of known occluders are those of a mask with p = ½.

**Hidden parts.** Posts, boxes and bushes stand on the ground before the body, so that below a hidden pixel all others
of its column are hidden as well. Where a still, level camera has seen foreground at a pixel or below it, now or before,
the rate is therefore `misses`, elsewhere `hidden`. Near 1, a hidden pixel costs next to nothing, and somebody of whom
only a sliver shows isn't better explained as somebody small and far away.

**Depth.** Where both hypothesis and image have a body, the observed depth is Gaussian about the hypothesis', or, with
probability `outliers`, uniform over `_DEPTH_RANGE` metres; misses and false alarms are as above.

**Tempering.** Neighbouring pixels aren't independent: a wrong body shape causes errors along whole outlines. The sum
over pixels is scaled as if only `effective` of the body's pixels were independent.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_number
from motionenv.body.limbs import LIMBS, from_height, limb_shifts
from motionenv.errors import MotionError
from motionenv.likelihoods.background import Background, foreground_probability, picture
from motionenv.likelihoods.base import ImageLikelihood
from motionenv.render.raycast.engine import Raycaster
from motionenv.types import Camera, Skeleton

#: Effective number of independent pixels of a body of 20 to 216 pixels. An average body stood for walkers of random
#: height and girth: 90 % intervals held with about 8 for masks and 4 for depths, and too seldom with 32
#: (`benchmarks/tracking/likelihood.py`).
EFFECTIVE = 6.0

_AREA = 0.14  # area of a silhouette in squared body heights, for walkers seen from all sides
NOTHING_OBSERVED = "nothing has been observed yet: call observe(mask=… or rgb=… or depth=…) first"
PIECE = 256  # hypotheses per kernel call: large enough to amortise the call, small enough for a core's cache
_BARE = 0.99  # least posterior probability of no body at a pixel for learning it as background
_BESIDE = 0.05  # [m] margin around the body in which the background isn't learned
_DEPTH_RANGE = 4.0  # [m] range over which outlier depths are uniform

#: Writes the log-odds (n,) of bodies with limb ends (n, limbs, 2, 3).
Score = Callable[[np.ndarray, np.ndarray], None]


class SilhouetteLikelihood(ImageLikelihood):
    """Log-likelihood of images given poses.

    Args:
        camera: of the images.
        skeleton: the body of the hypotheses; None uses the average one, `from_height(1.75)`, because agents don't know
            the true body.
        misses: probability that a body pixel is seen as background, 0 to 0.5.
        false_alarms: probability that a background pixel is seen as foreground, 0 to 0.5.
        hidden: `misses` of masks and colours where something that stands on the ground may hide the body, between 0 and
            1; None supposes nothing of the kind.
        depth_noise: standard deviation of depths, from the sensor and the body's shape [m].
        outliers: probability that a depth is an outlier.
        effective: effective number of independent body pixels (see `EFFECTIVE`); None counts all pixels.
        distance: approximate distance of the body from the camera [m], which determines its number of pixels; None uses
            that of the world's origin.
        still: False for a camera with a moving background, such as one that follows the walker; affects `rgb` without a
            given background.
        threads: number of threads, which doesn't change the result; None uses one per core.

    Raises:
        MotionError: an argument out of range.

    Attributes:
        camera: of the current image.
        view: R, t, K and its inverse for kernels, with the image rotated so that K is upper triangular.
        workers: the threads.
    """

    def __init__(
        self, camera: Camera, skeleton: Skeleton | None = None, *, misses: float = 0.2, false_alarms: float = 0.1,
        hidden: float | None = None, depth_noise: float = 0.05, outliers: float = 0.05,
        effective: float | None = EFFECTIVE, distance: float | None = None, still: bool = True,
        threads: int | None = None,
    ) -> None:  # fmt: skip
        for name, rate in (("misses", misses), ("false_alarms", false_alarms), ("outliers", outliers)):
            checked_number(rate, name, above=0, below=0.5)
        if hidden is not None:
            checked_number(hidden, "hidden", above=0, below=1)
        positive = {"depth_noise": depth_noise, "effective": effective, "distance": distance}
        for name, value in positive.items():
            if value is not None:
                checked_number(value, name, above=0)
        self.skeleton = from_height() if skeleton is None else skeleton
        self.misses, self.false_alarms, self.hidden = misses, false_alarms, hidden
        self.depth_noise, self.outliers = depth_noise, outliers
        self.effective, self.distance = effective, distance
        self.workers = Workers(threads, "estimation")
        self._looking: list[float] = []
        self.still, self._caster = still, Raycaster(threads=1)
        self.look(camera)
        self.forget()

    def forget(self) -> None:
        self._background = Background()
        self._foreground: np.ndarray | None = None
        self._depth: np.ndarray | None = None
        self._odds: tuple[np.ndarray, float] | None = None
        self._in_view = np.zeros((self.camera.height, self.camera.width), dtype=bool)
        self._to_learn = False

    def observe(
        self, *, mask: np.ndarray | None = None, rgb: np.ndarray | None = None, depth: np.ndarray | None = None,
        background: np.ndarray | None = None, camera: Camera | None = None,
    ) -> None:  # fmt: skip
        """Set the current image: one of `mask`, `rgb` and `depth`.

        Args:
            mask: (height, width), bool or integers (0 is background), or foreground probabilities as floats, such as ½
                where something is known to hide the body.
            rgb: uint8 (height, width, 3).
            depth: (height, width) [m] along the camera's z; infinite, or 0, where there is no body; NaN where unknown.
            background: (height, width, 3), `rgb` without the body; None estimates it from the images so far, see
                `motionenv.likelihoods.background.Background`.
            camera: current camera, if it moves.

        Raises:
            MotionError: not exactly one of the three, or a wrong shape or value.
        """
        given = [name for name, value in (("mask", mask), ("rgb", rgb), ("depth", depth)) if value is not None]
        if len(given) != 1:
            raise MotionError(f"observe needs exactly one of mask, rgb and depth, got {' and '.join(given) or 'none'}")
        if background is not None and rgb is None:
            raise MotionError("background is allowed with rgb only: omit it")
        camera = self.camera if camera is None else camera
        size = (camera.height, camera.width)
        foreground = depths = None
        if mask is not None:
            foreground = _probabilities(mask, size)
        elif depth is not None:
            depths = _depths(depth, size)
        elif rgb is not None:
            _check_size("rgb", picture(rgb).shape[:2], size)
            foreground = self._not_background(rgb, background)
        self.look(camera)
        self._to_learn = rgb is not None and background is None
        self._foreground, self._depth = foreground, depths
        self._odds = None if foreground is None else self._log_odds(foreground)

    def learn(self, poses: ArrayLike, log_weights: np.ndarray | None = None) -> None:
        """Update the estimated background from the last image's pixels beside the body.

        Args:
            poses: (N, 25) [m, rad], or one (25,), the posterior of the last image.
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: no observation yet, or arrays of incompatible shapes.
        """
        if self._foreground is None and self._depth is None:
            raise MotionError(NOTHING_OBSERVED)
        if not self._to_learn or not self.still:
            return
        from scipy.ndimage import binary_dilation

        self._to_learn = False
        poses = checked_poses(np.atleast_2d(poses))
        bare = background_shares(self._caster, self.skeleton, poses, log_weights, self.camera)
        self._background.learn(binary_dilation(bare < _BARE, iterations=max(1, round(_BESIDE * self.scale))))

    def __repr__(self) -> str:
        return f"SilhouetteLikelihood({self.camera.width}x{self.camera.height}, body of {self.skeleton.height:.2f} m)"

    def accepted(self, names: Collection[str]) -> list[str]:
        """Which of the available observations `names` are used: of mask, depth and rgb only the most informative."""
        spare = [name for name in ("mask", "depth", "rgb") if name in names][1:]
        return [name for name in super().accepted(names) if name not in spare]

    @property
    def measures_depth(self) -> bool:  # type: ignore[override]
        """Whether the current observation is a depth image."""
        return self._depth is not None

    @property
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel shows the body, from its own colour or depth.

        Raises:
            MotionError: no observation yet.
        """
        if self._depth is not None:
            return np.where(np.isnan(self._depth), 0.5, np.isfinite(self._depth))
        if self._foreground is not None:
            return self._foreground
        raise MotionError(NOTHING_OBSERVED)

    @property
    def scale(self) -> float:
        """Pixels per metre at the body."""
        distance = np.linalg.norm(self.camera.centre) if self.distance is None else self.distance
        return float(np.sqrt(abs(np.linalg.det(self.camera.K[:2, :2]))) / distance)

    @property
    def temper(self) -> float:
        """Factor on sums over pixels, at most 1."""
        if self.effective is None:
            return 1.0
        return min(1.0, self.effective / (_AREA * (self.skeleton.height * self.scale) ** 2))

    def log_likelihood(self, poses: ArrayLike) -> np.ndarray:
        """Log-likelihood (N,) of the current image given each of `poses` (N, 25) [m, rad].

        Raises:
            MotionError: no observation yet, poses of another shape, or non-finite values.
        """
        score, none = self._score()
        poses = checked_poses(poses)
        out = np.empty(len(poses))

        def work(start: int, stop: int) -> None:
            for i in range(start, stop, PIECE):
                some = slice(i, min(i + PIECE, stop))
                score(fast_limb_segments(poses[some], self.skeleton), out[some])

        self.workers.share(work, len(poses))
        out += none
        return out * self.temper

    def _score(self) -> tuple[Score, float]:
        from motionenv.likelihoods._silhouette_kernel import silhouette_sums

        if self._depth is not None:
            return self._depths(self._depth)
        odds, none = self.odds()
        return lambda ends, out: silhouette_sums(ends, self.skeleton.radii, *self.view, odds, out), none

    def odds(self) -> tuple[np.ndarray, float]:
        """Log-odds (height, width) of body against background, and the log-likelihood of background alone.

        Raises:
            MotionError: no mask or colours observed yet.
        """
        if self._odds is None:
            raise MotionError(NOTHING_OBSERVED)
        return self._odds

    def _log_odds(self, p: np.ndarray) -> tuple[np.ndarray, float]:
        pairs = (p[:-1] > 0.5) & (p[1:] > 0.5)  # a single pixel may be noise
        above = np.logical_or.accumulate(pairs[::-1])[::-1]
        self._in_view[:-1] |= above
        self._in_view[1:] |= above
        misses = self.misses if self.hidden is None else np.where(self._in_view, self.misses, self.hidden)
        alarms = self.false_alarms
        none = np.log(p * alarms + (1 - p) * (1 - alarms))
        return np.log(p * (1 - misses) + (1 - p) * misses) - none, float(none.sum())

    def _depths(self, observed: np.ndarray) -> tuple[Score, float]:
        from motionenv.likelihoods._depth_kernel import depth_sums

        seen, nothing = np.isfinite(observed), np.isposinf(observed)
        away = 1 / _DEPTH_RANGE
        peak = (1 - self.outliers) / (self.depth_noise * np.sqrt(2 * np.pi))
        found = (1 - self.misses) / (self.false_alarms * away)
        odds = np.array([np.log(self.misses / (1 - self.false_alarms)), found * peak, found * self.outliers * away])
        none = seen.sum() * np.log(self.false_alarms * away) + nothing.sum() * np.log(1 - self.false_alarms)
        args = (observed, odds, self.depth_noise)
        return lambda ends, out: depth_sums(ends, self.skeleton.radii, *self.view, *args, out), none

    def _not_background(self, rgb, background) -> np.ndarray:
        if background is None:
            self._background.observe(rgb)
            background = self._background.estimate()
        elif not np.isfinite(background).all():
            raise MotionError("background must be finite: omit it if it is unknown")
        return foreground_probability(rgb, background)

    def look(self, camera: Camera) -> None:
        """Set the camera.

        Args:
            camera: of the next image.

        Raises:
            MotionError: not a camera, or invalid intrinsics.
        """
        if not isinstance(camera, Camera):
            raise MotionError(f"camera must be a Camera, got {type(camera).__name__}")
        if not np.array_equal(camera.K[2], (0, 0, 1)) or abs(np.linalg.det(camera.K)) < 1e-12:
            raise MotionError(f"Camera.K must be invertible with last row (0, 0, 1), got {camera.K.tolist()}")
        self.camera = camera
        looking = [camera.height, camera.width, *camera.K.flat, *camera.R.flat, *camera.t.flat]
        if not self.still or looking != self._looking:
            self._in_view, self._looking = np.zeros((camera.height, camera.width), dtype=bool), looking
        # Rotate the camera frame so that K is upper triangular; pixels don't change.
        angle = np.arctan2(-camera.K[1, 0], camera.K[1, 1])
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
        k = camera.K @ turn.T
        self.view = (turn @ camera.R, turn @ camera.t, k, np.linalg.inv(k))


def fast_limb_segments(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Ends (n, limbs, 2, 3) [m] of the limbs: `motionenv.body.limb_segments`, eight times as fast.

    Args:
        poses: (n, 25) [m, rad], contiguous float64.
        skeleton: the body.
    """
    from motionenv.likelihoods._limbs_kernel import limb_ends

    ends = np.empty((len(poses), len(LIMBS), 2, 3))
    limb_ends(poses, skeleton.offsets, limb_shifts(skeleton), skeleton.height, ends)
    return ends


def checked_poses(poses: ArrayLike) -> np.ndarray:
    """Poses as a contiguous float64 array (N, 25).

    Raises:
        MotionError: another shape, or a non-finite number.
    """
    poses = np.ascontiguousarray(poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 25:
        raise MotionError(f"poses must have shape (N, 25), got {poses.shape}")
    if not np.isfinite(poses).all():
        i, j = np.argwhere(~np.isfinite(poses))[0].tolist()
        raise MotionError(f"poses must be finite; poses[{i}, {j}] is {poses[i, j]}")
    return poses


def _check_size(name: str, shape: tuple, size: tuple) -> None:
    if shape != size:
        raise MotionError(f"{name} must have the camera's (height, width) {size}, got {shape}")


def _probabilities(mask, size: tuple) -> np.ndarray:
    mask = np.asarray(mask)
    _check_size("mask", mask.shape, size)
    if mask.dtype.kind in "bui":
        return (mask != 0).astype(np.float64)
    if mask.dtype.kind != "f" or not ((mask >= 0) & (mask <= 1)).all():
        raise MotionError(f"mask must be bool, integers or probabilities from 0 to 1, got {mask.dtype}")
    return mask.astype(np.float64)


def _depths(depth, size: tuple) -> np.ndarray:
    """A depth image as float32, infinite where there is no body."""
    depth = np.asarray(depth)
    _check_size("depth", depth.shape, size)
    if depth.dtype.kind not in "fui" or (depth < 0).any():
        raise MotionError("depth must be at least 0 [m], infinite or 0 where there is no body, NaN where unknown")
    return np.where(depth == 0, np.inf, depth).astype(np.float32)


_DRAWN = 24  # rendered hypotheses


def background_shares(
    caster: Raycaster, body: Skeleton, poses: ArrayLike, log_weights: ArrayLike | None, camera: Camera
) -> np.ndarray:
    """Probability (height, width) that a pixel of `camera` shows no limb of `poses` (N, 25), or one (25,), of a `body`.

    `log_weights` (N,) are up to a constant, None is equal; MotionError for incompatible shapes.
    """
    poses = np.atleast_2d(np.asarray(poses, dtype=np.float64))
    logs = np.zeros(len(poses)) if log_weights is None else np.asarray(log_weights, dtype=np.float64)
    if logs.shape != (len(poses),) or not len(poses) or not np.isfinite(logs.max()):
        raise MotionError(f"log_weights must be ({len(poses)},), at least one above -inf, got {logs.shape}")
    total = np.cumsum(np.exp(logs - logs.max()))
    # Deterministic systematic resampling, so that repeated calls give the same result.
    drawn = np.searchsorted(total, total[-1] * (np.arange(_DRAWN) + 0.5) / _DRAWN)
    which, times = np.unique(drawn, return_counts=True)
    bare = caster.render(poses[which], body, camera, rgb=False).limbs == 0
    return np.tensordot(times / _DRAWN, bare, axes=1)
