"""Shading: pyrender's reflectance model (metallic 0, roughness 1) for body and ground.

With n the normal, v and l the directions to camera and light, F = f0 + (1 - f0)(1 - v·h)⁵ (Schlick), the reflected
light is n·l (c (1 - f0)(1 - F) / π + F G / (π (4 n·l n·v + 0.001))), where G is Smith's term for roughness 1.
"""

import math

import numpy as np

from motionenv._core.compilation import part
from motionenv.render.raycast.limb_kernel import DD, RA, RR, A, E

#: Steps of the table that encodes linear light as bytes.
STEPS = 4096
_GATHER = 512  # pixels shaded together: fits the L1 cache

_F0, _ONE, _HALF, _LEAST = np.float32(0.04), np.float32(1), np.float32(0.5), np.float32(0.001)
_FOUR, _ZERO, _INV_PI = np.float32(4), np.float32(0), np.float32(1 / math.pi)


def encoding() -> np.ndarray:
    """Bytes (STEPS,) for linear light from 0 to 1: gamma 2.2."""
    return np.rint(255 * np.linspace(0, 1, STEPS) ** (1 / 2.2)).astype(np.uint8)


@part
def reflect(nl, nv, lv):
    """Diffuse and specular reflectance, from the cosines n·l, n·v and l·v (float32)."""
    nl = _LEAST if not nl > _LEAST else (_ONE if nl > _ONE else nl)
    nv = _LEAST if not nv > _LEAST else (_ONE if nv > _ONE else nv)
    half = _HALF + _HALF * lv
    x = _ONE - math.sqrt(half if half > _ZERO else _ZERO)  # v·h, with the half-way vector h
    x = x if x > _ZERO else _ZERO
    f = _F0 + (_ONE - _F0) * (x * x * x * x * x)
    g = nl * nv / ((nl * _HALF + _HALF) * (nv * _HALF + _HALF))
    return nl * (_ONE - f) * ((_ONE - _F0) * _INV_PI), nl * f * g * _INV_PI / (_FOUR * nl * nv + _LEAST)


@part
def byte(light, table):
    """Encode linear light as a byte."""
    light = _ZERO if not light > _ZERO else (_ONE if light > _ONE else light)
    return table[int(light * np.float32(STEPS - 1) + _HALF)]


@part
def shade_body(table, kinv, box, lights, ambient, colours, encode, depth, limbs, rgb):
    """Colour the body's pixels in `rgb`, gathered in blocks for SIMD.

    `table` holds the limbs, from `set_limb`, and `box` the body's first and last column and row; `kinv` (3, 3) maps
    pixels to rays. `lights` (2, 6), direction in the camera's frame and radiance, `ambient` (3,) and `colours` (limbs,
    3) are linear; `encode` is the table of `encoding`.
    """
    small = np.empty(table.shape, np.float32)
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            small[i, j] = table[i, j]
    columns, light = np.empty((5, _GATHER), np.float32), np.empty((6, _GATHER), np.float32)
    where = np.empty((_GATHER, 2), np.int64)
    n = np.int64(0)  # for a literal 0, the parts below would be compiled a second time
    for v in range(box[2], box[3] + 1):
        for u in range(box[0], box[1] + 1):
            if limbs[v, u] == 0:
                continue
            _normal(small[limbs[v, u] - 1], kinv, u, v, depth[v, u], columns, n)
            where[n, 0], where[n, 1] = u, v
            n += 1
            if n == _GATHER:
                _illuminate(columns, n, lights, ambient, light)
                _colour(where, n, light, colours, encode, limbs, rgb)
                n = 0
    _illuminate(columns, n, lights, ambient, light)
    _colour(where, n, light, colours, encode, limbs, rgb)


@part
def _normal(g, kinv, u, v, z, surface, n):
    """Write the normal at depth `z` of pixel (u, v), and the ray's x and y, to column `n` of `surface` (5, ...)."""
    dx = np.float32(kinv[0, 0] * u + kinv[0, 1] * v + kinv[0, 2])
    dy = np.float32(kinv[1, 0] * u + kinv[1, 1] * v + kinv[1, 2])
    px, py, pz = z * dx - g[A], z * dy - g[A + 1], z - g[A + 2]
    along = px * g[E] + py * g[E + 1] + pz * g[E + 2] - g[RA] * g[RR]
    share = along / g[DD]
    share = _ZERO if not share > _ZERO else (_ONE if share > _ONE else share)  # also maps the NaN of a sphere to 0
    inverse = _ONE / (g[RA] - share * g[RR])
    surface[0, n] = (px - share * g[E]) * inverse
    surface[1, n] = (py - share * g[E + 1]) * inverse
    surface[2, n] = (pz - share * g[E + 2]) * inverse
    surface[3, n], surface[4, n] = dx, dy


@part
def _illuminate(surface, n, lights, ambient, light):
    """Diffuse (rows 0 to 2 of `light`: red, green, blue) and specular light (rows 3 to 5) in the first n columns."""
    x0, y0, z0, x1, y1, z1 = lights[0, 0], lights[0, 1], lights[0, 2], lights[1, 0], lights[1, 1], lights[1, 2]
    r0, g0, b0, r1, g1, b1 = lights[0, 3], lights[0, 4], lights[0, 5], lights[1, 3], lights[1, 4], lights[1, 5]
    ra, ga, ba = ambient[0], ambient[1], ambient[2]
    for i in range(n):
        nx, ny, nz, dx, dy = surface[0, i], surface[1, i], surface[2, i], surface[3, i], surface[4, i]
        back = -_ONE / math.sqrt(dx * dx + dy * dy + _ONE)
        nv = (nx * dx + ny * dy + nz) * back
        d0, s0 = reflect(nx * x0 + ny * y0 + nz * z0, nv, (dx * x0 + dy * y0 + z0) * back)
        d1, s1 = reflect(nx * x1 + ny * y1 + nz * z1, nv, (dx * x1 + dy * y1 + z1) * back)
        light[0, i], light[1, i], light[2, i] = d0 * r0 + d1 * r1 + ra, d0 * g0 + d1 * g1 + ga, d0 * b0 + d1 * b1 + ba
        light[3, i], light[4, i], light[5, i] = s0 * r0 + s1 * r1, s0 * g0 + s1 * g1, s0 * b0 + s1 * b1


@part
def _colour(where, n, light, colours, encode, limbs, rgb):
    """Write the bytes of the first n pixels `where`."""
    for i in range(n):
        u, v = where[i, 0], where[i, 1]
        limb = limbs[v, u] - 1
        for c in range(3):
            rgb[v, u, c] = byte(colours[limb, c] * light[c, i] + light[3 + c, i], encode)
