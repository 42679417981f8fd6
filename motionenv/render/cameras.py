r"""Cameras: builders of `types.Camera`, paper B's orthographic views, and calibrated cameras from files.

World: x forward (the direction of walking), y left, z up. Cameras follow OpenCV: x right, y down, z into the
scene, pixel centres at whole numbers. The view angle α is paper B's (Zhang & Troje 2007, appendix B): the
picture's horizontal axis is cos α·x + sin α·y, and the vertical one is z. From above::

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

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.errors import FormatError, GapError, MotionError
from motionenv.types import Camera, Motion, frozen

_NEAREST = 0.1  # [m] least distance between the camera of `fit_view` and the nearest point


def look_at(
    eye: ArrayLike, target: ArrayLike, *, width: int = 640, height: int = 480, fov_degrees: float = 40.0,
    up: ArrayLike = (0, 0, 1),
) -> Camera:  # fmt: skip
    """A camera at `eye` (3,) [m] with `target` (3,) [m] in the centre of its image.

    Args:
        eye, target: camera position, and the point it looks at.
        width, height: size of the image [pixels].
        fov_degrees: vertical field of view [degrees], from edge to edge of the image.
        up: (3,) direction that points up in the image.

    Raises:
        MotionError: eye and target coincide, the viewing direction is parallel to `up`, or the field of view isn't
            between 0 and 180 degrees.
    """
    eye, target, up = (frozen(v, (3,), n) for v, n in ((eye, "eye"), (target, "target"), (up, "up")))
    forward = target - eye
    right = np.cross(forward, up)
    if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise MotionError(
            f"eye {eye.tolist()} and target {target.tolist()} must differ, and their connection must not be parallel "
            f"to up {up.tolist()}"
        )
    forward = forward / np.linalg.norm(forward)
    right = right / np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    return Camera(K=_intrinsics(width, height, fov_degrees), R=R, t=-R @ eye, width=width, height=height)


def view(
    alpha: float, *, distance: float = 4.5, eye_height: float = 1.1, target: ArrayLike = (0.0, 0.0, 0.9),
    width: int = 640, height: int = 480, fov_degrees: float = 40.0,
) -> Camera:  # fmt: skip
    """A camera at paper B's view angle: 0 is the side view with +x to the right, π/2 frontal.

    Args:
        alpha: view angle [rad]; see the figure in the module's docstring.
        distance, eye_height: horizontal distance from the camera to the target, and its height above the ground [m].
        target, width, height, fov_degrees: as in `look_at`.

    Raises:
        MotionError: as in `look_at`, or `distance` isn't above 0.
    """
    checked_number(distance, "distance", above=0, unit="metres")
    target = frozen(target, (3,), "target")
    eye = (target[0] + distance * math.sin(alpha), target[1] - distance * math.cos(alpha), eye_height)
    return look_at(eye, target, width=width, height=height, fov_degrees=fov_degrees)


def fit_view(
    points: ArrayLike, alpha: float, *, width: int = 640, height: int = 480, margin: float = 0.08,
    fov_degrees: float = 40.0, elevation: float = 0.0,
) -> Camera:  # fmt: skip
    """The nearest static camera at view angle `alpha` that has all `points`, such as a whole walk, in its image.

    Args:
        points: (..., 3) [m], such as all markers of a motion; NaN points are ignored.
        alpha, width, height, fov_degrees: as in `view`.
        margin: fraction of the image left free at each edge, from 0 to below 0.5.
        elevation: angle [rad] by which the camera looks down on the walker, within ±π/2; 0 is level.

    Raises:
        MotionError: a margin or an elevation out of range.
        GapError: all points are NaN.
    """
    checked_number(margin, "margin", 0, below=0.5)
    if not abs(elevation) < math.pi / 2:
        raise MotionError(f"elevation must be within ±π/2 rad, got {elevation!r}")
    everywhere = frozen(points, (..., 3), "points").reshape(-1, 3)
    shown = everywhere[np.isfinite(everywhere).all(-1)]
    if not shown.size:
        raise GapError("points must hold at least one point without NaN")
    right = np.array([math.cos(alpha), math.sin(alpha), 0.0])
    level = math.cos(elevation)
    forward = np.array([-math.sin(alpha) * level, math.cos(alpha) * level, -math.sin(elevation)])
    R = np.stack([right, np.cross(forward, right), forward])
    K = _intrinsics(width, height, fov_degrees)
    seen = shown @ R.T
    # A point is inside the margins where |x - x of the camera| <= inside·(z - z of the camera), the same for y. So
    # the camera's x lies between high + inside·z and low - inside·z, and the largest z that leaves room is nearest.
    inside = (1 - 2 * margin) * np.array([width, height]) / 2 / K[0, 0]
    low = (seen[:, :2] + inside * seen[:, 2:]).min(0)
    high = (seen[:, :2] - inside * seen[:, 2:]).max(0)
    z = min(*(low - high) / (2 * inside), seen[:, 2].min() - _NEAREST)
    centre = np.array([*(low + high) / 2, z])
    return Camera(K=K, R=R, t=-centre, width=width, height=height)


def follow(path: Motion | ArrayLike, camera: Camera, *, smooth: float = math.inf) -> tuple[Camera, ...]:
    """One camera per frame that moves beside a walker without the sway of steps.

    `camera` is placed for a walker at the world's origin; each frame's camera is that one, shifted horizontally by the
    smoothed path. It never turns or bobs. The path's least-squares line at constant velocity is kept exactly; only the
    deviation from it is low-pass filtered (Gaussian).

    Args:
        path: the walker's `Motion`, or root positions (frames, 3) [m]; gaps (NaN) are interpolated.
        camera: the view of a walker at the origin, such as `view(alpha)`.
        smooth: standard deviation of the low-pass filter [frames]; infinite gives constant velocity, which suits
            straight walks; about half a second suits turns.

    Raises:
        MotionError: `path` has another shape, or `smooth` isn't above 0.
        GapError: all positions are NaN.
    """
    from scipy.ndimage import gaussian_filter1d

    if smooth != math.inf:
        checked_number(smooth, "smooth", above=0, unit="frames")
    path = path.poses[..., :3] if isinstance(path, Motion) else path
    ground = frozen(path, (None, 3), "path")[:, :2]
    frames = np.arange(len(ground))
    known = np.isfinite(ground).all(-1)
    if not known.any():
        raise GapError("path must hold at least one frame with a root position")
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


def orthographic(points: ArrayLike, alpha: ArrayLike) -> np.ndarray:
    """Paper B's orthographic projection (..., 2) [m] of 3D points (..., 3) [m] (appendix B, eq. B.2).

    It has cos α·x + sin α·y to the right, and z upwards (image rows run the other way). α is `alpha` [rad], a number or
    an array that broadcasts against the leading axes of `points`.
    """
    points = np.asarray(points, dtype=np.float64)
    across = np.cos(alpha) * points[..., 0] + np.sin(alpha) * points[..., 1]
    return np.stack([across, np.broadcast_to(points[..., 2], across.shape)], axis=-1)


@dataclass(frozen=True, repr=False)
class Orthographic(OneLine):
    """An orthographic view, as in paper B's experiments; used in place of `Camera` for drawing points.

    `alpha` is the view angle [rad], `scale` in pixels per metre, `target` (3,) [m] the point in the centre of the
    image, and `width` and `height` are its size [pixels].
    """

    alpha: float
    scale: float
    target: tuple[float, float, float] = (0.0, 0.0, 0.9)
    width: int = 640
    height: int = 480

    def __post_init__(self) -> None:
        checked_number(self.scale, "Orthographic.scale", above=0, unit="pixels per metre")

    def project(self, points: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Pixel coordinates (..., 2) of world points (..., 3) [m], and depth (...) [m] behind the target's plane."""
        shifted = np.asarray(points, dtype=np.float64) - np.asarray(self.target)
        middle = np.array([self.width - 1, self.height - 1]) / 2
        pixels = middle + self.scale * orthographic(shifted, self.alpha) * np.array([1.0, -1.0])
        return pixels, math.cos(self.alpha) * shifted[..., 1] - math.sin(self.alpha) * shifted[..., 0]


def project(points: ArrayLike, camera: Camera | Orthographic | Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (..., n, 2) and depth (..., n) [m] of points (..., n, 3) [m]; NaN for points behind the camera.

    With a sequence of cameras, one per frame (as from `follow`), points are (..., frames, n, 3).

    Raises:
        MotionError: another shape, or cameras that differ in image size or aren't as many as frames.
    """
    points = frozen(points, (..., None, 3), "points")
    if isinstance(camera, Camera | Orthographic):
        pixels, depth = camera.project(points)
        hidden = depth <= 0 if isinstance(camera, Camera) else np.zeros(depth.shape, dtype=bool)
        return np.where(hidden[..., None], np.nan, pixels), depth
    if points.ndim < 3 or len(camera) != points.shape[-3] or len({(c.width, c.height) for c in camera}) != 1:
        raise MotionError(
            f"camera must be one camera, or one per frame, all of the same image size; got {len(camera)} cameras for "
            f"points of shape {points.shape}"
        )
    each = [project(points[..., i, :, :], c) for i, c in enumerate(camera)]
    return np.stack([e[0] for e in each], axis=-3), np.stack([e[1] for e in each], axis=-2)


def picture_size(camera: Camera | Orthographic | Sequence) -> tuple[int, int]:
    """Height and width [pixels] of the images of a camera, or of a sequence of cameras."""
    one = camera if isinstance(camera, Camera | Orthographic) else camera[0]
    return one.height, one.width


def _intrinsics(width: int, height: int, fov_degrees: float) -> np.ndarray:
    """Intrinsics K (3, 3) [pixels] with square pixels and the principal point in the image centre."""
    if not 0 < fov_degrees < 180:
        raise MotionError(f"fov_degrees must be between 0 and 180, got {fov_degrees!r}")
    f = height / 2 / math.tan(math.radians(fov_degrees) / 2)
    return np.array([[f, 0.0, (width - 1) / 2], [0.0, f, (height - 1) / 2], [0.0, 0.0, 1.0]])


def read_camera(path: str | Path, name: str | None = None) -> Camera:
    """Read a camera, by `name` if there are several: a TOML table's name, or its `name` entry.

    - `.json`: an object with K (3 × 3), R (3 × 3), t (3) [m], width and height, as in `motionenv.types.Camera`.
    - `.toml`: a table per camera with size, matrix, rotation (a rotation vector) and translation [m]; for the lens see
      `read_distortion`.

    Raises:
        FormatError: not such a file.
        MotionError: no camera of that name, or several and no name.
    """
    path = Path(path)
    table = _table(path, name)
    try:
        if path.suffix.lower() == ".json":
            return Camera(table["K"], table["R"], table["t"], table["width"], table["height"])
        return _of_table(table)
    except KeyError as error:
        raise FormatError(path, f"lacks {error.args[0]!r}") from None
    except (TypeError, IndexError, ValueError) as error:
        raise FormatError(path, f"isn't a valid camera: {error}") from error


def read_distortion(path: str | Path, name: str | None = None) -> list[float] | None:
    """OpenCV's coefficients of a camera's lens: `distortions` of a TOML table or JSON object; None if it has none.

    Raises:
        FormatError: not such a file, or a fisheye lens, whose model is another.
        MotionError: as in `read_camera`.
    """
    table = _table(Path(path), name)
    if table.get("fisheye"):
        raise FormatError(path, "has a fisheye lens: undistort points or pictures first, and set fisheye = false")
    return table.get("distortions")


def _table(path: Path, name: str | None) -> dict:
    if path.suffix.lower() not in (".json", ".toml"):
        raise FormatError(path, "isn't a camera file: the suffix must be .json or .toml")
    try:
        text = path.read_text(encoding="utf-8")
        found = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise FormatError(path, f"can't be read as a camera: {getattr(error, 'strerror', None) or error}") from error
    if not isinstance(found, dict):
        raise FormatError(path, "must hold an object with K, R, t, width and height")
    return found if path.suffix.lower() == ".json" else _chosen(path, found, name)


def _chosen(path: Path, tables: dict, name: str | None) -> dict:
    cameras = {k: t for k, t in tables.items() if isinstance(t, dict) and "matrix" in t}
    if not cameras:
        raise FormatError(path, "has no camera: no table with a matrix")
    names = [str(n) for k, t in cameras.items() for n in (k, t.get("name")) if n]
    if name is None and len(cameras) > 1:
        raise MotionError(f"{path} has {len(cameras)} cameras; select one by name: {', '.join(cameras)}")
    for key, table in cameras.items():
        if name is None or name in (key, table.get("name")):
            return table
    raise MotionError(f"{path} has no camera {name!r}; it has {', '.join(dict.fromkeys(names))}")


def _of_table(table: dict) -> Camera:
    from scipy.spatial.transform import Rotation

    width, height = (int(n) for n in table["size"])
    rotation = Rotation.from_rotvec(np.asarray(table["rotation"], dtype=np.float64)).as_matrix()
    return Camera(table["matrix"], rotation, table["translation"], width, height)
