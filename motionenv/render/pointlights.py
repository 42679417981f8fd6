"""Point-light walkers: dots at the markers, as in Zhang & Troje (2006, fig. 1) and the perception literature."""

import numpy as np

from motionenv.body import EDGES
from motionenv.errors import MotionError
from motionenv.render.cameras import picture_size, project
from motionenv.render.drawing import as_colours, draw_figures


def render_points(
    markers, camera, *, radius: float = 4.0, colour=(255, 255, 255), background=(0, 0, 0), lines: bool = False
) -> np.ndarray:
    """Pictures of dots at the markers, antialiased by exact area, so that their brightness doesn't flicker.

    Nearer dots cover farther ones. Missing markers (NaN) and those behind the camera are not drawn. A dot that
    shall subtend an angle a [rad] as seen from the viewing distance d [m], on a screen with s pixels per metre, has
    radius d·tan(a/2)·s.

    Args:
        markers: (..., n, 3) [m], such as `motionenv.body.markers` gives.
        camera: a `Camera`, an `Orthographic` view, or a sequence of one per frame for markers (..., frames, n, 3).
        radius: of the dots [pixels].
        colour: (R, G, B) from 0 to 255 of the dots, or one per marker.
        background: (R, G, B) from 0 to 255.
        lines: connect the 15 markers to a stick figure, lines half as wide as the dots.

    Returns:
        uint8 (..., H, W, 3).

    Raises:
        MotionError: a wrong shape, a colour out of range, a radius that isn't above 0, or lines without 15 markers.
    """
    if not 0 < radius < np.inf:
        raise MotionError(f"radius must be a number of pixels above 0, got {radius!r}")
    pixels, depth = project(markers, camera)
    n = pixels.shape[-2]
    if lines and n != 15:
        raise MotionError(f"lines connect the 15 markers of motionenv.types.MARKERS, got {n} points: leave lines off")
    colours = as_colours(colour, n)
    height, width = picture_size(camera)
    images = np.empty((*pixels.shape[:-2], height, width, 3), dtype=np.uint8)
    row = np.tile(as_colours(background, 1, "background").astype(np.uint8), (width, 1))
    images[...] = row  # 3 bytes at a time would be slow
    draw_figures(images, pixels, depth, EDGES if lines else (), colours, radius=radius, width=radius)
    return images
