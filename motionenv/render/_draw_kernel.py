"""Whole pictures, one after the other: limbs first, then the background, shadows and the body's colours."""

from typing import NamedTuple

import numpy as np

from motionenv.render._ground_kernel import draw_shadows
from motionenv.render._raycast_kernel import BOX, COLUMNS, GATHER, draw_limb, jit, set_limb
from motionenv.render._shade_kernel import shade_body


class View(NamedTuple):
    """A camera, and everything about the scene that stays the same in all its pictures.

    Attributes:
        k, kinv, r, t: intrinsics, their inverse, and world → camera, float64.
        lights: (2, 6) float32 in the camera's frame; ambient: (3,) float32.
        colours: (limbs, 3) float32, linear.
        encode: linear light → byte.
        lit, dark: the picture without a body, in full light and without the key light.
        shadows: whether to draw them; across, to_pixel, from_pixel: as `draw_shadows` wants them.
    """

    k: np.ndarray
    kinv: np.ndarray
    r: np.ndarray
    t: np.ndarray
    lights: np.ndarray
    ambient: np.ndarray
    colours: np.ndarray
    encode: np.ndarray
    lit: np.ndarray
    dark: np.ndarray
    shadows: bool
    across: np.ndarray
    to_pixel: np.ndarray
    from_pixel: np.ndarray


@jit
def _draw_limbs(ends, radii, view, table, box, scratch, where, depth, limbs):
    """Depth and ids of one body; writes the box of pixels (first and last column and row) that it can cover."""
    height, width = depth.shape
    flat_depth, flat_limbs = depth.reshape(-1), limbs.reshape(-1)
    for i in range(len(flat_depth)):  # written out, the compiler makes wide stores of it
        flat_depth[i] = np.inf
        flat_limbs[i] = 0
    box[0], box[1], box[2], box[3] = width, -1, height, -1
    for i in range(len(radii)):
        g = table[i]
        set_limb(ends[i], radii[i], view.r, view.t, view.k, view.kinv, width, height, g)
        if g[BOX] <= g[BOX + 1] and g[BOX + 2] <= g[BOX + 3]:
            draw_limb(g, view.kinv, np.uint8(i + 1), width, flat_depth, flat_limbs, scratch, where)
            box[0], box[1] = min(box[0], g[BOX]), max(box[1], g[BOX + 1])
            box[2], box[3] = min(box[2], g[BOX + 2]), max(box[3], g[BOX + 3])


@jit
def _paint(ends, radii, view, table, box, shade, depth, limbs, rgb):
    """RGB of one body whose depth and ids are known."""
    flat, background = rgb.reshape(-1), view.lit.reshape(-1)
    for i in range(len(flat)):
        flat[i] = background[i]
    if view.shadows:
        draw_shadows(ends, radii, view.across, view.to_pixel, view.from_pixel, view.lit, view.dark, limbs, shade, rgb)
    shade_body(table, view.kinv, box, view.lights, view.ambient, view.colours, view.encode, depth, limbs, rgb)


@jit
def draw(index, ends, radii, view, depth, limbs, rgb):
    """Draw bodies `index` of `ends` (n, limbs, 2, 3) into those pictures; an `rgb` of length 0 isn't drawn."""
    table, box = np.empty((len(radii), COLUMNS)), np.empty(4, np.int64)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    shade = np.empty(depth.shape[1:] if view.shadows else (0, 0), np.float32)
    for k in range(len(index)):
        i = index[k]
        _draw_limbs(ends[k], radii, view, table, box, scratch, where, depth[i], limbs[i])
        if len(rgb) > 0:
            _paint(ends[k], radii, view, table, box, shade, depth[i], limbs[i], rgb[i])


@jit
def draw_smooth(index, ends, radii, view, samples, rgb):
    """RGB as `draw`, averaged over samples × samples rays per pixel; `view` is of the picture so many times larger."""
    height, width = view.lit.shape[:2]
    depth, limbs = np.empty((1, height, width), np.float32), np.empty((1, height, width), np.uint8)
    large = np.empty((1, height, width, 3), np.uint8)
    first = np.zeros(1, np.int64)
    for k in range(len(index)):
        draw(first, ends[k : k + 1], radii, view, depth, limbs, large)
        _average(large[0], samples, rgb[index[k]])


@jit
def _average(large, samples, small):
    """Mean of every samples × samples block of `large`, rounded."""
    area = samples * samples
    for v in range(small.shape[0]):
        for u in range(small.shape[1]):
            for c in range(3):
                total = area // 2
                for i in range(samples):
                    for j in range(samples):
                        total += large[v * samples + i, u * samples + j, c]
                small[v, u, c] = total // area
