"""Marker likelihood: 2D marker positions with noise, gaps and outliers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, is_number
from motionenv.body import from_height, markers
from motionenv.errors import MotionError
from motionenv.likelihoods.base import Likelihood
from motionenv.likelihoods.silhouette import checked_poses
from motionenv.render.cameras import Orthographic, orthographic, project
from motionenv.types import Camera, Skeleton

_AREA = 4.0  # [m²] area over which outliers are uniform, for images in metres


class MarkerLikelihood(Likelihood):
    """Log-likelihood of the 15 markers of an image given poses.

    A visible marker has Gaussian noise about its projected position; with probability `outliers` it is uniformly
    distributed over the image, so that no single marker can rule out a hypothesis. Missing markers are ignored.

    Args:
        view: a `Camera`, an `Orthographic` view, or paper B's view angle α [rad] for points in metres, z upwards, as in
            `motionenv.render.cameras.orthographic`.
        skeleton: the body of the hypotheses; None uses the average one, `from_height(1.75)`.
        noise: standard deviation of each coordinate, including the body's shape, in the image's unit; None is 0.03 m in
            metres, and 1.5 % of the image height in pixels.
        outliers: probability of an outlier, 0 to 1.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self, view: Camera | Orthographic | float, skeleton: Skeleton | None = None, *, noise: float | None = None,
        outliers: float = 0.02,
    ) -> None:  # fmt: skip
        if not isinstance(view, Camera | Orthographic) and not (is_number(view) and math.isfinite(view)):
            raise MotionError(f"view must be a Camera, an Orthographic, or a finite angle [rad], got {view!r}")
        self.view = view
        self.camera = view if isinstance(view, Camera) else None
        self.skeleton: Skeleton = from_height() if skeleton is None else skeleton
        self.outliers = checked_number(outliers, "outliers", above=0, below=1)
        usual, self._area = 0.03, _AREA
        if isinstance(view, Camera | Orthographic):
            usual, self._area = 0.015 * view.height, float(view.width * view.height)
        self.noise = usual if noise is None else checked_number(noise, "noise", above=0)
        self._points: np.ndarray | None = None

    def __repr__(self) -> str:
        unit = "pixels" if isinstance(self.view, Camera | Orthographic) else "m"
        return f"MarkerLikelihood(noise {self.noise:g} {unit}, body of {self.skeleton.height:.2f} m)"

    def observe(self, points: ArrayLike, seen: ArrayLike | None = None) -> None:
        """Set the current `points` (15, 2); missing ones are NaN or not `seen` (15,).

        Raises:
            MotionError: wrong shapes, or infinite values.
        """
        points = np.array(points, dtype=np.float64)
        seen = np.ones(15, bool) if seen is None else np.asarray(seen, dtype=bool)
        if points.shape != (15, 2) or seen.shape != (15,):
            raise MotionError(
                f"points must have shape (15, 2) and seen (15,), got {points.shape} and {seen.shape}: pass one frame "
                "at a time"
            )
        points[~seen] = np.nan
        if np.isinf(points).any():
            raise MotionError("points must be finite where seen; set others to NaN, or seen to False")
        self._points = points

    def log_likelihood(self, poses: ArrayLike) -> np.ndarray:
        """Log-likelihood (N,) of the current points given each of `poses` (N, 25) [m, rad].

        Raises:
            MotionError: no observation yet, wrong shapes, or non-finite values.
        """
        if self._points is None:
            raise MotionError("no points have been observed yet: call observe(points) first")
        joints = markers(checked_poses(poses), self.skeleton)
        if isinstance(self.view, Camera | Orthographic):
            shown = project(joints, self.view)[0]
        else:
            shown = orthographic(joints, float(self.view))
        square = ((shown - self._points) ** 2).sum(-1) / self.noise**2
        peak = (1 - self.outliers) / (2 * np.pi * self.noise**2)
        square = np.where(np.isnan(shown).any(-1), np.inf, square)  # behind the camera: not in the image
        each = np.log(peak * np.exp(-0.5 * square) + self.outliers / self._area)
        return each[:, ~np.isnan(self._points).any(-1)].sum(-1)
