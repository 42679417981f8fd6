"""Silhouettes and outlines of bodies in one pass over their limbs.

Outlines are sampled for `LANES` bodies at a time, in rows as in `_limbs_kernel`, so that loops over bodies become SIMD
instructions. Only the pixel look-ups are scalar.
"""

import math

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.body.skeleton import LIMBS
from motionenv.likelihoods._limbs_kernel import LANES, WORK, set_limbs
from motionenv.likelihoods._silhouette_kernel import EXTENT, GROUP, OUTLINE, add_marked, fill, mark_bodies
from motionenv.render.raycast.limb_kernel import NEAR

_ONE, _NONE = np.uint64(1), np.uint64(0)
_ZERO, _HALF, _UNIT = np.float32(0), np.float32(0.5), np.float32(1)
_OUT = np.float32(1.5)  # [pixels] outward distance at which another limb would occlude the outline
_ALONG, _ROUND = 4, 3  # sample points on each straight piece, and on each cap

# Sides of a limb's outline: normal = (c0 + cs · sine, s0 + sc · cosine) along and across the axis; outline length per
# point = l · axis · cosine + la · first radius + lb · second radius; evenly spaced positions along the axis from the
# first to the last. The first two are straight pieces, the others points of the caps.
_STRAIGHT = [(0, 1, 0, side, 1 / _ALONG, 0, 0, 0.5 / _ALONG, 1 - 0.5 / _ALONG, _ALONG) for side in (-1, 1)]
_CAPS = [
    (
        sign * math.cos(angle),
        0,
        math.sin(angle),
        0,
        0,
        (1 - end) * math.pi / _ROUND,
        end * math.pi / _ROUND,
        end,
        end,
        1,
    )
    for end, sign in ((0, -1), (1, 1))
    for angle in np.linspace(-1, 1, _ROUND) * math.pi * (1 - 1 / _ROUND) / 2
]
_SIDES = np.array([*_STRAIGHT, *_CAPS], dtype=np.float32)

# Only limbs at the end of a chain need caps; elsewhere the next limb covers them.
_ENDING = ("head", "hand", "foot")
_COUNTS = np.array([len(_SIDES) if limb.split("_")[-1] in _ENDING else len(_STRAIGHT) for limb in LIMBS])

# Rows of a limb's geometry: centre, axis, radii, unit axis, length, sine and cosine of the taper.
_U, _V, _DU, _DV, _RA, _RB, _EU, _EV, _L, _S, _C = (i * LANES for i in range(11))
# Rows of a side: first point, vector to the last point, vector to the pixel just outside, length per point.
_FU, _FV, _TU, _TV, _OU, _OV, _W = (i * LANES for i in range(11, 18))
_GEOMETRY = 18 * LANES

# Rows of a point: index of its pixel (row-major), and index of the bit of the pixel just outside.
_POINT = 2 * LANES


@kernel
def _set_geometry(ends, radius, r, t, k, g):
    """Write the projection `g` of one limb of each body [pixels], spheres approximated by circles.

    `ends` (6 * LANES,) are from `set_limbs`, and `radius` (2,) is in metres. Length is 0 if there is no outline: one
    circle contains the other, or the limb reaches behind the camera.
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


@kernel
def _set_side(g, side):
    """Write a side of a limb's outline, a row of `_SIDES`, to the last rows of its geometry `g`."""
    c0, cs, s0, sc, l0, la, lb = side
    for j in range(LANES):
        c, s = c0 + cs * g[_S + j], s0 + sc * g[_C + j]
        nu, nv = c * g[_EU + j] - s * g[_EV + j], c * g[_EV + j] + s * g[_EU + j]
        taper = g[_RB + j] - g[_RA + j]
        g[_FU + j], g[_FV + j] = g[_U + j] + g[_RA + j] * nu + _HALF, g[_V + j] + g[_RA + j] * nv + _HALF
        g[_TU + j], g[_TV + j] = g[_DU + j] + taper * nu, g[_DV + j] + taper * nv
        g[_OU + j], g[_OV + j] = _OUT * nu, _OUT * nv
        length = l0 * g[_L + j] * g[_C + j] + la * g[_RA + j] + lb * g[_RB + j]
        g[_W + j] = length if g[_L + j] > _ZERO else _ZERO


@kernel
def _set_pixels(g, along, width, height, words, point, weight):
    """Write, for each body, the pixel of a point at the share `along` of a side's axis.

    The image's rows have `words` words of bits. `point` (_POINT,) is uint32; `weight` (LANES,) is the length of outline
    [pixels] for which the point stands, 0 outside of the image.
    """
    wide, high = np.float32(width), np.float32(height)
    right, bottom = np.float32(width - 1), np.float32(height - 1)
    for j in range(LANES):
        u, v = g[_FU + j] + along * g[_TU + j], g[_FV + j] + along * g[_TV + j]
        inside = (u >= _ZERO) & (u < wide) & (v >= _ZERO) & (v < high)
        weight[j] = g[_W + j] if inside else _ZERO
        u, v = (u if inside else _ZERO), (v if inside else _ZERO)
        point[j] = np.int32(v) * width + np.int32(u)
        u, v = u + g[_OU + j], v + g[_OV + j]
        u, v = (u if u > _ZERO else _ZERO), (v if v > _ZERO else _ZERO)
        x, y = np.int32(u if u < right else right), np.int32(v if v < bottom else bottom)
        point[LANES + j] = (((y * words + (x >> 6)) * LANES + j) << 6) | (x & 63)


@kernel
def _add(point, weight, bits, odds, out):
    """Add a point's log-odds times length to `out` (LANES,), unless the body covers the pixel just outside."""
    for j in range(LANES):
        bit = point[LANES + j]
        free = _ONE - ((bits[bit >> np.uint32(6)] >> np.uint64(bit & np.uint32(63))) & _ONE)
        out[j] += np.float64(weight[j] * np.float32(free)) * odds[point[j]]


@kernel
def _add_outlines(w, radii, r, t, k, bits, odds, g, point, weight, out):
    """Write sums of log-odds along the outlines of a block's bodies to `out` (LANES,)."""
    height, width = odds.shape
    words, flat, marks = bits.shape[1], odds.reshape(-1), bits.reshape(-1)
    fill(out, 0.0)
    for limb in range(len(radii)):
        _set_geometry(w[6 * LANES * limb : 6 * LANES * (limb + 1)], radii[limb], r, t, k, g)
        for i in range(_COUNTS[limb]):
            s = _SIDES[i]
            _set_side(g, (s[0], s[1], s[2], s[3], s[4], s[5], s[6]))
            places, first, step = int(s[9]), s[7], (s[8] - s[7]) / max(s[9] - _UNIT, _UNIT)
            for place in range(places):
                _set_pixels(g, first + np.float32(place) * step, width, height, words, point, weight)
                _add(point, weight, marks, flat, out)


@kernel
def body_sums(poses, offsets, shifts, body_height, radii, r, t, k, kinv, inside, along, silhouettes, outlines):
    """Write sums of `inside` over silhouettes to `silhouettes` (n,), and of `along` along outlines to `outlines`.

    Both images are (height, width); a limb that reaches behind the camera has no outline. Poses and body are given as
    in `_limbs_kernel.limb_ends`, the camera as in `_silhouette_kernel.silhouette_sums`.
    """
    height, width = inside.shape
    bits, spans = np.zeros((height, (width + 63) >> 6, LANES), np.uint64), np.empty((2, GROUP), np.int64)
    outline, extent = np.empty(OUTLINE, np.float32), np.empty(EXTENT, np.int32)
    w, geometry, sums = np.empty(WORK), np.empty(_GEOMETRY, np.float32), np.empty(LANES)
    point, weight = np.empty(_POINT, np.uint32), np.empty(LANES, np.float32)
    for start in range(0, len(poses), LANES):
        n = min(LANES, len(poses) - start)
        set_limbs(poses, start, offsets, shifts, body_height, w)
        mark_bodies(w, radii, r, t, k, kinv, bits, width, spans, outline, extent)
        _add_outlines(w, radii, r, t, k, bits, along, geometry, point, weight, sums)
        for j in range(n):
            outlines[start + j] = sums[j]
        add_marked(bits, inside, sums)
        for j in range(n):
            silhouettes[start + j] = sums[j]
