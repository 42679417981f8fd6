"""Colour: pyrender's own reflection formula (metallic 0, roughness 1), for the body and for the ground.

With n the normal, v and l the directions to camera and light, F = f0 + (1 - f0)(1 - v·h)⁵ (Schlick), the light
reflected is n·l (c (1 - f0)(1 - F) / π + F G / (π (4 n·l n·v + 0.001))), where G is Smith's term for roughness 1.
"""

import math

import numpy as np

from motionenv.render._raycast_kernel import DD, RA, RR, A, E, jit

#: Steps of the table that encodes linear light as bytes.
STEPS = 4096

_F0, _ONE, _HALF, _LEAST = np.float32(0.04), np.float32(1), np.float32(0.5), np.float32(0.001)
_FOUR, _ZERO, _INV_PI = np.float32(4), np.float32(0), np.float32(1 / math.pi)


def encoding() -> np.ndarray:
    """Bytes (STEPS,) that stand for linear light from 0 to 1: gamma 2.2."""
    return np.rint(255 * np.linspace(0, 1, STEPS) ** (1 / 2.2)).astype(np.uint8)


@jit
def reflect(nl, nv, lv):
    """Diffuse and specular share of the light that is reflected, from the cosines n·l, n·v and l·v (float32)."""
    nl, nv = min(max(nl, _LEAST), _ONE), min(max(abs(nv), _LEAST), _ONE)
    vh = math.sqrt(max(_HALF + _HALF * lv, _ZERO))
    x = _ONE - min(vh, _ONE)
    f = _F0 + (_ONE - _F0) * (x * x * x * x * x)
    g = nv / (nv * _HALF + _HALF) * (nl / (nl * _HALF + _HALF))
    diffuse = nl * (_ONE - f) * (_ONE - _F0) * _INV_PI
    return diffuse, nl * f * g * _INV_PI / (_FOUR * nl * nv + _LEAST)


@jit
def byte(light, table):
    """Byte that stands for linear light."""
    return table[int(min(max(light, _ZERO), _ONE) * np.float32(STEPS - 1) + _HALF)]


@jit
def shade_pixel(nx, ny, nz, vx, vy, vz, colour, lights, ambient, table, out):
    """Write the bytes (3,) of a surface with normal n seen from direction v. All float32."""
    d0, s0 = reflect(
        nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2],
        nx * vx + ny * vy + nz * vz,
        vx * lights[0, 0] + vy * lights[0, 1] + vz * lights[0, 2],
    )
    d1, s1 = reflect(
        nx * lights[1, 0] + ny * lights[1, 1] + nz * lights[1, 2],
        nx * vx + ny * vy + nz * vz,
        vx * lights[1, 0] + vy * lights[1, 1] + vz * lights[1, 2],
    )
    for i in range(3):
        diffuse = d0 * lights[0, 3 + i] + d1 * lights[1, 3 + i] + ambient[i]
        out[i] = byte(colour[i] * diffuse + s0 * lights[0, 3 + i] + s1 * lights[1, 3 + i], table)


@jit
def shade_body(table, kinv, box, lights, ambient, colours, encode, depth, limbs, rgb):
    """Colour the body's pixels inside `box` (first and last column and row); lights in the camera's frame."""
    for v in range(box[2], box[3] + 1):
        for u in range(box[0], box[1] + 1):
            if limbs[v, u] == 0:
                continue
            limb = limbs[v, u] - 1
            g = table[limb]
            z = depth[v, u]
            dx = np.float32(kinv[0, 0] * u + kinv[0, 1] * v + kinv[0, 2])
            dy = np.float32(kinv[1, 0] * u + kinv[1, 1] * v + kinv[1, 2])
            px, py, pz = z * dx - np.float32(g[A]), z * dy - np.float32(g[A + 1]), z - np.float32(g[A + 2])
            ex, ey, ez = np.float32(g[E]), np.float32(g[E + 1]), np.float32(g[E + 2])
            along = px * ex + py * ey + pz * ez - np.float32(g[RA] * g[RR])
            share = min(max(along / np.float32(max(g[DD], 1e-30)), _ZERO), _ONE)
            inverse = _ONE / (np.float32(g[RA]) - share * np.float32(g[RR]))
            back = -_ONE / math.sqrt(dx * dx + dy * dy + _ONE)
            shade_pixel(
                (px - share * ex) * inverse, (py - share * ey) * inverse, (pz - share * ez) * inverse,
                dx * back, dy * back, back, colours[limb], lights, ambient, encode, rgb[v, u],
            )  # fmt: skip
