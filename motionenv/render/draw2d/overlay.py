"""Compose images: stick figure overlays, images side by side, strips of frames."""

from collections.abc import Sequence

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.body import EDGES
from motionenv.errors import MotionError
from motionenv.render.cameras import Orthographic, picture_size, project
from motionenv.render.draw2d.shapes import as_colours, draw_figures
from motionenv.types import MARKERS, Camera

#: Colour-blind safe colours of a stick figure's left, right and middle parts (Okabe & Ito 2008).
LEFT, RIGHT, MIDDLE = (230, 159, 0), (86, 180, 233), (255, 255, 255)

_SIDES = np.array([LEFT if n.startswith("left") else RIGHT if n.startswith("right") else MIDDLE for n in MARKERS])


def draw_pose(
    rgb: np.ndarray, markers: np.ndarray, camera: Camera | Orthographic, *, width: float = 3.0,
    colour: Sequence[float] | None = None,
) -> np.ndarray:  # fmt: skip
    """Copies of images with a stick figure overlay, such as an estimate.

    Args:
        rgb: uint8 (..., H, W, 3).
        markers: (..., 15, 3) [m], one figure per image; parts with NaN are not drawn.
        camera: the `Camera` or `Orthographic` view of the images, or one per frame.
        width: of the lines [pixels]; joints are dots twice as wide.
        colour: (R, G, B) from 0 to 255, or one per marker; None uses `LEFT`, `RIGHT` and `MIDDLE`.

    Raises:
        MotionError: incompatible shapes or image sizes, or a colour or a width out of range.
    """
    images = np.array(_pictures(rgb, "rgb"), order="C")
    checked_number(width, "width", above=0, unit="pixels")
    pixels, depth = project(markers, camera)
    height, columns = picture_size(camera)
    if images.shape != (*pixels.shape[:-2], height, columns, 3) or pixels.shape[-2] != 15:
        raise MotionError(
            f"rgb (..., height, width, 3), markers (..., 15, 3) and camera must agree, got {images.shape}, "
            f"{np.shape(markers)} and a camera of {columns} x {height}"
        )
    colours = as_colours(_SIDES if colour is None else colour, 15)
    draw_figures(images, pixels, depth, EDGES, colours, radius=width, width=width)
    return images


def side_by_side(left: np.ndarray, right: np.ndarray, *, gap: int = 4) -> np.ndarray:
    """Two stacks of images side by side, with a thin black `gap` [pixels]: uint8 (..., H, both widths + gap, 3).

    `left` and `right` are uint8 (..., H, any width, 3). A `MotionError` if they aren't, or differ in number or height.
    """
    left, right = _pictures(left, "left"), _pictures(right, "right")
    if left.shape[:-2] != right.shape[:-2]:
        raise MotionError(
            f"left and right must have the same number of images and height, got {left.shape} and {right.shape}"
        )
    return np.concatenate([left, np.zeros((*left.shape[:-2], gap, 3), dtype=np.uint8), right], axis=-2)


def strip(frames: Sequence | np.ndarray, n: int = 6, *, gap: int = 4) -> np.ndarray:
    """One image of `n` equally spaced frames in a row, from the first to the last, with a black `gap` [pixels] between.

    `frames` are uint8 (H, W, 3), or an array (T, H, W, 3). A `MotionError` if they are fewer than `n`, or not uint8
    images of one height.
    """
    if not 1 <= n <= len(frames):
        raise MotionError(f"n must be a whole number from 1 to the number of frames, {len(frames)}, got {n!r}")
    chosen = np.linspace(0, len(frames) - 1, n).round().astype(int)
    out = _pictures(frames[chosen[0]], "frames[0]")
    for i in chosen[1:]:
        out = side_by_side(out, frames[i], gap=gap)
    return out


def _pictures(rgb, name: str) -> np.ndarray:
    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8 or rgb.ndim < 3 or rgb.shape[-1] != 3:
        raise MotionError(f"{name} must be uint8 (..., height, width, 3), got {rgb.dtype} {rgb.shape}")
    return rgb
