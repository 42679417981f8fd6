r"""Colour likelihood: colour histograms for each limb and for the background.

Histograms have 8³ bins: one per limb, and one for everything that isn't body. A pixel on a limb contributes

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | background) + outliers]

The log-likelihood, up to a constant, is the sum over a dozen points on each limb, each weighted by its share of the
limb's pixels; points that a nearer limb occludes don't count. A dark arm in front of a bright torso is thereby located,
which silhouettes can't do. `learn` updates the histograms slowly from a posterior: clothes keep their colours, light
changes. Only pixels about which the posterior is certain are used, so an undecided posterior doesn't mix left and
right; occluded limbs keep their colours. Before the first update, all poses are equally likely.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_number
from motionenv.body import LIMBS
from motionenv.errors import MotionError
from motionenv.likelihoods.background import picture
from motionenv.likelihoods.base import Likelihood
from motionenv.likelihoods.silhouette import (
    EFFECTIVE,
    NOTHING_OBSERVED,
    PIECE,
    LimbPosterior,
    SilhouetteLikelihood,
    checked_poses,
    fast_limb_segments,
)
from motionenv.types import Camera, Skeleton

_BINS = 8  # per colour channel
COLOURS = _BINS**3  # bins of a histogram
_SURE = 0.8  # least posterior probability of a limb at a pixel for its colour to count
_POOL = 20.0  # pseudo-count [pixels] that shrinks a limb's histogram towards the whole body's
_FLAT = 2.0  # pseudo-count [pixels] that shrinks those towards the uniform distribution


class AppearanceLikelihood(Likelihood):
    """Log-likelihood of colours given poses, by histograms per limb.

    Args:
        camera: of the images.
        skeleton: the body of the hypotheses; None uses the average one, `from_height(1.75)`.
        outliers: fraction of a limb's pixels that may have any colour.
        rate: learning rate of the histograms per `learn`, for a fully visible limb; the first images are averaged.
        effective: effective number of independent pixels of the body; None counts all pixels.
        distance: approximate distance of the body from the camera [m]; None uses that of the world's origin.
        threads: number of threads, which doesn't change the result; None uses one per core.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self, camera: Camera, skeleton: Skeleton | None = None, *, outliers: float = 0.1, rate: float = 0.05,
        effective: float | None = EFFECTIVE, distance: float | None = None, threads: int | None = None,
    ) -> None:  # fmt: skip
        checked_number(outliers, "outliers", above=0, below=1)
        checked_number(rate, "rate", high=1, above=0)
        self._geometry = SilhouetteLikelihood(camera, skeleton, effective=effective, distance=distance, threads=1)
        self.skeleton: Skeleton = self._geometry.skeleton
        self.outliers, self.rate = outliers, rate
        self.workers = Workers(threads, "estimation")
        self._believed = LimbPosterior(self.skeleton)
        self.forget()

    def forget(self) -> None:
        self._rgb: np.ndarray | None = None
        self._counts = np.zeros((1 + len(LIMBS), COLOURS))  # pixel counts of the background and of each limb

    def __repr__(self) -> str:
        return f"AppearanceLikelihood({self.camera.width}x{self.camera.height}, body of {self.skeleton.height:.2f} m)"

    @property
    def camera(self) -> Camera:  # type: ignore[override]
        """Camera of the current image."""
        return self._geometry.camera

    @property
    def temper(self) -> float:
        """Factor on sums over pixels, at most 1."""
        return self._geometry.temper

    def observe(self, *, rgb: np.ndarray, camera: Camera | None = None) -> None:
        """Set the current image.

        Args:
            rgb: uint8 (height, width, 3).
            camera: current camera, if it moves.

        Raises:
            MotionError: an image of another shape.
        """
        rgb, camera = picture(rgb), self.camera if camera is None else camera
        if rgb.shape[:2] != (camera.height, camera.width):
            raise MotionError(f"rgb must have the camera's (height, width), got {rgb.shape[:2]}")
        self._geometry.look(camera)
        self._rgb = rgb

    def learn(self, poses: ArrayLike, log_weights: np.ndarray | None = None) -> None:
        """Update the histograms from the current image and its posterior.

        Args:
            poses: (N, 25) [m, rad], or one (25,).
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: no observation yet, or arrays of incompatible shapes.
        """
        if self._rgb is None:
            raise MotionError(NOTHING_OBSERVED)
        counts = self._counted(checked_poses(np.atleast_2d(poses)), log_weights)
        seen = counts.sum(axis=1, keepdims=True)
        self._counts = (1 - self.rate * seen / (seen + _POOL)) * self._counts + counts

    def log_likelihood(self, poses: ArrayLike) -> np.ndarray:
        """Log-likelihood (N,) of the current colours given each of `poses` (N, 25) [m, rad], up to a constant.

        Raises:
            MotionError: no observation yet, poses of another shape, or non-finite values.
        """
        from motionenv.likelihoods._appearance_kernel import colour_sums

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
        """Pixel counts (1 + limbs, bins) of background and limbs where the posterior is certain."""
        assert self._rgb is not None
        shares = self._believed.shares(poses, log_weights, self.camera)
        label = shares.argmax(axis=0)
        sure = np.take_along_axis(shares, label[None], axis=0)[0] >= _SURE
        cells = label[sure] * COLOURS + colour_bins(self._rgb)[sure]
        return np.bincount(cells, minlength=self._counts.size).astype(np.float64).reshape(self._counts.shape)


def colour_bins(rgb: np.ndarray) -> np.ndarray:
    """Histogram bin (height, width), below `COLOURS`, of each pixel of `rgb`, uint8 (height, width, 3)."""
    r, g, b = np.moveaxis(rgb.astype(np.int64) * _BINS // 256, -1, 0)
    return (r * _BINS + g) * _BINS + b
