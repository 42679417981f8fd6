"""How likely 2D markers are, given a pose: paper B's point lights as an observation with noise, gaps and mistakes."""

import math

import numpy as np

from motionenv.body import from_height, markers
from motionenv.errors import MotionError
from motionenv.estimation.numeric import as_number
from motionenv.estimation.observation import checked_poses
from motionenv.render.cameras import Orthographic, orthographic, project
from motionenv.types import Camera, Skeleton

_AREA = 4.0  # [m²] over which mistakes are spread in a picture in metres


class MarkerModel:
    """Log-likelihood of the 15 markers of a picture given poses.

    A marker that is seen lies where the hypothesis has it, with Gaussian noise; or, with the share `outliers`, anywhere
    in the picture, so that no marker can rule a hypothesis out. Markers that aren't seen say nothing.

    Args:
        view: a `Camera`, an `Orthographic` view, or paper B's view angle α [rad] for points in metres, z upwards, as
            `motionenv.render.cameras.orthographic` gives them.
        skeleton: the body of the hypotheses; None takes the average one, `from_height(1.75)`.
        noise: standard deviation of each coordinate, of the marker and of the body's shape, in the picture's unit;
            None is 0.03 m in metres, and 1.5 % of the picture's height in pixels.
        outliers: share of the markers that are anywhere, 0 to 1.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self,
        view: Camera | Orthographic | float,
        skeleton: Skeleton | None = None,
        *,
        noise: float | None = None,
        outliers: float = 0.02,
    ):
        metric = not isinstance(view, Camera | Orthographic)
        if metric and (isinstance(view, bool) or not isinstance(view, int | float) or not math.isfinite(view)):
            raise MotionError(f"view must be a Camera, an Orthographic, or an angle in radians, got {view!r}")
        if not 0 < as_number(outliers) < 1:
            raise MotionError(f"outliers must be a share between 0 and 1, got {outliers!r}")
        if noise is not None and not 0 < as_number(noise) < np.inf:
            raise MotionError(f"noise must be a finite number above 0, got {noise!r}")
        self.view = view
        self.skeleton = from_height() if skeleton is None else skeleton
        self.outliers = outliers
        if isinstance(view, Camera | Orthographic):
            self.noise = 0.015 * view.height if noise is None else noise
            self._area = float(view.width * view.height)
        else:
            self.noise, self._area = 0.03 if noise is None else noise, _AREA
        self._points: np.ndarray | None = None

    def observe(self, points, seen=None) -> None:
        """Take in the current `points` (15, 2), NaN or not `seen` (15,) where there are none; replaces those before.

        Raises:
            MotionError: other shapes, or infinite numbers.
        """
        points = np.array(points, dtype=np.float64)
        seen = np.ones(15, bool) if seen is None else np.asarray(seen, dtype=bool)
        if points.shape != (15, 2) or seen.shape != (15,):
            raise MotionError(
                f"points must have shape (15, 2) and seen (15,), got {points.shape} and {seen.shape}: one picture at "
                "a time"
            )
        points[~seen] = np.nan
        if np.isinf(points).any():
            raise MotionError("points must be finite where they are seen; mark others as NaN, or as not seen")
        self._points = points

    def log_likelihood(self, poses, alpha=None) -> np.ndarray:
        """Log-likelihood (N,) of the current points given each of `poses` (N, 25) [m, rad].

        Args:
            poses: the hypotheses.
            alpha: (N,) [rad], each hypothesis' own view angle, where the view is an angle; None takes the model's.

        Raises:
            MotionError: nothing observed yet, other shapes, numbers that aren't finite, or `alpha` with a camera.
        """
        if self._points is None:
            raise MotionError("no points have been observed yet: call observe(points) first")
        shown = self._project(markers(checked_poses(poses), self.skeleton), alpha)
        square = ((shown - self._points) ** 2).sum(-1) / self.noise**2
        peak = (1 - self.outliers) / (2 * np.pi * self.noise**2)
        square = np.where(np.isnan(shown).any(-1), np.inf, square)  # behind the camera: nowhere in the picture
        each = np.log(peak * np.exp(-0.5 * square) + self.outliers / self._area)
        return each[:, ~np.isnan(self._points).any(-1)].sum(-1)

    def _project(self, points: np.ndarray, alpha) -> np.ndarray:
        """Where 3D points (N, 15, 3) are seen, (N, 15, 2)."""
        if isinstance(self.view, Camera | Orthographic):
            if alpha is not None:
                raise MotionError("alpha goes with a view angle; the hypotheses' heading does the same for a camera")
            return project(points, self.view)[0]
        alpha = np.full(len(points), float(self.view)) if alpha is None else np.asarray(alpha, dtype=np.float64)
        if alpha.shape != (len(points),) or not np.isfinite(alpha).all():
            raise MotionError(f"alpha must be {len(points)} finite angles, got shape {alpha.shape}")
        return orthographic(points, alpha[:, None])
