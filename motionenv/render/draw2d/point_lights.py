"""Point-light displays: dots at the markers, as in Zhang & Troje (2007, fig. 1) and the perception literature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number
from motionenv.body import EDGES
from motionenv.errors import MotionError
from motionenv.render.cameras import Orthographic, picture_size, project
from motionenv.render.draw2d.shapes import as_colours, draw_figures
from motionenv.types import Camera


def render_points(
    markers: ArrayLike, camera: Camera | Orthographic | Sequence[Camera], *, radius: float = 4.0,
    colour: ArrayLike = (255, 255, 255), background: ArrayLike = (0, 0, 0), lines: bool = False,
) -> np.ndarray:  # fmt: skip
    """Images of dots at the markers, uint8 (..., H, W, 3), antialiased by exact coverage: they don't flicker.

    Nearer dots occlude farther ones. Missing markers (NaN) and those behind the camera are not drawn. For a dot that
    subtends the visual angle a [rad] at viewing distance d [m], on a screen with s pixels per metre, set the radius to
    d·tan(a/2)·s.

    Args:
        markers: (..., n, 3) [m], for example from `motionenv.body.markers`.
        camera: a `Camera`, an `Orthographic` view, or a sequence of one per frame for markers (..., frames, n, 3).
        radius: of the dots [pixels].
        colour: (R, G, B) from 0 to 255 of the dots, or one per marker.
        background: (R, G, B) from 0 to 255.
        lines: connect the 15 markers to a stick figure, with lines half as wide as the dots.

    Raises:
        MotionError: a wrong shape, a colour out of range, a radius that isn't above 0, or lines without 15 markers.
    """
    checked_number(radius, "radius", above=0, unit="pixels")
    pixels, depth = project(markers, camera)
    n = pixels.shape[-2]
    if lines and n != 15:
        raise MotionError(f"lines needs the 15 markers of motionenv.types.MARKERS, got {n} points: set lines=False")
    colours = as_colours(colour, n)
    height, width = picture_size(camera)
    images = np.empty((*pixels.shape[:-2], height, width, 3), dtype=np.uint8)
    row = np.tile(as_colours(background, 1, "background").astype(np.uint8), (width, 1))
    images[...] = row  # much faster than broadcasting 3 bytes
    draw_figures(images, pixels, depth, EDGES if lines else (), colours, radius=radius, width=radius)
    return images
