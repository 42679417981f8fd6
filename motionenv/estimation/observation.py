r"""How likely a picture is, given a pose: the p(J_t | φ_t) of paper A, section 5, and p(I_t | φ_t) of paper C.

An `ObservationModel` knows what an agent may know: the camera, an average body, and the current observation. It scores
thousands of hypotheses against it without seeing the truth.

    >>> from motionenv.estimation import ObservationModel
    >>> from motionenv.render.cameras import view
    >>> model = ObservationModel(view(0.0, width=64, height=64))
    >>> model.observe(mask=mask)                      # or depth=…, or rgb=…, background=…
    >>> model.log_likelihood(poses)                   # (N, 25) -> (N,)
    >>> model.learn(poses, log_weights)               # where the background isn't given: it is beside the body

**Silhouette.** A pixel is seen as foreground (y = 1) with probability 1 - misses where the hypothesis has the body,
and with probability false_alarms where it hasn't. Colours don't tell y for certain but with a probability p, so

    p(pixel | body) = p (1 - misses) + (1 - p) misses,    p(pixel | none) = p false_alarms + (1 - p)(1 - false_alarms)

Both rates are the robust part: no pixel, and so no occluder, counts for more than its log-odds. The log-likelihood is
the sum of log p(pixel | none) plus the log-odds of the pixels in the hypothesis' silhouette: one pass over the outline.
Where something known stands in the way, pixels are `unseen`: they say nothing, p = ½. (To learn it from pixels that the
belief covers but that aren't foreground, doesn't help: by then the belief has gone astray.)

**Depth.** Where both hypothesis and picture have a body, the observed depth is Gaussian about the hypothesis', or, with
the share `outliers`, anywhere within `_DEPTH_RANGE` metres; misses and false alarms are as above.

**Tempering.** Neighbouring pixels aren't independent: a wrong thickness of the body errs along whole outlines. So the
sum over the picture's pixels is scaled as if only `effective` of those that the body takes were independent.
"""

import os
from collections.abc import Callable

import numpy as np

from motionenv.body import LIMBS, from_height
from motionenv.body.skeleton import LIMB_SHIFTS
from motionenv.errors import MotionError
from motionenv.estimation.background import Background, foreground_probability, picture
from motionenv.estimation.believed import Believed
from motionenv.estimation.numeric import as_number
from motionenv.render._workers import Workers
from motionenv.types import Camera, Skeleton

#: Effective number of independent pixels of a body, as benchmarks/likelihood.py measures it: with walkers of random
#: height (1.72 ± 0.09 m) and girth (± 10 %), and weighted hypotheses with the average body, the energy score was best
#: and 90 % intervals held 95 % of the truths with about 8 for masks, at every size of the body from 20 to 216 pixels,
#: in pictures of 64² and 128²; with about 4 for depths; and with fewer where something hid half of the bodies. With 32,
#: intervals for masks held 60 to 86 %. So what errs is the shape of the body, whatever the resolution.
EFFECTIVE = 6.0

_AREA = 0.14  # of a silhouette, in squares of the body's height; walkers seen from all sides
NOTHING_OBSERVED = "nothing has been observed yet: call observe(mask=… or rgb=… or depth=…) first"
PIECE = 256  # hypotheses at a time: enough to hide the calls, few enough to stay in a core's cache
_BARE = 0.99  # share of a belief that must see no body at a pixel, for it to be background
_BESIDE = 0.05  # [m] by which bodies may be thicker than believed, when the background beside them is learned
_DEPTH_RANGE = 4.0  # [m] over which depths that fit nothing are spread

#: Writes the log-odds (n,) of bodies whose limbs' ends are (n, limbs, 2, 3).
Score = Callable[[np.ndarray, np.ndarray], None]


class ObservationModel:
    """Log-likelihood of pictures given poses.

    Args:
        camera: that took the pictures; known to the agent.
        skeleton: the body of the hypotheses; None takes the average one, `from_height(1.75)`, for the true one isn't
            the agent's to know.
        misses: probability that a pixel of the body is seen as background, 0 to 1.
        false_alarms: probability that a pixel of the background is seen as foreground, 0 to 1.
        depth_noise: standard deviation of depths, of the sensor and of the body's shape [m].
        outliers: share of depths that are off by any amount.
        effective: how many of the body's pixels count as independent (see `EFFECTIVE`); None counts them all.
        distance: about how far the body is from the camera [m], which says how many pixels it takes; None takes the
            distance from the camera to the world's origin.
        still: False for a camera whose background moves, as one that follows the walker; matters to `rgb` without a
            given background.
        threads: how many hypotheses are scored at a time, the same results with any number; None is one per core.

    Raises:
        MotionError: an argument out of range.

    Attributes:
        camera: of the current picture.
        view: R, t, K and its inverse for kernels, so turned that K is upper triangular.
        workers: the threads.
    """

    #: Of these `observe` takes one; the first says most.
    one_of = ("mask", "depth", "rgb")

    def __init__(
        self,
        camera: Camera,
        skeleton: Skeleton | None = None,
        *,
        misses: float = 0.2,
        false_alarms: float = 0.1,
        depth_noise: float = 0.05,
        outliers: float = 0.05,
        effective: float | None = EFFECTIVE,
        distance: float | None = None,
        still: bool = True,
        threads: int | None = None,
    ):
        for name, rate in (("misses", misses), ("false_alarms", false_alarms), ("outliers", outliers)):
            if not 0 < as_number(rate) < 0.5:
                raise MotionError(f"{name} must be a probability between 0 and 0.5, got {rate!r}")
        positive = {"depth_noise": depth_noise, "effective": effective, "distance": distance}
        for name, value in positive.items():
            if value is not None and not 0 < as_number(value) < np.inf:
                raise MotionError(f"{name} must be a finite number above 0, got {value!r}")
        self.skeleton = from_height() if skeleton is None else skeleton
        if self.skeleton.radii.shape != (len(LIMBS), 2) or not (self.skeleton.radii > 0).all():
            raise MotionError(f"Skeleton.radii must be {len(LIMBS)} pairs above 0, got {self.skeleton.radii.shape}")
        self.misses, self.false_alarms = misses, false_alarms
        self.depth_noise, self.outliers = depth_noise, outliers
        self.effective, self.distance = effective, distance
        self.workers = Workers(os.cpu_count() or 1 if threads is None else threads, "estimation")
        self.still, self._believed = still, Believed(self.skeleton)
        self.look(camera)
        self.forget()

    def forget(self) -> None:
        """Drop the observation and the background seen so far: a new episode begins."""
        self._background = Background(still=self.still)
        self._foreground: np.ndarray | None = None
        self._depth: np.ndarray | None = None
        self._odds: tuple[np.ndarray, float] | None = None
        self._to_learn = False

    def observe(
        self, *, mask=None, rgb=None, depth=None, background=None, unseen=None, camera: Camera | None = None
    ) -> None:
        """Take in the current picture, one of `mask`, `rgb` and `depth`; it replaces the one before.

        Args:
            mask: (height, width), bool or whole numbers (0 is background), or probabilities of foreground as floats.
            rgb: uint8 (height, width, 3).
            depth: (height, width) [m] along the camera's z; infinite, or 0, where there is no body.
            background: (height, width, 3), what `rgb` shows without the body; None estimates it from the pictures
                so far, see `motionenv.estimation.background.Background`.
            unseen: bool (height, width), where nothing of the body could be seen, for something stands before it;
                such pixels say nothing. None is nowhere.
            camera: where the camera is now, if it moves.

        Raises:
            MotionError: none of the three or several, or one of a shape or with numbers that can't be.
        """
        given = [name for name, value in (("mask", mask), ("rgb", rgb), ("depth", depth)) if value is not None]
        if len(given) != 1:
            raise MotionError(f"observe needs one of mask, rgb and depth, got {' and '.join(given) or 'none'}")
        if background is not None and rgb is None:
            raise MotionError("background goes with rgb only: leave it out")
        camera = self.camera if camera is None else camera
        size = (camera.height, camera.width)
        foreground = depths = None
        if mask is not None:
            foreground = _probabilities(mask, size)
        elif depth is not None:
            depths = _depths(depth, size)
        else:
            _check_size("rgb", picture(rgb).shape[:2], size)
            foreground = self._not_background(rgb, background)
        self.look(camera)
        self._to_learn = rgb is not None and background is None
        if unseen is not None:
            nothing = checked_unseen(unseen, size)
            foreground = None if foreground is None else np.where(nothing, 0.5, foreground)
            depths = None if depths is None else np.where(nothing, np.float32(np.nan), depths)
        self._foreground, self._depth = foreground, depths
        self._odds = None if foreground is None else self._log_odds(foreground)

    def learn(self, poses, log_weights=None) -> None:
        """Take the last picture's pixels beside the body for background, where that isn't given.

        Args:
            poses: (N, 25) [m, rad], or one (25,), of a belief about the last picture.
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: nothing observed yet, or arrays that don't go together.
        """
        if self._foreground is None and self._depth is None:
            raise MotionError(NOTHING_OBSERVED)
        if not self._to_learn or not self.still:
            return
        from scipy.ndimage import binary_dilation

        self._to_learn = False
        body = self._believed.shares(checked_poses(np.atleast_2d(poses)), log_weights, self.camera)[0] < _BARE
        self._background.learn(binary_dilation(body, iterations=max(1, round(_BESIDE * self.scale))))

    @property
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel shows the body, as far as its own colour or depth tells.

        Raises:
            MotionError: nothing observed yet.
        """
        if self._depth is not None:
            return np.where(np.isnan(self._depth), 0.5, np.isfinite(self._depth))
        if self._foreground is not None:
            return self._foreground
        raise MotionError(NOTHING_OBSERVED)

    @property
    def silhouettes(self) -> bool:
        """Whether a mask or colours have been observed last, rather than a depth or nothing."""
        return self._foreground is not None

    @property
    def scale(self) -> float:
        """Pixels per metre at the body."""
        distance = np.linalg.norm(self.camera.centre) if self.distance is None else self.distance
        return float(np.sqrt(abs(np.linalg.det(self.camera.K[:2, :2]))) / distance)

    @property
    def temper(self) -> float:
        """What sums over pixels are multiplied with, at most 1."""
        if self.effective is None:
            return 1.0
        return min(1.0, self.effective / (_AREA * (self.skeleton.height * self.scale) ** 2))

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current picture given each of `poses` (N, 25) [m, rad].

        Raises:
            MotionError: nothing observed yet, poses of another shape, or numbers that aren't finite.
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
        """A function that writes log-odds of bodies, and the log-likelihood of the picture without a body."""
        if self._depth is not None:
            return self._depths(self._depth)
        if self._foreground is not None:
            return self._silhouettes()
        raise MotionError(NOTHING_OBSERVED)

    def odds(self) -> tuple[np.ndarray, float]:
        """Log-odds (height, width) of body against background, and the log-likelihood of background alone.

        Raises:
            MotionError: no mask or colours observed yet.
        """
        if self._odds is None:
            raise MotionError(NOTHING_OBSERVED)
        return self._odds

    def _log_odds(self, p: np.ndarray) -> tuple[np.ndarray, float]:
        """`odds` of probabilities of foreground (height, width)."""
        misses, alarms = self.misses, self.false_alarms
        none = np.log(p * alarms + (1 - p) * (1 - alarms))
        return np.log(p * (1 - misses) + (1 - p) * misses) - none, float(none.sum())

    def _silhouettes(self) -> tuple[Score, float]:
        """`_score` of probabilities of foreground."""
        from motionenv.estimation._silhouette_kernel import silhouette_sums

        odds, none = self.odds()
        return lambda ends, out: silhouette_sums(ends, self.skeleton.radii, *self.view, odds, out), none

    def _depths(self, observed: np.ndarray) -> tuple[Score, float]:
        """`_score` of depths (height, width)."""
        from motionenv.estimation._depth_kernel import depth_sums

        seen, nothing = np.isfinite(observed), np.isposinf(observed)
        away = 1 / _DEPTH_RANGE
        peak = (1 - self.outliers) / (self.depth_noise * np.sqrt(2 * np.pi))
        found = (1 - self.misses) / (self.false_alarms * away)
        odds = np.array([np.log(self.misses / (1 - self.false_alarms)), found * peak, found * self.outliers * away])
        none = seen.sum() * np.log(self.false_alarms * away) + nothing.sum() * np.log(1 - self.false_alarms)
        args = (observed, odds, self.depth_noise)
        return lambda ends, out: depth_sums(ends, self.skeleton.radii, *self.view, *args, out), none

    def _not_background(self, rgb, background) -> np.ndarray:
        """Probability (height, width) that pixels of `rgb` aren't background."""
        if background is None:
            self._background.observe(rgb)
            background = self._background.estimate()
        elif not np.isfinite(background).all():
            raise MotionError("background must be finite: leave it out where it isn't known")
        return foreground_probability(rgb, background)

    def look(self, camera: Camera) -> None:
        """Take over a camera.

        Args:
            camera: that the next picture comes from.

        Raises:
            MotionError: not a camera, or one of impossible intrinsics.
        """
        if not isinstance(camera, Camera):
            raise MotionError(f"camera must be a motionenv Camera, got {type(camera).__name__}")
        if not np.array_equal(camera.K[2], (0, 0, 1)) or abs(np.linalg.det(camera.K)) < 1e-12:
            raise MotionError(f"Camera.K must be invertible with last row (0, 0, 1), got {camera.K.tolist()}")
        self.camera = camera
        # The same pixels, so turned that K is upper triangular.
        angle = np.arctan2(-camera.K[1, 0], camera.K[1, 1])
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
        k = camera.K @ turn.T
        self.view = (turn @ camera.R, turn @ camera.t, k, np.linalg.inv(k))


def fast_limb_segments(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Ends (n, limbs, 2, 3) [m] of the limbs: `motionenv.body.limb_segments`, in an eighth of its time.

    Args:
        poses: (n, 25) [m, rad], contiguous float64.
        skeleton: the body.
    """
    from motionenv.estimation._limbs_kernel import limb_ends

    ends = np.empty((len(poses), len(LIMBS), 2, 3))
    limb_ends(poses, skeleton.offsets, LIMB_SHIFTS, skeleton.height, ends)
    return ends


def checked_poses(poses) -> np.ndarray:
    """Poses as a contiguous float64 array (N, 25).

    Raises:
        MotionError: another shape, or a number that isn't finite.
    """
    poses = np.ascontiguousarray(poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 25:
        raise MotionError(f"poses must have shape (N, 25), got {poses.shape}")
    if not np.isfinite(poses).all():
        i, j = np.argwhere(~np.isfinite(poses))[0].tolist()
        raise MotionError(f"poses must be finite to be scored; poses[{i}, {j}] is {poses[i, j]}")
    return poses


def _check_size(name: str, shape: tuple, size: tuple) -> None:
    if shape != size:
        raise MotionError(f"{name} must be of the camera's (height, width) {size}, got {shape}")


def checked_unseen(unseen, size: tuple) -> np.ndarray:
    """Where nothing can be seen, bool (height, width).

    Args:
        unseen: as `observe` was given it.
        size: (height, width) of the camera's pictures.

    Raises:
        MotionError: another size, or not bool.
    """
    unseen = np.asarray(unseen)
    _check_size("unseen", unseen.shape, size)
    if unseen.dtype != np.bool_:
        raise MotionError(f"unseen must be bool (height, width), got {unseen.dtype}")
    return unseen


def _probabilities(mask, size: tuple) -> np.ndarray:
    """A mask as probabilities of foreground."""
    mask = np.asarray(mask)
    _check_size("mask", mask.shape, size)
    if mask.dtype.kind in "bui":
        return (mask != 0).astype(np.float64)
    if mask.dtype.kind != "f" or not ((mask >= 0) & (mask <= 1)).all():
        raise MotionError(f"mask must be bool, whole numbers or probabilities from 0 to 1, got {mask.dtype}")
    return mask.astype(np.float64)


def _depths(depth, size: tuple) -> np.ndarray:
    """A depth picture as float32, infinite where there is no body."""
    depth = np.asarray(depth)
    _check_size("depth", depth.shape, size)
    if depth.dtype.kind not in "fui" or np.isnan(depth).any() or (depth < 0).any():
        raise MotionError("depth must be metres from 0, infinite or 0 where there is no body, and hold no NaN")
    return np.where(depth > 0, depth, np.inf).astype(np.float32)
