"""Pictures over and beside pictures: an estimate's stick figure, two videos side by side, a strip of frames."""

from collections.abc import Sequence

import numpy as np

from motionenv.body import EDGES
from motionenv.errors import MotionError
from motionenv.render.cameras import picture_size, project
from motionenv.render.drawing import as_colours, draw_figures
from motionenv.types import MARKERS

#: Colours of a stick figure's left, right and middle parts, apart for colour-blind eyes too (Okabe & Ito 2008).
LEFT, RIGHT, MIDDLE = (230, 159, 0), (86, 180, 233), (255, 255, 255)

_SIDES = np.array([LEFT if n.startswith("left") else RIGHT if n.startswith("right") else MIDDLE for n in MARKERS])


def draw_pose(rgb, markers, camera, *, width: float = 3.0, colour=None) -> np.ndarray:
    """Copies of pictures with a stick figure over them, such as an estimate over what was seen.

    Args:
        rgb: uint8 (..., H, W, 3).
        markers: (..., 15, 3) [m], one figure per picture; parts with NaN are not drawn.
        camera: the `Camera` or `Orthographic` view that the pictures were taken with, or one per frame.
        width: of the lines [pixels]; joints are dots twice as wide.
        colour: (R, G, B) from 0 to 255, or one per marker; None paints `LEFT`, `RIGHT` and `MIDDLE` parts apart.

    Raises:
        MotionError: shapes or picture sizes that don't go together, or a colour or a width out of range.
    """
    images = np.array(_pictures(rgb, "rgb"), order="C")
    if not 0 < width < np.inf:
        raise MotionError(f"width must be a number of pixels above 0, got {width!r}")
    pixels, depth = project(markers, camera)
    height, columns = picture_size(camera)
    if images.shape != (*pixels.shape[:-2], height, columns, 3) or pixels.shape[-2] != 15:
        raise MotionError(
            f"pictures of shape {images.shape} don't go with markers of shape {np.shape(markers)} and a camera of "
            f"{columns} x {height}: give (..., height, width, 3) and (..., 15, 3)"
        )
    colours = as_colours(_SIDES if colour is None else colour, 15)
    draw_figures(images, pixels, depth, EDGES, colours, radius=width, width=width)
    return images


def side_by_side(left, right, *, gap: int = 4) -> np.ndarray:
    """Two pictures (or two stacks of them) beside each other, with a thin black gap.

    Args:
        left: uint8 (..., H, W, 3).
        right: uint8 (..., H, any width, 3), as many pictures of the same height.
        gap: between them [pixels].

    Returns:
        uint8 (..., H, W + gap + the other width, 3).

    Raises:
        MotionError: they are not uint8 pictures, or differ in number or height.
    """
    left, right = _pictures(left, "left"), _pictures(right, "right")
    if left.shape[:-2] != right.shape[:-2]:
        raise MotionError(
            f"pictures of shapes {left.shape} and {right.shape} can't stand side by side: number and height must agree"
        )
    return np.concatenate([left, np.zeros((*left.shape[:-2], gap, 3), dtype=np.uint8), right], axis=-2)


def strip(frames: Sequence, n: int = 6, *, gap: int = 4) -> np.ndarray:
    """One picture of `n` equally spaced frames in a row, from the first to the last.

    Args:
        frames: a sequence of uint8 (H, W, 3), or an array (T, H, W, 3).
        n: how many to show, from 1 to all.
        gap: black pixels between them.

    Raises:
        MotionError: fewer frames than `n`, or frames that are not uint8 pictures of one height.
    """
    if not 1 <= n <= len(frames):
        raise MotionError(
            f"a strip of n = {n!r} pictures needs at least one and at most as many as the {len(frames)} frames"
        )
    chosen = np.linspace(0, len(frames) - 1, n).round().astype(int)
    out = _pictures(frames[chosen[0]], "frames[0]")
    for i in chosen[1:]:
        out = side_by_side(out, frames[i], gap=gap)
    return out


def _pictures(rgb, name: str) -> np.ndarray:
    """`rgb` as an array.

    Raises:
        MotionError: not uint8 (..., H, W, 3).
    """
    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8 or rgb.ndim < 3 or rgb.shape[-1] != 3:
        raise MotionError(f"{name} must be uint8 (..., height, width, 3), got {rgb.dtype} {rgb.shape}")
    return rgb
