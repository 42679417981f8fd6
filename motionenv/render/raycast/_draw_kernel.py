"""Render complete images: limbs, then background, shadows and the body's colours; or different bodies, on black."""

from typing import NamedTuple

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.body.kinematics import write_limb_segments
from motionenv.body.limbs import LIMB_NODES, LIMB_SEGMENT, LIMB_SHIFTS, set_shifts
from motionenv.render.raycast._ground_kernel import draw_background, draw_shadows
from motionenv.render.raycast._shade_kernel import shade_body
from motionenv.render.raycast.limb_kernel import BOX, COLUMNS, GATHER, draw_limb, set_limb


class View(NamedTuple):
    """A camera with all precomputed values that its images share.

    Attributes:
        k, kinv, r, t: intrinsics, their inverse, and extrinsics world → camera, float64.
        fine_k, fine_kinv: intrinsics and their inverse for the supersampled image.
        lights: (2, 6) float32 in the camera's frame; ambient: (3,) float32.
        colours: (limbs, 3) float32, linear.
        encode: linear light → byte.
        to_world: (3, 3) float32, pixel → direction in the world; centre: (3,) float32, position [tiles].
        lit, dark: colours of ground and sky, in full light and without the key light, from `colour_background`.
        shadows: whether to draw them; across, to_pixel, from_pixel: arguments of `draw_shadows`.
    """

    k: np.ndarray
    kinv: np.ndarray
    r: np.ndarray
    t: np.ndarray
    fine_k: np.ndarray
    fine_kinv: np.ndarray
    lights: np.ndarray
    ambient: np.ndarray
    colours: np.ndarray
    encode: np.ndarray
    to_world: np.ndarray
    centre: np.ndarray
    lit: np.ndarray
    dark: np.ndarray
    shadows: bool
    across: np.ndarray
    to_pixel: np.ndarray
    from_pixel: np.ndarray


@part
def place_limbs(ends, radii, r, t, k, kinv, width, height, table, box):
    """Fill the table of limbs; write the body's bounding box (first and last column and row)."""
    box[0], box[1], box[2], box[3] = width, -1, height, -1
    for i in range(len(radii)):
        g = table[i]
        set_limb(ends[i], radii[i], r, t, k, kinv, width, height, g)
        if g[BOX] <= g[BOX + 1] and g[BOX + 2] <= g[BOX + 3]:
            box[0], box[1] = min(box[0], g[BOX]), max(box[1], g[BOX + 1])
            box[2], box[3] = min(box[2], g[BOX + 2]), max(box[3], g[BOX + 3])


@part
def draw_limbs(table, kinv, scratch, where, depth, limbs):
    """Draw depth and ids of one body, in front of or behind what is already there."""
    flat_depth, flat_limbs = depth.reshape(-1), limbs.reshape(-1)
    for i in range(len(table)):
        g = table[i]
        if g[BOX] <= g[BOX + 1] and g[BOX + 2] <= g[BOX + 3]:
            draw_limb(g, kinv, np.uint8(i + 1), depth.shape[1], flat_depth, flat_limbs, scratch, where)


@part
def clear(depth, limbs):
    """Reset to infinite depth and id 0."""
    for v in range(depth.shape[0]):
        row_depth, row_limbs = depth[v], limbs[v]
        for u in range(len(row_depth)):  # an explicit loop compiles to SIMD stores
            row_depth[u] = np.inf
            row_limbs[u] = 0


@part
def _draw_backgrounds(index, view, rgb):
    """Draw the background of the first of the images `index` and copy it to the others."""
    draw_background(view.to_world, view.centre, view.lit, rgb[index[0]])
    background = rgb[index[0]].reshape(-1)
    for k in range(1, len(index)):
        flat = rgb[index[k]].reshape(-1)
        for i in range(len(flat)):
            flat[i] = background[i]


@kernel
def draw(index, ends, radii, view, samples, depth, limbs, rgb):
    """Render bodies `index` of `ends` (n, limbs, 2, 3) into their images; an `rgb` of length 0 is skipped.

    Depth and ids come from pixel centres, colours of bodies from samples × samples rays per pixel.
    """
    height, width = depth.shape[1:]
    table, box = np.empty((len(radii), COLUMNS)), np.empty(4, np.int64)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    shade = np.empty((height * samples, width * samples) if view.shadows else (0, 0), np.float32)
    fine = (height * samples, width * samples) if samples > 1 and len(rgb) > 0 else (0, 0)
    fine_depth, fine_limbs = np.empty(fine, np.float32), np.empty(fine, np.uint8)
    fine_rgb = np.empty((*fine, 3), np.uint8)
    if len(rgb) > 0:
        _draw_backgrounds(index, view, rgb)
    for k in range(len(index)):
        i = index[k]
        place_limbs(ends[k], radii, view.r, view.t, view.k, view.kinv, width, height, table, box)
        clear(depth[i], limbs[i])
        draw_limbs(table, view.kinv, scratch, where, depth[i], limbs[i])
        if len(rgb) == 0:
            continue
        if view.shadows:
            draw_shadows(ends[k], radii, view, samples, shade, rgb[i])
        if samples == 1:
            _shade(table, view, view.kinv, box, depth[i], limbs[i], rgb[i])
        else:
            place_limbs(ends[k], radii, view.r, view.t, view.fine_k, view.fine_kinv, fine[1], fine[0], table, box)
            inside = slice(box[2], box[3] + 1), slice(box[0], box[1] + 1)
            clear(fine_depth[inside], fine_limbs[inside])
            draw_limbs(table, view.fine_kinv, scratch, where, fine_depth, fine_limbs)
            _shade(table, view, view.fine_kinv, box, fine_depth, fine_limbs, fine_rgb)
            _average(fine_limbs, fine_rgb, samples, box, rgb[i])


@part
def _shade(table, view, kinv, box, depth, limbs, rgb):
    shade_body(table, kinv, box, view.lights, view.ambient, view.colours, view.encode, depth, limbs, rgb)


@part
def _average(limbs, fine, samples, box, rgb):
    """Mean of every samples × samples block of `fine` in `box`, rounded; `rgb` is kept where a sample shows no body.

    Only the box of `limbs` need be valid.
    """
    part, half = np.float32(1 / (samples * samples)), np.float32(0.5)
    for v in range(box[2] // samples, box[3] // samples + 1):
        for u in range(box[0] // samples, box[1] // samples + 1):
            red, green, blue, free = 0, 0, 0, samples * samples
            for y in range(max(v * samples, box[2]), min(v * samples + samples, box[3] + 1)):
                for x in range(max(u * samples, box[0]), min(u * samples + samples, box[1] + 1)):
                    if limbs[y, x] > 0:
                        red, green, blue = red + fine[y, x, 0], green + fine[y, x, 1], blue + fine[y, x, 2]
                        free -= 1
            if free < samples * samples:
                rgb[v, u, 0] = np.uint8(np.float32(red + free * rgb[v, u, 0]) * part + half)
                rgb[v, u, 1] = np.uint8(np.float32(green + free * rgb[v, u, 1]) * part + half)
                rgb[v, u, 2] = np.uint8(np.float32(blue + free * rgb[v, u, 2]) * part + half)


@kernel
def draw_crowd(start, stop, bodies, looks, cameras, lights, pictures):
    """Render bodies `start` to `stop` into their images.

    `bodies` are poses (n, 25) [m, rad], offsets (n, 16, 3) [m], radii (n, limbs, 2) [m] and heights (n,) [m]; `looks`
    linear colours (n, clothes, 3) and which of them each limb wears (limbs,); `cameras` intrinsics, their inverse and
    rotations world → camera (n, 3, 3) and translations (n, 3) [m]; `lights` those in the camera's frame (n, 2, 6),
    ambient light (3,) and the table linear light → byte; `pictures` depth, limbs and rgb, which is skipped if of length
    0.
    """
    (poses, offsets, radii, heights), (colours, worn), (k, kinv, r, t) = bodies, looks, cameras
    (directed, ambient, encode), (depth, limbs, rgb) = lights, pictures
    height, width = depth.shape[1:]
    count = radii.shape[1]
    table, box = np.empty((count, COLUMNS)), np.empty(4, np.int64)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    ends, dressed = np.empty((1, count, 2, 3)), np.empty((count, 3), np.float32)
    shifts = np.empty((count, 2, 3))
    for i in range(start, stop):
        set_shifts(LIMB_SEGMENT, LIMB_SHIFTS, radii[i], heights[i], shifts)
        write_limb_segments(poses[i : i + 1], offsets[i], heights[i], LIMB_SEGMENT, LIMB_NODES, shifts, ends)
        place_limbs(ends[0], radii[i], r[i], t[i], k[i], kinv[i], width, height, table, box)
        clear(depth[i], limbs[i])
        draw_limbs(table, kinv[i], scratch, where, depth[i], limbs[i])
        if len(rgb) > 0:
            _blacken(rgb[i])
            for limb in range(count):
                for c in range(3):
                    dressed[limb, c] = colours[i, worn[limb], c]
            shade_body(table, kinv[i], box, directed[i], ambient, dressed, encode, depth[i], limbs[i], rgb[i])


@part
def _blacken(rgb):
    flat = rgb.reshape(-1)
    for i in range(len(flat)):
        flat[i] = 0
