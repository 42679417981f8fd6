"""Sums of colour log-odds over sample points on the visible parts of limbs."""

import math

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.render.raycast.limb_kernel import NEAR

_ALONG, _ACROSS = 4, 3  # sample points per limb
_X, _Y, _Z, _R = 0, 1, 2, 3


@kernel
def _set_circles(ends, radii, r, t, k, circles):
    """Write the projections of a limb's end spheres, (limbs, 2, 4): u, v, depth [m] and radius [pixels]."""
    for limb in range(len(radii)):
        for end in range(2):
            p, c = ends[limb, end], circles[limb, end]
            x = r[0, 0] * p[0] + r[0, 1] * p[1] + r[0, 2] * p[2] + t[0]
            y = r[1, 0] * p[0] + r[1, 1] * p[1] + r[1, 2] * p[2] + t[1]
            c[_Z] = r[2, 0] * p[0] + r[2, 1] * p[1] + r[2, 2] * p[2] + t[2]
            over = 1.0 / c[_Z] if c[_Z] > NEAR else 0.0
            c[_X], c[_Y] = (k[0, 0] * x + k[0, 1] * y) * over + k[0, 2], k[1, 1] * y * over + k[1, 2]
            c[_R] = k[1, 1] * radii[limb, end] * over


@kernel
def _hidden(circles, limb, u, v, depth):
    """Whether another limb occludes the point (u, v) of `limb` at `depth` [m]."""
    for other in range(len(circles)):
        a, b = circles[other, 0], circles[other, 1]
        if other == limb or min(a[_Z], b[_Z]) >= depth or a[_R] == 0.0 or b[_R] == 0.0:
            continue
        du, dv = b[_X] - a[_X], b[_Y] - a[_Y]
        s = min(1.0, max(0.0, ((u - a[_X]) * du + (v - a[_Y]) * dv) / (du * du + dv * dv + 1e-12)))
        x, y, radius = u - a[_X] - s * du, v - a[_Y] - s * dv, a[_R] + s * (b[_R] - a[_R])
        if x * x + y * y < radius * radius and a[_Z] + s * (b[_Z] - a[_Z]) < depth:
            return True
    return False


@kernel
def _limb_sum(circles, limb, odds):
    """Sum over the sample points of one limb, each weighted by its share of the limb's pixels."""
    height, width = odds.shape
    a, b = circles[limb, 0], circles[limb, 1]
    if a[_R] == 0.0 or b[_R] == 0.0:
        return 0.0
    du, dv = b[_X] - a[_X], b[_Y] - a[_Y]
    length = max(math.hypot(du, dv), 1e-6)
    total = 0.0
    for i in range(_ALONG):
        s = (i + 0.5) / _ALONG
        radius, depth = a[_R] + s * (b[_R] - a[_R]), a[_Z] + s * (b[_Z] - a[_Z])
        for j in range(_ACROSS):
            side = radius * ((2.0 * j + 1.0) / _ACROSS - 1.0) / length
            u, v = a[_X] + s * du - side * dv, a[_Y] + s * dv + side * du
            x, y = math.floor(u + 0.5), math.floor(v + 0.5)
            if x >= 0 and x < width and y >= 0 and y < height and not _hidden(circles, limb, u, v, depth):
                total += radius * odds[int(y), int(x)]
    return total * 2.0 * (length + a[_R] + b[_R]) / (_ALONG * _ACROSS)


@kernel
def colour_sums(ends, radii, r, t, k, odds, out):
    """Write to `out` (n,) the sum of colour log-odds (limbs, height, width) over the limbs of each body.

    Bodies and camera are given as in `_silhouette_kernel.silhouette_sums`.
    """
    circles = np.empty((len(radii), 2, 4))
    for i in range(len(ends)):
        _set_circles(ends[i], radii, r, t, k, circles)
        total = 0.0
        for limb in range(len(radii)):
            total += _limb_sum(circles, limb, odds[limb])
        out[i] = total
