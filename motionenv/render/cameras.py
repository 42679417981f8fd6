r"""Where the picture is taken from: builders of `types.Camera`, and paper B's orthographic views.

World: x forward (the direction of walking), y left, z up. Cameras follow OpenCV: x right, y down, z into the
scene, pixel centres at whole numbers. The view angle α is paper B's (Zhang & Troje 2006, appendix B): the
picture's horizontal axis is cos α·x + sin α·y, and the vertical one is z. From above:

                 y (left)                       α = +90°: from the front; the walker's left is right
                 ^                              in the picture
                 |
            o====|====o  shoulders
                 |  \
      walker     +---\-----------> x (forward)  <--- camera at α = +90°
                 |    \
                 |     image axis at α = 0: +x to the right
                 |
                 ^ camera at α = 0: from the walker's right side, who walks to the right in the picture;
                   α = ±180° is the other side, α = -90° from behind

The camera stands at target + distance·(sin α, -cos α, 0) and looks along (-sin α, cos α, 0).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionenv.errors import GapError, MotionError
from motionenv.types import Camera, Motion, frozen

_NEAREST = 0.1  # metres that `fit` keeps between the camera and the nearest point


def look_at(eye, target, *, width: int = 640, height: int = 480, fov_degrees: float = 40.0, up=(0, 0, 1)) -> Camera:
    """A camera at `eye` that has `target` in the middle of its picture.

    Args:
        eye: (3,) [m] where the camera stands.
        target: (3,) [m] the point it looks at.
        width: picture width [pixels].
        height: picture height [pixels].
        fov_degrees: vertical field of view [degrees], over the whole picture from edge to edge.
        up: (3,) direction that points up in the picture.

    Raises:
        MotionError: eye and target coincide, or the camera would look along `up`, or the field of view isn't
            between 0 and 180 degrees.
    """
    eye, target, up = (frozen(v, (3,), n) for v, n in ((eye, "eye"), (target, "target"), (up, "up")))
    forward = target - eye
    right = np.cross(forward, up)
    if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise MotionError(
            f"can't look from {eye.tolist()} at {target.tolist()} with {up.tolist()} up: the points must differ, "
            "and the line between them must not run along `up`; move one, or give another `up`"
        )
    forward = forward / np.linalg.norm(forward)
    right = right / np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    return Camera(K=_intrinsics(width, height, fov_degrees), R=R, t=-R @ eye, width=width, height=height)


def view(
    alpha: float,
    *,
    distance: float = 4.5,
    eye_height: float = 1.1,
    target=(0.0, 0.0, 0.9),
    width: int = 640,
    height: int = 480,
    fov_degrees: float = 40.0,
) -> Camera:
    """A camera at paper B's view angle: 0 is the side view with +x to the right, π/2 frontal.

    Args:
        alpha: view angle [rad]; see the figure in the module's docstring.
        distance: horizontal distance from the camera to the target [m].
        eye_height: height of the camera above the ground [m].
        target: (3,) [m] point in the middle of the picture.
        width: picture width [pixels].
        height: picture height [pixels].
        fov_degrees: vertical field of view [degrees].

    Raises:
        MotionError: as `look_at`, or `distance` isn't above 0.
    """
    if not 0 < distance < math.inf:
        raise MotionError(f"distance must be a number of metres above 0, got {distance!r}")
    target = frozen(target, (3,), "target")
    eye = (target[0] + distance * math.sin(alpha), target[1] - distance * math.cos(alpha), eye_height)
    return look_at(eye, target, width=width, height=height, fov_degrees=fov_degrees)


def fit_view(
    points,
    alpha: float,
    *,
    width: int = 640,
    height: int = 480,
    margin: float = 0.08,
    fov_degrees: float = 40.0,
    elevation: float = 0.0,
) -> Camera:
    """The nearest fixed camera at view angle `alpha` that has all of `points` in its picture: the whole walk.

    Args:
        points: (..., 3) [m], such as all markers of a motion; NaN points are left out.
        alpha: view angle [rad]; see the figure in the module's docstring.
        width: picture width [pixels].
        height: picture height [pixels].
        margin: share of the picture left free at each of its edges, from 0 to below 0.5.
        fov_degrees: vertical field of view [degrees].
        elevation: angle [rad] by which the camera looks down on the walker, within ±π/2; 0 is level.

    Raises:
        MotionError: a margin or an elevation out of its range.
        GapError: no point is known.
    """
    if not 0 <= margin < 0.5:
        raise MotionError(f"margin must be a share of the picture from 0 to below 0.5, got {margin!r}")
    if not abs(elevation) < math.pi / 2:
        raise MotionError(f"elevation must lie within ±π/2 rad, got {elevation!r}")
    points = frozen(points, (..., 3), "points").reshape(-1, 3)
    points = points[np.isfinite(points).all(-1)]
    if not len(points):
        raise GapError("no point is known: there is nothing to fit into the picture")
    right = np.array([math.cos(alpha), math.sin(alpha), 0.0])
    level = math.cos(elevation)
    forward = np.array([-math.sin(alpha) * level, math.cos(alpha) * level, -math.sin(elevation)])
    R = np.stack([right, np.cross(forward, right), forward])
    K = _intrinsics(width, height, fov_degrees)
    seen = points @ R.T
    # A point is inside the margins where |x - x of the camera| <= inside·(z - z of the camera), the same for y. So
    # the camera's x lies between high + inside·z and low - inside·z, and the largest z that leaves room is nearest.
    inside = (1 - 2 * margin) * np.array([width, height]) / 2 / K[0, 0]
    low = (seen[:, :2] + inside * seen[:, 2:]).min(0)
    high = (seen[:, :2] - inside * seen[:, 2:]).max(0)
    z = min(*(low - high) / (2 * inside), seen[:, 2].min() - _NEAREST)
    centre = np.array([*(low + high) / 2, z])
    return Camera(K=K, R=R, t=-centre, width=width, height=height)


def follow(path, camera: Camera, *, smooth: float = math.inf) -> tuple[Camera, ...]:
    """One camera per frame that travels beside a walker without swaying with each step.

    `camera` is placed for a walker who stands at the world's origin; each frame's camera is that one, shifted
    horizontally by the smoothed path. It never turns or bobs. The path's straight line at constant velocity
    (least squares) is kept exactly, and only what departs from it goes through a Gaussian low-pass.

    Args:
        path: the walker's `Motion`, or its root positions (frames, 3) [m]; gaps (NaN) are bridged.
        camera: the view of a walker at the origin, such as `view(alpha)`.
        smooth: standard deviation of the low-pass [frames]; infinite gives constant velocity, which suits straight
            walks; about half a second suits turns.

    Raises:
        MotionError: `path` is of another shape, or `smooth` isn't above 0.
        GapError: the position is known in no frame.
    """
    from scipy.ndimage import gaussian_filter1d

    if not smooth > 0:
        raise MotionError(f"smooth must be a number of frames above 0, got {smooth!r}")
    path = path.poses[..., :3] if isinstance(path, Motion) else path
    ground = frozen(path, (None, 3), "path")[:, :2]
    frames = np.arange(len(ground))
    known = np.isfinite(ground).all(-1)
    if not known.any():
        raise GapError("the root's position is known in no frame: there is no one to follow")
    design = np.stack([np.ones(len(frames)), frames - frames.mean()], -1)
    line = design @ np.linalg.lstsq(design[known], ground[known], rcond=None)[0]
    if math.isfinite(smooth):
        rest = np.stack([np.interp(frames, frames[known], (ground - line)[known, i]) for i in range(2)], -1)
        line = line + gaussian_filter1d(rest, smooth, axis=0, mode="nearest")
    shifts = np.concatenate([line, np.zeros((len(frames), 1))], -1)
    return tuple(
        Camera(K=camera.K, R=camera.R, t=camera.t - camera.R @ s, width=camera.width, height=camera.height)
        for s in shifts
    )


def orthographic(points, alpha) -> np.ndarray:
    """Paper B's two-dimensional view of three-dimensional points (appendix B, eq. B.2).

    Args:
        points: (..., 3) [m].
        alpha: view angle [rad], a number or an array that broadcasts against the leading axes of `points`.

    Returns:
        (..., 2) [m]: cos α·x + sin α·y to the right, and z upwards (a picture's rows run the other way).
    """
    points = np.asarray(points, dtype=np.float64)
    across = np.cos(alpha) * points[..., 0] + np.sin(alpha) * points[..., 1]
    return np.stack([across, np.broadcast_to(points[..., 2], across.shape)], axis=-1)


@dataclass(frozen=True)
class Orthographic:
    """A picture without perspective, as paper B's experiments use: stands in for `Camera` where points are drawn.

    Attributes:
        alpha: view angle [rad]; see the figure in the module's docstring.
        scale: pixels per metre.
        target: (3,) [m] point in the middle of the picture.
        width, height: picture size [pixels].
    """

    alpha: float
    scale: float
    target: tuple[float, float, float] = (0.0, 0.0, 0.9)
    width: int = 640
    height: int = 480

    def __post_init__(self):
        if not 0 < self.scale < math.inf:
            raise MotionError(f"Orthographic.scale must be a number of pixels per metre above 0, got {self.scale!r}")

    def project(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Pixel coordinates (..., 2) of world points (..., 3) [m], and depth (...) [m] behind the target's plane."""
        shifted = np.asarray(points, dtype=np.float64) - np.asarray(self.target)
        middle = np.array([self.width - 1, self.height - 1]) / 2
        pixels = middle + self.scale * orthographic(shifted, self.alpha) * np.array([1.0, -1.0])
        return pixels, math.cos(self.alpha) * shifted[..., 1] - math.sin(self.alpha) * shifted[..., 0]


def project(points, camera: Camera | Orthographic | Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (..., n, 2) and depth (..., n) [m] of points (..., n, 3) [m]; NaN where a point is behind the camera.

    Args:
        points: (..., n, 3), or (..., frames, n, 3) with one camera per frame.
        camera: one camera, or a sequence of one per frame (as `follow` gives).

    Raises:
        MotionError: `points` is of another shape, or there isn't one camera per frame, or they differ in size.
    """
    points = frozen(points, (..., None, 3), "points")
    if isinstance(camera, Camera | Orthographic):
        pixels, depth = camera.project(points)
        hidden = depth <= 0 if isinstance(camera, Camera) else np.zeros(depth.shape, dtype=bool)
        return np.where(hidden[..., None], np.nan, pixels), depth
    if points.ndim < 3 or len(camera) != points.shape[-3] or len({(c.width, c.height) for c in camera}) != 1:
        raise MotionError(
            f"{len(camera)} cameras for points of shape {points.shape}: give one camera, or one per frame, all of "
            "the same picture size"
        )
    each = [project(points[..., i, :, :], c) for i, c in enumerate(camera)]
    return np.stack([e[0] for e in each], axis=-3), np.stack([e[1] for e in each], axis=-2)


def picture_size(camera: Camera | Orthographic | Sequence) -> tuple[int, int]:
    """Height and width [pixels] of the pictures of a camera, or of a sequence of them."""
    one = camera if isinstance(camera, Camera | Orthographic) else camera[0]
    return one.height, one.width


def _intrinsics(width: int, height: int, fov_degrees: float) -> np.ndarray:
    """Square pixels and the principal point in the middle: K (3, 3) [pixels]."""
    if not 0 < fov_degrees < 180:
        raise MotionError(f"fov_degrees must lie between 0 and 180, got {fov_degrees!r}")
    f = height / 2 / math.tan(math.radians(fov_degrees) / 2)
    return np.array([[f, 0.0, (width - 1) / 2], [0.0, f, (height - 1) / 2], [0.0, 0.0, 1.0]])
