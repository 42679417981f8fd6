"""Render different bodies, each from its own camera, on black: kinematics, limbs and colours in one kernel."""

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.body.kinematics import write_limb_segments
from motionenv.body.skeleton import LIMB_NODES, LIMB_SEGMENT, LIMB_SHIFTS
from motionenv.render.raycast._draw_kernel import clear, draw_limbs, place_limbs
from motionenv.render.raycast._shade_kernel import shade_body
from motionenv.render.raycast.limb_kernel import COLUMNS, GATHER


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
    for i in range(start, stop):
        write_limb_segments(poses[i : i + 1], offsets[i], heights[i], LIMB_SEGMENT, LIMB_NODES, LIMB_SHIFTS, ends)
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
