"""Posterior probability of each limb at each pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body import LIMBS
from motionenv.errors import MotionError
from motionenv.render.raycast.engine import Raycaster
from motionenv.types import Camera, Skeleton

_DRAWN = 24  # rendered hypotheses


class LimbPosterior:
    """Renders hypotheses drawn from a posterior, for likelihoods that adapt to it.

    Args:
        skeleton: the body of the hypotheses.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self._caster = Raycaster(threads=1)

    def shares(self, poses: ArrayLike, log_weights: ArrayLike | None, camera: Camera) -> np.ndarray:
        """Probability (1 + limbs, height, width) that a pixel shows no limb, or each of the limbs.

        Args:
            poses: (N, 25) [m, rad], or one (25,).
            log_weights: (N,), up to a constant; None is equal weights.
            camera: the view.

        Raises:
            MotionError: arrays of incompatible shapes.
        """
        poses = np.atleast_2d(np.asarray(poses, dtype=np.float64))
        logs = np.zeros(len(poses)) if log_weights is None else np.asarray(log_weights, dtype=np.float64)
        if logs.shape != (len(poses),) or not len(poses) or not np.isfinite(logs.max()):
            raise MotionError(f"log_weights must be ({len(poses)},), at least one above -inf, got {logs.shape}")
        total = np.cumsum(np.exp(logs - logs.max()))
        # Deterministic systematic resampling, so that repeated calls give the same result.
        drawn = np.searchsorted(total, total[-1] * (np.arange(_DRAWN) + 0.5) / _DRAWN)
        which, times = np.unique(drawn, return_counts=True)
        labels = self._caster.render(poses[which], self.skeleton, camera, rgb=False).limbs
        pixels = camera.height * camera.width
        cells = labels.reshape(len(which), -1) * np.int64(pixels) + np.arange(pixels)
        weights = np.repeat(times / _DRAWN, pixels)
        shares = np.bincount(cells.ravel(), weights, minlength=(1 + len(LIMBS)) * pixels)
        return shares.reshape(-1, camera.height, camera.width)
