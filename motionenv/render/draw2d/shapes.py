"""Antialiased discs and lines, drawn into uint8 images in place. Coordinates are pixels, with centres at integers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.compilation import kernel, part
from motionenv.errors import MotionError


@part
def disc_below_left(a: float, b: float) -> float:
    """Area of the part of the unit disc where x < a and y < b, in closed form."""
    a, b = min(max(a, -1.0), 1.0), min(max(b, -1.0), 1.0)
    half = math.sqrt(1.0 - b * b)  # the line y = b intersects the circle at x = ±half
    m = min(max(a, -half), half)
    segment = _half_disc(m) - _half_disc(-half)
    if b >= 0.0:
        return 2.0 * _half_disc(a) - (segment - b * (m + half))
    return segment + b * (m + half)


@part
def _half_disc(x: float) -> float:
    """Area under the unit half circle from -1 to x."""
    return 0.5 * (x * math.sqrt(max(1.0 - x * x, 0.0)) + math.asin(x) + 0.5 * math.pi)


@part
def disc_cover(x: float, y: float, radius: float) -> float:
    """Coverage of the unit pixel at (x, y) by a disc around the origin, exact so that dots don't flicker."""
    x0, x1 = (x - 0.5) / radius, (x + 0.5) / radius
    y0, y1 = (y - 0.5) / radius, (y + 0.5) / radius
    area = disc_below_left(x1, y1) - disc_below_left(x0, y1) - disc_below_left(x1, y0) + disc_below_left(x0, y0)
    return min(max(area * radius * radius, 0.0), 1.0)


@part
def _blend(image, row, column, cover, colour):
    for c in range(3):
        old = image[row, column, c]
        image[row, column, c] = int(old + cover * (colour[c] - old) + 0.5)


@part
def _span(low: float, high: float, size: int):
    """First and one past the last pixel that [low, high] touches, within 0..size."""
    return int(min(max(math.floor(low + 0.5), 0.0), size)), int(min(max(math.floor(high + 0.5) + 1.0, 0.0), size))


@part
def draw_disc(image: np.ndarray, x: float, y: float, radius: float, colour: ArrayLike) -> None:
    """Draw a disc over `image` (H, W, 3) uint8; does nothing if x or y is NaN."""
    if not (math.isfinite(x) and math.isfinite(y)):
        return
    top, bottom = _span(y - radius, y + radius, image.shape[0])
    left, right = _span(x - radius, x + radius, image.shape[1])
    for row in range(top, bottom):
        for column in range(left, right):
            d = math.hypot(column - x, row - y)
            if d + 0.7072 <= radius:
                _blend(image, row, column, 1.0, colour)
            elif d - 0.7072 < radius:
                _blend(image, row, column, disc_cover(column - x, row - y, radius), colour)


@part
def draw_line(image: np.ndarray, ax: float, ay: float, bx: float, by: float, width: float, colour: ArrayLike) -> None:
    """Draw a line with round ends over `image` (H, W, 3) uint8; does nothing if an end is NaN.

    Coverage falls linearly over the one pixel around the edge.
    """
    if not (math.isfinite(ax) and math.isfinite(ay) and math.isfinite(bx) and math.isfinite(by)):
        return
    reach = 0.5 * width + 0.5
    dx, dy = bx - ax, by - ay
    squared = dx * dx + dy * dy
    top, bottom = _span(min(ay, by) - reach, max(ay, by) + reach, image.shape[0])
    left, right = _span(min(ax, bx) - reach, max(ax, bx) + reach, image.shape[1])
    for row in range(top, bottom):
        for column in range(left, right):
            px, py = column - ax, row - ay
            along = 0.0 if squared == 0.0 else min(max((px * dx + py * dy) / squared, 0.0), 1.0)
            cover = min(reach - math.hypot(px - along * dx, py - along * dy), 1.0, width)
            if cover > 0.0:
                _blend(image, row, column, cover, colour)


@kernel
def draw_lines(image, lines, width: float, colour) -> None:
    """Draw `lines` (n, 4), from (x, y) to (x, y), over `image`, one after the other: see `draw_line`."""
    for i in range(len(lines)):
        draw_line(image, lines[i, 0], lines[i, 1], lines[i, 2], lines[i, 3], width, colour)


@kernel
def _draw_all(images, pixels, order, edges, colours, radius: float, width: float) -> None:
    for i in range(len(images)):
        for e in range(len(edges)):
            a, b = pixels[i, edges[e, 0]], pixels[i, edges[e, 1]]
            draw_line(images[i], a[0], a[1], b[0], b[1], width, colours[edges[e, 1]])
        for j in order[i]:
            draw_disc(images[i], pixels[i, j, 0], pixels[i, j, 1], radius, colours[j])


def draw_figures(
    images: np.ndarray, pixels: np.ndarray, depth: np.ndarray, edges: ArrayLike, colours: np.ndarray, *, radius: float,
    width: float,
) -> None:  # fmt: skip
    """Draw one figure per image: first its lines, in the colour of their second point, then its dots, farthest first.

    Args:
        images: uint8 (..., H, W, 3), C-contiguous, updated in place.
        pixels, depth: (..., n, 2), (x, y), and (..., n); points with NaN are not drawn.
        edges: (edges, 2) indices of the points that lines connect.
        colours: (n, 3), from 0 to 255, of the dots.
        radius, width: of the dots and of the lines [pixels].
    """
    n = pixels.shape[-2]
    _draw_all(
        images.reshape(-1, *images.shape[-3:]), np.ascontiguousarray(pixels.reshape(-1, n, 2)),
        np.argsort(-depth, axis=-1).reshape(-1, n), np.asarray(edges, dtype=np.intp).reshape(-1, 2), colours,
        float(radius), float(width),
    )  # fmt: skip


def as_colours(colour: ArrayLike, n: int, name: str = "colour") -> np.ndarray:
    """`colour` as (n, 3) float64: one (R, G, B) from 0 to 255 for all, or one each; otherwise a MotionError."""
    colours = np.asarray(colour, dtype=np.float64)
    if colours.shape not in {(3,), (n, 3)} or not ((colours >= 0) & (colours <= 255)).all():
        raise MotionError(f"{name} must be (R, G, B) from 0 to 255, or {n} of them, got {colour!r}")
    return np.ascontiguousarray(np.broadcast_to(colours, (n, 3)))
