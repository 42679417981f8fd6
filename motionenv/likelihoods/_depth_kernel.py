"""Agreement of bodies with a depth image, by ray casting without storing the rendered image."""

import math

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.render.raycast.limb_kernel import BOX, COLUMNS, GATHER, draw_limb, set_limb


@kernel
def _draw(ends, radii, r, t, k, kinv, table, depth, limbs, scratch, where):
    """Render one body into `depth`; returns first and last column and row of its bounding box."""
    height, width = depth.shape
    left, right, top, bottom = width, -1, height, -1
    for i in range(len(radii)):
        g = table[i]
        set_limb(ends[i], radii[i], r, t, k, kinv, width, height, g)
        if g[BOX] <= g[BOX + 1] and g[BOX + 2] <= g[BOX + 3]:
            left, right = min(left, int(g[BOX])), max(right, int(g[BOX + 1]))
            top, bottom = min(top, int(g[BOX + 2])), max(bottom, int(g[BOX + 3]))
    for v in range(top, bottom + 1):
        for u in range(left, right + 1):
            depth[v, u] = np.inf
    for i in range(len(radii)):
        g = table[i]
        if g[BOX] <= g[BOX + 1] and g[BOX + 2] <= g[BOX + 3]:
            draw_limb(g, kinv, np.uint8(1), width, depth.reshape(-1), limbs.reshape(-1), scratch, where)
    return left, right, top, bottom


@kernel
def depth_sums(ends, radii, r, t, k, kinv, observed, odds, noise, out):
    """Write to `out` (n,) the log-odds of body against background, summed over the pixels that each body covers.

    Bodies and camera are given as in `_silhouette_kernel.silhouette_sums`. `observed` (height, width) are float32
    depths [m], infinite for background and NaN for occluders, and `noise` [m] is their standard deviation. `odds` (3,)
    are the log-odds at background; elsewhere they are `log(odds[1] e + odds[2])` with e = exp(-½ (difference /
    noise)²).
    """
    height, width = observed.shape
    table = np.empty((len(radii), COLUMNS))
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    depth, limbs = np.empty((height, width), np.float32), np.empty((height, width), np.uint8)
    for i in range(len(ends)):
        box = _draw(ends[i], radii, r, t, k, kinv, table, depth, limbs, scratch, where)
        total = 0.0
        for v in range(box[2], box[3] + 1):
            for u in range(box[0], box[1] + 1):
                if depth[v, u] == np.inf or math.isnan(observed[v, u]):
                    continue
                if observed[v, u] == np.inf:
                    total += odds[0]
                else:
                    z = (np.float64(depth[v, u]) - observed[v, u]) / noise
                    total += math.log(odds[1] * math.exp(-0.5 * z * z) + odds[2])
        out[i] = total
