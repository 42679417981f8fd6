"""Silhouettes and outlines of bodies in one pass over their limbs.

Outlines are sampled for `LANES` bodies at a time, in rows as in `_limbs_kernel`: loops over bodies become vector
instructions, and only looking up pixels is left to be done one by one.
"""

import math

import numpy as np
from numba import njit

from motionenv.body.skeleton import LIMBS
from motionenv.estimation._limbs_kernel import END_ROWS, LANES, WORK, set_limbs
from motionenv.estimation._silhouette_kernel import _mark_limb, _mark_near_limb, _set_balls, _sum
from motionenv.render._raycast_kernel import COLUMNS, GATHER, NEAR, set_limb

jit = njit(nogil=True, cache=True, error_model="numpy")

_ONE, _SIXTY_THREE = np.uint64(1), np.uint64(63)
_OUT = 1.5  # [pixels] beside an outline, where another limb would hide it
_ALONG, _ROUND = 4, 3  # points on each straight piece, and on each cap

# Points of a limb's outline: place along the axis; normal = (c0 + cs · sine, s0 + sc · cosine) along and across it;
# length of outline = l · axis · cosine + la · first radius + lb · second radius.
_STRAIGHT = [((i + 0.5) / _ALONG, 0, 1, 0, side, 1 / _ALONG, 0, 0) for i in range(_ALONG) for side in (-1, 1)]
_CAPS = [
    (ball, sign * math.cos(angle), 0, math.sin(angle), 0, 0, (1 - ball) * math.pi / _ROUND, ball * math.pi / _ROUND)
    for ball, sign in ((0, -1), (1, 1))
    for angle in np.linspace(-1, 1, _ROUND) * math.pi * (1 - 1 / _ROUND) / 2
]
_POINTS = np.array([*_STRAIGHT, *_CAPS], dtype=np.float64)

# Points of each limb: caps matter where the body ends; elsewhere the next limb has the same outline there.
_ENDING = ("head", "hand", "foot")
_COUNTS = np.array([len(_POINTS) if limb.split("_")[-1] in _ENDING else len(_STRAIGHT) for limb in LIMBS])

# Rows of a limb's geometry: centre, axis, radii, unit axis, length, sine and cosine of the taper.
_U, _V, _DU, _DV, _RA, _RB, _EU, _EV, _L, _S, _C = (i * LANES for i in range(11))
_GEOMETRY = 11 * LANES


@jit
def _set_geometry(ends, radius, r, t, k, g):
    """Write how a limb of each body lies in the picture [pixels], balls taken as circles.

    Length is 0 where there is no outline: one circle holds the other, or the limb reaches behind the camera.

    Args:
        ends: (6 * LANES,), of `set_limbs`.
        radius: (2,) [m].
        r, t: world → camera.
        k: intrinsics, upper triangular.
        g: (_GEOMETRY,) to write.
    """
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    tx, ty, tz, radius_a, radius_b = t[0], t[1], t[2], radius[0], radius[1]
    fx, skew, cx, fy, cy = k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]
    for j in range(LANES):
        x, y, z = ends[j], ends[LANES + j], ends[2 * LANES + j]
        px, py, pz = r0 * x + r1 * y + r2 * z + tx, r3 * x + r4 * y + r5 * z + ty, r6 * x + r7 * y + r8 * z + tz
        x, y, z = ends[3 * LANES + j], ends[4 * LANES + j], ends[5 * LANES + j]
        qx, qy, qz = r0 * x + r1 * y + r2 * z + tx, r3 * x + r4 * y + r5 * z + ty, r6 * x + r7 * y + r8 * z + tz
        seen = (pz - radius_a > NEAR) & (qz - radius_b > NEAR)
        za, zb = 1.0 / (pz if seen else 1.0), 1.0 / (qz if seen else 1.0)
        u, v = (fx * px + skew * py) * za + cx, fy * py * za + cy
        du, dv = (fx * qx + skew * qy) * zb + cx - u, fy * qy * zb + cy - v
        ra, rb = fy * radius_a * za, fy * radius_b * zb
        length = math.sqrt(du * du + dv * dv)
        seen = seen & (length > abs(ra - rb))
        over = 1.0 / (length if seen else 1.0)
        sine = (ra - rb) * over
        rest = 1.0 - sine * sine
        g[_U + j], g[_V + j], g[_DU + j], g[_DV + j], g[_RA + j], g[_RB + j] = u, v, du, dv, ra, rb
        g[_EU + j], g[_EV + j], g[_L + j] = du * over, dv * over, (length if seen else 0.0)
        g[_S + j], g[_C + j] = sine, math.sqrt(rest if rest > 0.0 else 0.0)


@jit
def _set_pixels(g, point, width, height, at, beside, weight):
    """Write a point's pixel, the pixel just outside of it, and its length of outline, for each body.

    Args:
        g: of `_set_geometry`.
        point: row of `_POINTS`.
        width, height: of the picture.
        at: (LANES,) number of the pixel, row by row.
        beside: (2 * LANES,) column, then row.
        weight: (LANES,) [pixels], 0 beside the picture.
    """
    along, c0, cs, s0, sc, l0, la, lb = point
    right, bottom = width - 1.0, height - 1.0
    for j in range(LANES):
        c, s = c0 + cs * g[_S + j], s0 + sc * g[_C + j]
        nu, nv = c * g[_EU + j] - s * g[_EV + j], c * g[_EV + j] + s * g[_EU + j]
        radius = g[_RA + j] + along * (g[_RB + j] - g[_RA + j])
        u, v = g[_U + j] + along * g[_DU + j] + radius * nu + 0.5, g[_V + j] + along * g[_DV + j] + radius * nv + 0.5
        inside = (u >= 0.0) & (u < width) & (v >= 0.0) & (v < height) & (g[_L + j] > 0.0)
        length = l0 * g[_L + j] * g[_C + j] + la * g[_RA + j] + lb * g[_RB + j]
        weight[j] = length if inside else 0.0
        u, v = (u if inside else 0.0), (v if inside else 0.0)
        at[j] = np.int64(v) * width + np.int64(u)
        x, y = u + _OUT * nu, v + _OUT * nv
        x, y = (x if x > 0.0 else 0.0), (y if y > 0.0 else 0.0)
        x, y = (x if inside & (x < right) else right), (y if inside & (y < bottom) else bottom)
        beside[j], beside[LANES + j] = np.int64(x), np.int64(y)


@jit
def _add(at, beside, weight, bits, odds, out):
    """Add a point's log-odds times length to `out` (LANES,), unless the body has the pixel on its outside."""
    for j in range(LANES):
        x = np.uint64(beside[j])
        word = bits[j, np.int64(x >> np.uint64(6)), beside[LANES + j]]
        free = _ONE - ((word >> (x & _SIXTY_THREE)) & _ONE)
        out[j] += weight[j] * odds[at[j]] * np.float64(free)


@jit
def _add_outlines(w, radii, r, t, k, bits, odds, g, at, beside, weight, out):
    """Write sums of log-odds along the outlines of a block's bodies to `out` (LANES,)."""
    height, width = odds.shape
    flat = odds.reshape(-1)
    out[:] = 0.0
    for limb in range(len(radii)):
        _set_geometry(w[6 * LANES * limb : 6 * LANES * (limb + 1)], radii[limb], r, t, k, g)
        for i in range(_COUNTS[limb]):
            p = _POINTS[i]
            point = (p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7])
            _set_pixels(g, point, width, height, at, beside, weight)
            _add(at, beside, weight, bits, flat, out)


@jit
def body_sums(poses, offsets, shifts, body_height, radii, r, t, k, kinv, running, odds, silhouettes, outlines):
    """Sums of one picture under silhouettes, and of another along outlines.

    A limb that reaches behind the camera has no outline here.

    Args:
        poses: (n, 25) [m, rad].
        offsets: of the skeleton.
        shifts: (limbs, 2, 3), `LIMB_SHIFTS`.
        body_height: of the skeleton [m].
        radii: (limbs, 2) [m].
        r, t: world → camera.
        k: (3, 3) intrinsics, upper triangular with positive diagonal.
        kinv: their inverse.
        running: (height, width + 1), sums of each row of the picture up to a column.
        odds: (height, width), per pixel of outline.
        silhouettes: (n,) to write.
        outlines: (n,) to write.
    """
    height, width = running.shape[0], running.shape[1] - 1
    bits, spans = np.zeros((LANES, (width + 63) >> 6, height), np.uint64), np.empty((2, height), np.int64)
    balls, ellipses, lines, g = np.empty((2, 4)), np.empty((2, 7)), np.empty((2, 4)), np.empty(COLUMNS)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    depth, limbs = np.empty((height, width), np.float32), np.empty((height, width), np.uint8)
    w, geometry, ends = np.empty(WORK), np.empty(_GEOMETRY), np.empty((len(radii), 2, 3))
    at, beside, weight = np.empty(LANES, np.int64), np.empty(2 * LANES, np.int64), np.empty(LANES)
    rows, along = np.empty((LANES, 2), np.int64), np.empty(LANES)
    for start in range(0, len(poses), LANES):
        n = min(LANES, len(poses) - start)
        set_limbs(poses, start, offsets, shifts, body_height, w)
        for j in range(n):
            first, last, flat = height, -1, ends.reshape(-1)
            for row in range(END_ROWS):
                flat[row] = w[row * LANES + j]
            for limb in range(len(radii)):
                if _set_balls(ends[limb], radii[limb], r, t, balls) > NEAR:
                    a, b = _mark_limb(balls, k, width, height, spans, ellipses, lines, bits[j])
                else:
                    set_limb(ends[limb], radii[limb], r, t, k, kinv, width, height, g)
                    a, b = _mark_near_limb(g, kinv, depth, limbs, bits[j], scratch, where)
                if a <= b:
                    first, last = min(first, a), max(last, b)
            rows[j, 0], rows[j, 1] = first, last
        _add_outlines(w, radii, r, t, k, bits, odds, geometry, at, beside, weight, along)
        for j in range(n):
            outlines[start + j] = along[j]
            silhouettes[start + j] = _sum(bits[j], rows[j, 0], rows[j, 1], running)
