r"""How likely the colours of a picture are, given a pose: each limb has colours of its own, and so has the background.

Colours are counted in histograms of 8³ bins: one per limb, and one for all that isn't body. A pixel on a limb says

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | background) + outliers]

and the log-likelihood, up to what doesn't hang on the pose, is the sum over a dozen points on each limb, each for its
share of the limb's pixels; points that a nearer limb hides don't count. So a dark arm before a bright torso tells
where it is, which silhouettes don't. `learn` counts the colours of poses that are believed, first of a given pose,
then little by little of the belief: clothes keep their colours, light changes.
"""

import os

import numpy as np

from motionenv.body import LIMBS
from motionenv.errors import MotionError
from motionenv.estimation.background import picture
from motionenv.estimation.observation import _PIECE, EFFECTIVE, ObservationModel, checked_poses, fast_limb_segments
from motionenv.render._workers import Workers
from motionenv.render.raycast import Raycaster
from motionenv.types import Camera, Skeleton

_BINS = 8  # per colour channel
_LEARNED = 32  # poses of a belief that are drawn
_POOL = 20.0  # pixels by which a limb's histogram leans towards the whole body's
_FLAT = 2.0  # pixels by which those lean towards any colour


class AppearanceModel:
    """Log-likelihood of colours given poses, by histograms per limb.

    Args:
        camera: that took the pictures; known to the agent.
        skeleton: the body of the hypotheses; None takes the average one, `from_height(1.75)`.
        outliers: share of pixels of a limb that have any colour.
        rate: share of the histograms that each later `learn` replaces.
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
        if not 0 < outliers < 1 or not 0 < rate <= 1:
            raise MotionError(f"outliers and rate must be shares between 0 and 1, got {outliers!r} and {rate!r}")
        self._geometry = ObservationModel(camera, skeleton, effective=effective, distance=distance, threads=1)
        self.skeleton, self.outliers, self.rate = self._geometry.skeleton, outliers, rate
        self._workers = Workers(os.cpu_count() or 1 if threads is None else threads, "estimation")
        self._caster = Raycaster(threads=1)
        self.forget()

    def forget(self) -> None:
        """Drop the observation and all colours: a new episode begins."""
        self._rgb: np.ndarray | None = None
        self._limbs: np.ndarray | None = None  # (limbs, bins) probabilities
        self._background: np.ndarray | None = None  # (bins,)

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
        self._geometry._look(camera)
        self._rgb = rgb

    def learn(self, poses, log_weights=None) -> None:
        """Count the colours of the current picture's limbs, where poses that are believed have them.

        The first time they are the model; later they replace the share `rate` of it.

        Args:
            poses: (N, 25) [m, rad], or one (25,).
            log_weights: (N,), up to a constant; None is equal weights. The heaviest count.

        Raises:
            MotionError: nothing observed yet, or arrays that don't go together.
        """
        if self._rgb is None:
            raise MotionError("nothing has been observed yet: call observe(rgb=…) first")
        poses = checked_poses(np.atleast_2d(poses))
        logs = np.zeros(len(poses)) if log_weights is None else np.asarray(log_weights, dtype=np.float64)
        if logs.shape != (len(poses),) or not len(poses) or not np.isfinite(logs.max()):
            raise MotionError(f"log_weights must be ({len(poses)},) with one above -inf at least, got {logs.shape}")
        heavy = np.argsort(-logs, kind="stable")[:_LEARNED]
        weights = np.exp(logs[heavy] - logs.max())
        counts = self._counted(poses[heavy], weights / weights.sum())
        body = counts[1:].sum(axis=0)
        body = (body + _FLAT / len(body)) / (body.sum() + _FLAT)
        limbs = (counts[1:] + _POOL * body) / (counts[1:].sum(axis=1, keepdims=True) + _POOL)
        background = (counts[0] + _FLAT / len(body)) / (counts[0].sum() + _FLAT)
        if self._limbs is None or self._background is None:
            self._limbs, self._background = limbs, background
        else:
            self._limbs = (1 - self.rate) * self._limbs + self.rate * limbs
            self._background = (1 - self.rate) * self._background + self.rate * background

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current colours given each of `poses` (N, 25) [m, rad], up to a constant.

        Raises:
            MotionError: nothing observed or learned yet, poses of another shape, or numbers that aren't finite.
        """
        from motionenv.estimation._appearance_kernel import colour_sums

        if self._rgb is None or self._limbs is None or self._background is None:
            raise MotionError("no colours are known yet: call observe(rgb=…), then learn(pose)")
        odds = np.log((1 - self.outliers) * self._limbs / self._background + self.outliers)[:, _bins(self._rgb)]
        poses = checked_poses(poses)
        out, radii, (r, t, k, _) = np.empty(len(poses)), self.skeleton.radii, self._geometry._view

        def work(start: int, stop: int) -> None:
            for i in range(start, stop, _PIECE):
                some = slice(i, min(i + _PIECE, stop))
                colour_sums(fast_limb_segments(poses[some], self.skeleton), radii, r, t, k, odds, out[some])

        self._workers.share(work, len(poses))
        return out * self.temper

    def _counted(self, poses: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weighted pixels (1 + limbs, bins) of background and of each limb, by colour."""
        assert self._rgb is not None
        labels = self._caster.render(poses, self.skeleton, self.camera, rgb=False).limbs
        cells = labels.astype(np.int64) * _BINS**3 + _bins(self._rgb)
        counts = np.zeros((1 + len(LIMBS), _BINS**3))
        for cell, weight in zip(cells, weights, strict=True):
            counts += weight * np.bincount(cell.ravel(), minlength=counts.size).reshape(counts.shape)
        return counts


def _bins(rgb: np.ndarray) -> np.ndarray:
    """Number of the histogram's bin (height, width) of each colour."""
    r, g, b = np.moveaxis(rgb.astype(np.int64) * _BINS // 256, -1, 0)
    return (r * _BINS + g) * _BINS + b
