"""Films of a track: the image with particles and the expected pose, a 3D view beside it, a curve below."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body import EDGES, markers
from motionenv.errors import MotionError
from motionenv.render.cameras import project, view
from motionenv.render.draw2d.overlay import draw_pose, side_by_side
from motionenv.render.draw2d.shapes import draw_lines
from motionenv.render.raycast.engine import Raycaster
from motionenv.types import Camera, Skeleton

_PARTICLE = np.array([120.0, 230.0, 120.0])
_CURVE, _GRID, _PAPER = np.array([230.0, 159.0, 0.0]), np.array([70.0, 70.0, 70.0]), 16
_TURNED = np.radians(50)  # angle of the 3D view relative to the camera's
_CURVE_SHARE = 0.2  # height of the curve relative to the image's


def track_film(
    pictures: Iterable, cameras: Camera | Iterable[Camera], poses: np.ndarray, particles: ArrayLike,
    skeleton: Skeleton, curve: ArrayLike, *, label: str = "", most: float | None = None,
) -> Iterator[np.ndarray]:  # fmt: skip
    """Frames, uint8 (height · 1.2, about 2 · width, 3), of a film of a track.

    Args:
        pictures: uint8 (height, width, 3), one per pose.
        cameras: of the images: one, or one per pose.
        poses: (T, 25) expected poses [m, rad]; NaN where there is none.
        particles: (T, particles, 25), drawn with thin lines; NaN as above.
        skeleton: the body.
        curve, label: (T,) values of the curve, shown up to each frame; NaN leaves gaps; and its label.
        most: upper end of the curve's axis; None uses the largest value.

    Raises:
        MotionError: incompatible shapes.
    """
    poses, particles, curve = (np.asarray(a, dtype=np.float64) for a in (poses, particles, curve))
    if poses.ndim != 2 or particles.shape[:1] != poses.shape[:1] or curve.shape != poses.shape[:1]:
        raise MotionError(
            f"poses (T, 25), particles (T, n, 25) and curve (T,) must agree, got {poses.shape}, {particles.shape} and "
            f"{curve.shape}"
        )
    top = most or float(np.nanmax(curve, initial=1e-6, where=np.isfinite(curve)))
    each = iter([cameras] * len(poses) if isinstance(cameras, Camera) else cameras)
    raycaster, plot = Raycaster(), None
    for i, picture in enumerate(pictures):
        camera = next(each, None)
        if i == len(poses) or camera is None:
            raise MotionError(f"pictures must not outnumber the {len(poses)} poses or the cameras")
        over = _overlaid(picture, camera, poses[i], particles[i], skeleton)
        both = side_by_side(over, _in_3d(raycaster, camera, poses[i], skeleton, over.shape))
        plot = plot or _Plot(curve, top, label, both.shape)
        yield np.concatenate([both, plot.upto(i)])


def marked(pictures: Iterable[np.ndarray], where: Sequence[bool] | np.ndarray, text: str) -> Iterator[np.ndarray]:
    """`pictures`, uint8 (height, width, 3), with the word `text` in the corner of those marked by `where` (T,) bool."""
    from PIL import Image, ImageDraw, ImageFont

    for picture, mark in zip(pictures, where, strict=False):
        image = Image.fromarray(np.ascontiguousarray(picture))
        if mark:
            font = ImageFont.load_default(max(12, image.height // 12))
            ImageDraw.Draw(image).text((8, 4), text, (255, 60, 60), font, stroke_width=2, stroke_fill=(0, 0, 0))
        yield np.asarray(image)


def _overlaid(picture, camera: Camera, pose: np.ndarray, particles: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """The image with particles (thin) and the expected pose."""
    image = np.array(picture, dtype=np.uint8, order="C")
    if not np.isfinite(pose).all():
        return image
    pixels, _ = project(markers(particles, skeleton), camera)
    draw_lines(image, pixels[:, np.asarray(EDGES)].reshape(-1, 4), max(0.35, len(image) / 1000), _PARTICLE)
    return draw_pose(image, markers(pose, skeleton), camera, width=max(2.0, len(image) / 120))


def _in_3d(raycaster: Raycaster, camera: Camera, pose: np.ndarray, skeleton: Skeleton, shape: tuple) -> np.ndarray:
    """The body seen from `_TURNED` beside the camera, always in the centre; grey if there is none."""
    height, width = shape[:2]
    width = min(width, height)
    if not np.isfinite(pose).all():
        return np.full((height, width, 3), _PAPER, dtype=np.uint8)
    alpha = float(np.arctan2(camera.R[0, 1], camera.R[0, 0])) + _TURNED
    here = np.concatenate([[0.0, 0.0], pose[2:]])
    beside = view(alpha, distance=4.0, eye_height=1.4, width=width, height=height, fov_degrees=36.0 * height / width)
    return np.asarray(raycaster.render(here[None], skeleton, beside).rgb)[0]


class _Plot:
    """A curve (T,) that grows from frame to frame, with label, value and upper end of its axis; NaN leaves gaps."""

    def __init__(self, curve: np.ndarray, top: float, label: str, shape: tuple):
        rows, columns = max(24, round(_CURVE_SHARE * shape[0])), shape[1]
        self._curve, self._top, self._label, self._letters = curve, top, label, max(7.0, rows / 5)
        self._image = np.full((rows, columns, 3), _PAPER, dtype=np.uint8)
        first = 1.5 * self._letters + 2  # row of the axis' upper end, below the text
        self._across = np.linspace(4, columns - 5, max(len(curve), 2))
        self._down = rows - 5 - np.clip(curve / top, 0, 1) * (rows - 5 - first)
        self._drawn = 0  # number of frames drawn so far
        lines = np.array([(4.0, row, columns - 5.0, row) for row in (first, rows - 5.0)])
        draw_lines(self._image, lines, 1.0, _GRID)

    def upto(self, frame: int) -> np.ndarray:
        """The curve up to `frame`, uint8 (rows, columns, 3); frames must be in order."""
        from PIL import Image, ImageDraw, ImageFont

        x, y = self._across, self._down
        new, ends = slice(self._drawn, frame), slice(self._drawn + 1, frame + 1)
        draw_lines(self._image, np.column_stack([x[new], y[new], x[ends], y[ends]]), 2.0, _CURVE)
        self._drawn = frame
        drawn = Image.fromarray(self._image)
        font = ImageFont.load_default(self._letters)
        draw = ImageDraw.Draw(drawn)
        draw.text((8, 3), f"{self._label} {_number(self._curve[frame])}", fill=(220, 220, 220), font=font)
        draw.text((drawn.width - 8, 3), _number(self._top), fill=tuple(2 * _GRID.astype(int)), font=font, anchor="ra")
        return np.asarray(drawn)


def _number(value: float) -> str:
    """A value with three significant digits, or all digits before the decimal point."""
    return "-" if not np.isfinite(value) else f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
