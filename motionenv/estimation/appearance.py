r"""How likely the colours of a picture are, given a pose: each limb has colours of its own, and so has the background.

Colours are counted in histograms of 8³ bins: one per limb, and one for all that isn't body. A pixel on a limb says

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | background) + outliers]

and the log-likelihood, up to what doesn't hang on the pose, is the sum over a dozen points on each limb, each for its
share of the limb's pixels; points that a nearer limb hides don't count. So a dark arm before a bright torso tells
where it is, which silhouettes don't. `learn` counts the colours of poses that are believed, little by little: clothes
keep their colours, light changes. Only pixels count of which the belief is sure, so that one which doesn't know left
from right teaches nothing about them; and a limb that is hidden keeps the colours that it had. Before anything is
learned, colours say nothing.
"""

import os

import numpy as np

from motionenv.body import LIMBS
from motionenv.errors import MotionError
from motionenv.estimation.background import picture
from motionenv.estimation.believed import Believed
from motionenv.estimation.numeric import as_number
from motionenv.estimation.observation import (
    EFFECTIVE,
    NOTHING_OBSERVED,
    PIECE,
    ObservationModel,
    checked_poses,
    fast_limb_segments,
)
from motionenv.render._workers import Workers
from motionenv.types import Camera, Skeleton

_BINS = 8  # per colour channel
COLOURS = _BINS**3  # that are told apart
_SURE = 0.8  # share of a belief that must see the same limb at a pixel, for its colour to count
_POOL = 20.0  # pixels by which a limb's histogram leans towards the whole body's
_FLAT = 2.0  # pixels by which those lean towards any colour


class AppearanceModel:
    """Log-likelihood of colours given poses, by histograms per limb.

    Args:
        camera: that took the pictures; known to the agent.
        skeleton: the body of the hypotheses; None takes the average one, `from_height(1.75)`.
        outliers: share of pixels of a limb that have any colour.
        rate: share of what is known of a limb's colours that each `learn` replaces, where all of the limb is seen; the
            first pictures count alike.
        effective: how many of the body's pixels count as independent; None counts them all.
        distance: about how far the body is from the camera [m]; None takes that of the world's origin.
        threads: how many hypotheses are scored at a time, the same results with any number; None is one per core.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self,
        camera: Camera,
        skeleton: Skeleton | None = None,
        *,
        outliers: float = 0.1,
        rate: float = 0.05,
        effective: float | None = EFFECTIVE,
        distance: float | None = None,
        threads: int | None = None,
    ):
        if not 0 < as_number(outliers) < 1 or not 0 < as_number(rate) <= 1:
            raise MotionError(f"outliers and rate must be shares between 0 and 1, got {outliers!r} and {rate!r}")
        self._geometry = ObservationModel(camera, skeleton, effective=effective, distance=distance, threads=1)
        self.skeleton, self.outliers, self.rate = self._geometry.skeleton, outliers, rate
        self.workers = Workers(os.cpu_count() or 1 if threads is None else threads, "estimation")
        self._believed = Believed(self.skeleton)
        self.forget()

    def forget(self) -> None:
        """Drop the observation and all colours: a new episode begins."""
        self._rgb: np.ndarray | None = None
        self._counts = np.zeros((1 + len(LIMBS), COLOURS))  # of pixels of the background, and of each limb

    @property
    def camera(self) -> Camera:
        """That of the current picture."""
        return self._geometry.camera

    @property
    def temper(self) -> float:
        """What sums over pixels are multiplied with, at most 1."""
        return self._geometry.temper

    def observe(self, *, rgb, camera: Camera | None = None) -> None:
        """Take in the current picture; it replaces the one before.

        Args:
            rgb: uint8 (height, width, 3).
            camera: where the camera is now, if it moves.

        Raises:
            MotionError: a picture of another shape.
        """
        rgb, camera = picture(rgb), self.camera if camera is None else camera
        if rgb.shape[:2] != (camera.height, camera.width):
            raise MotionError(f"rgb must be of the camera's (height, width), got {rgb.shape[:2]}")
        self._geometry.look(camera)
        self._rgb = rgb

    def learn(self, poses, log_weights=None) -> None:
        """Count the colours of the current picture's limbs, where poses that are believed have them.

        Args:
            poses: (N, 25) [m, rad], or one (25,).
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: nothing observed yet, or arrays that don't go together.
        """
        if self._rgb is None:
            raise MotionError(NOTHING_OBSERVED)
        counts = self._counted(checked_poses(np.atleast_2d(poses)), log_weights)
        seen = counts.sum(axis=1, keepdims=True)
        self._counts = (1 - self.rate * seen / (seen + _POOL)) * self._counts + counts

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current colours given each of `poses` (N, 25) [m, rad], up to a constant.

        Raises:
            MotionError: nothing observed yet, poses of another shape, or numbers that aren't finite.
        """
        from motionenv.estimation._appearance_kernel import colour_sums

        if self._rgb is None:
            raise MotionError(NOTHING_OBSERVED)
        if not self._counts[1:].any():
            return np.zeros(len(checked_poses(poses)))
        odds = self._log_odds()[:, colour_bins(self._rgb)]
        poses = checked_poses(poses)
        out, radii, (r, t, k, _) = np.empty(len(poses)), self.skeleton.radii, self._geometry.view

        def work(start: int, stop: int) -> None:
            for i in range(start, stop, PIECE):
                some = slice(i, min(i + PIECE, stop))
                colour_sums(fast_limb_segments(poses[some], self.skeleton), radii, r, t, k, odds, out[some])

        self.workers.share(work, len(poses))
        return out * self.temper

    def _log_odds(self) -> np.ndarray:
        """Log-odds (limbs, bins) of a limb's colours against the background's."""
        background, limbs = self._counts[0], self._counts[1:]
        flat = 1 / limbs.shape[1]
        body = (limbs.sum(axis=0) + _FLAT * flat) / (limbs.sum() + _FLAT)
        limbs = (limbs + _POOL * body) / (limbs.sum(axis=1, keepdims=True) + _POOL)
        background = (background + _FLAT * flat) / (background.sum() + _FLAT)
        share = self.outliers
        return np.log(((1 - share) * limbs + share * background) / ((1 - share) * background + share * body))

    def _counted(self, poses: np.ndarray, log_weights) -> np.ndarray:
        """Pixels (1 + limbs, bins) of background and of each limb, by colour, as far as the belief is sure of them."""
        assert self._rgb is not None
        shares = self._believed.shares(poses, log_weights, self.camera)
        label = shares.argmax(axis=0)
        sure = np.take_along_axis(shares, label[None], axis=0)[0] >= _SURE
        cells = label[sure] * COLOURS + colour_bins(self._rgb)[sure]
        return np.bincount(cells, minlength=self._counts.size).astype(np.float64).reshape(self._counts.shape)


def colour_bins(rgb: np.ndarray) -> np.ndarray:
    """Number, below `COLOURS`, of the histogram's bin (height, width) of each colour.

    Args:
        rgb: uint8 (height, width, 3).
    """
    r, g, b = np.moveaxis(rgb.astype(np.int64) * _BINS // 256, -1, 0)
    return (r * _BINS + g) * _BINS + b
