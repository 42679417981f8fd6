"""Sums of an image over the silhouettes of bodies, without rendering them.

The silhouette of a limb, the convex hull of two spheres, is the convex hull of the spheres' ellipses. With a ray
(x, y, 1), w = y Y + Z and a sphere of radius r about (X, Y, Z), C = X² + Y² + Z² - r² and q = Y² + Z² - r²,

    x = (X w ± √(C (w² - q (1 + y²)))) / q

so every pixel row meets an ellipse in a span whose centre is linear, and whose squared half width is quadratic, in the
row. The hull adds the two common tangents of the ellipses; a row's span reaches from the leftmost to the rightmost of
ellipses and tangents. Spans are collected in bit masks, one bit per pixel, so that overlapping limbs count once.

`LANES` bodies are processed at a time, laid out as in `_limbs_kernel`, so that loops over bodies become SIMD
instructions. Ellipses and tangents are float64, spans float32, accurate to about 1e-5 pixels.
"""

import math

import numpy as np
from numba import njit
from numba.cpython.unsafe.numbers import leading_zeros, trailing_zeros

from motionenv._core.compilation import kernel
from motionenv.likelihoods._limbs_kernel import END_ROWS, LANES
from motionenv.render.raycast.limb_kernel import BOX, COLUMNS, GATHER, NEAR, draw_limb, set_limb

_inline = njit(inline="always", error_model="numpy")

_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_NONE, _ONE = np.uint64(0), np.uint64(1)
_ZERO, _INF = np.float32(0), np.float32(np.inf)

GROUP = 16  # bodies whose rows are processed together: few, because their limbs are at different heights

# Rows of a limb's outline in a block. For each sphere: first and last row of its ellipse, half width over half height,
# column of the span centres at the principal point's row, and their slope. For each line: first and last row, column
# there, slope. This parametrisation avoids cancellation for limbs that almost touch the camera.
_LINES = 10 * LANES
OUTLINE = 18 * LANES
# Rows of its extent: first and last pixel row that it can cover, and whether it reaches behind the camera.
_LAST, _NEAR = LANES, 2 * LANES
EXTENT = 3 * LANES

_ABOVE, _HIGHER = np.float32(-1), np.float32(-2)  # first and last row of an empty extent
_MARGIN = np.float32(1e-3)  # [pixels] safety margin of an extent; rows beside an outline have no span


@_inline
def _put_ellipse(x, y, z, r, fx, skew, cx, fy, cy, seen, outline, at):
    """Write the outline of a sphere, empty unless `seen`; returns first and last row."""
    over = 1.0 / fy
    yz, zz = y * y + z * z - r * r, z * z - r * r
    both = 1.0 / (yz * zz)
    p, q = both * yz, both * zz
    middle, reach, width = cy + fy * (y * z * p), fy * r * p * math.sqrt(yz), fx * q * over
    first, last = np.float32(middle - reach), np.float32(middle + reach)
    outline[at], outline[at + LANES] = (first if seen else _ABOVE), (last if seen else _HIGHER)
    outline[at + 2 * LANES] = math.sqrt(np.float32(width * width * (x * x + yz) * zz))
    outline[at + 3 * LANES], outline[at + 4 * LANES] = cx + fx * x * z * q, (fx * x * y * q + skew) * over
    return first, last


@_inline
def _put_line(ax, ay, az, ra, by, bz, rb, x, y, z, fx, skew, cx, fy, cy, there, outline, at):
    """Write the segment at which a plane with normal (x, y, z) touches both spheres."""
    pz, qz = az - ra * z, bz - rb * z
    both = 1.0 / (pz * qz * x)
    p, q = cy + fy * (ay - ra * y) * (both * qz * x), cy + fy * (by - rb * y) * (both * pz * x)
    over = -fx * (both * pz * qz)
    first, last = (p if p < q else q), (q if p < q else p)
    outline[at], outline[at + LANES] = (first if there else np.inf), (last if there else -np.inf)
    outline[at + 2 * LANES], outline[at + 3 * LANES] = cx + over * z, (over * y + skew) / fy


@_inline
def _put_lines(ax, ay, az, ra, bx, by, bz, rb, fx, skew, cx, fy, cy, seen, outline, j):
    """Write the tangent segments of a limb's outline, empty unless `seen`.

    Planes through the camera touch both spheres at them: unit normals n with n·a = r_a, n·b = r_b, between the points
    a - r_a n and b - r_b n. There are none (last row before the first) if one sphere hides the other.
    """
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = nx * nx + ny * ny + nz * nz
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    over = 1.0 / size
    p, q = (ra * bb - rb * ab) * over, (rb * aa - ra * ab) * over
    mx, my, mz = p * ax + q * bx, p * ay + q * by, p * az + q * bz
    rest = 1.0 - (mx * mx + my * my + mz * mz)
    there = seen & (size >= 1e-12 * aa * bb) & (rest > 0.0)
    step = math.sqrt((rest if there else 0.0) * over)
    sx, sy, sz = step * nx, step * ny, step * nz
    at, other = _LINES + j, _LINES + 4 * LANES + j
    _put_line(ax, ay, az, ra, by, bz, rb, mx + sx, my + sy, mz + sz, fx, skew, cx, fy, cy, there, outline, at)
    _put_line(ax, ay, az, ra, by, bz, rb, mx - sx, my - sy, mz - sz, fx, skew, cx, fy, cy, there, outline, other)


@kernel
def _set_outlines(ends, radius, r, t, k, height, outline, extent):
    """Write a limb's image outline for each body of a block; empty unless the limb is wholly in front of the camera.

    `ends` (6 * LANES,) are from `set_limbs`. The float32 `outline` (OUTLINE,) and int32 `extent` (EXTENT,) are written.
    """
    r0, r1, r2, r3, r4, r5, r6, r7, r8 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    tx, ty, tz, ra, rb = t[0], t[1], t[2], radius[0], radius[1]
    fx, skew, cx, fy, cy = k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]
    before, bottom, below = np.float32(-1), np.float32(height - 1), np.float32(height)
    for j in range(LANES):
        x, y, z = ends[j], ends[LANES + j], ends[2 * LANES + j]
        ax, ay, az = r0 * x + r1 * y + r2 * z + tx, r3 * x + r4 * y + r5 * z + ty, r6 * x + r7 * y + r8 * z + tz
        x, y, z = ends[3 * LANES + j], ends[4 * LANES + j], ends[5 * LANES + j]
        bx, by, bz = r0 * x + r1 * y + r2 * z + tx, r3 * x + r4 * y + r5 * z + ty, r6 * x + r7 * y + r8 * z + tz
        seen = (az - ra > NEAR) & (bz - rb > NEAR)
        first, last = _put_ellipse(ax, ay, az, ra, fx, skew, cx, fy, cy, seen, outline, j)
        top, end = _put_ellipse(bx, by, bz, rb, fx, skew, cx, fy, cy, seen, outline, 5 * LANES + j)
        _put_lines(ax, ay, az, ra, bx, by, bz, rb, fx, skew, cx, fy, cy, seen, outline, j)
        first, last = (first if first < top else top), (last if last > end else end)
        first, last = (first - _MARGIN if seen else below), (last + _MARGIN if seen else before)
        first, last = (first if first > _ZERO else _ZERO), (last if last < bottom else bottom)
        first, last = (first if first < below else below), (last if last > before else before)
        extent[j], extent[_LAST + j] = math.ceil(first), math.floor(last)
        extent[_NEAR + j] = 0 if seen else 1


@kernel
def _set_spans(v, down, outline, width, low, high):
    """Write the first and last pixel (GROUP,) of each body's limb in row `v`; last < first where there is none.

    The row lies `down` rows below the principal point; `outline` starts at the group's first body.
    """
    right, before = width - np.float32(1), np.float32(-1)
    for j in range(GROUP):
        h = (v - outline[j]) * (outline[LANES + j] - v)
        half = outline[2 * LANES + j] * math.sqrt(h if h > _ZERO else _ZERO)
        middle = outline[3 * LANES + j] + outline[4 * LANES + j] * down
        x, y = middle - half, middle + half
        x, y = (x if h >= _ZERO else _INF), (y if h >= _ZERO else -_INF)
        h = (v - outline[5 * LANES + j]) * (outline[6 * LANES + j] - v)
        half = outline[7 * LANES + j] * math.sqrt(h if h > _ZERO else _ZERO)
        middle = outline[8 * LANES + j] + outline[9 * LANES + j] * down
        p, q = middle - half, middle + half
        p, q = (p if h >= _ZERO else _INF), (q if h >= _ZERO else -_INF)
        x, y = (p if p < x else x), (q if q > y else y)
        within = (v >= outline[10 * LANES + j]) & (v <= outline[11 * LANES + j])
        p = outline[12 * LANES + j] + outline[13 * LANES + j] * down
        x, y = (p if within & (p < x) else x), (p if within & (p > y) else y)
        within = (v >= outline[14 * LANES + j]) & (v <= outline[15 * LANES + j])
        p = outline[16 * LANES + j] + outline[17 * LANES + j] * down
        x, y = (p if within & (p < x) else x), (p if within & (p > y) else y)
        x, y = (x if x > _ZERO else _ZERO), (y if y < right else right)
        x, y = (x if x < width else width), (y if y > before else before)
        low[j], high[j] = np.int32(math.ceil(x)), np.int32(math.floor(y))


@kernel
def _mark(low, high, row, group):
    """Set the bits from `low` to `high` (GROUP,) for the bodies from `group` on in a row of pixels (words, LANES)."""
    start, end = 64 * len(row), -1
    for j in range(GROUP):
        start, end = (low[j] if low[j] < start else start), (high[j] if high[j] > end else end)
    for word in range(start >> 6, (end >> 6) + 1):
        bits, column = row[word, group : group + GROUP], 64 * word
        for j in range(GROUP):
            first, last = low[j] - column, high[j] - column
            first, last = (first if first > 0 else 0), (last if last < 63 else 63)
            mask = (_ALL << np.uint64(first & 63)) & (_ALL >> np.uint64((63 - last) & 63))
            bits[j] |= mask if first <= last else _NONE


@kernel
def _mark_limb(outline, extent, centre, width, spans, bits):
    """Mark a limb of the bodies of a block, where it lies wholly in front of the camera."""
    low, high = spans[0], spans[1]
    for group in range(0, LANES, GROUP):
        first, last = len(bits), -1
        for j in range(group, group + GROUP):
            top, end = extent[j], extent[_LAST + j]
            first, last = (top if top < first else first), (end if end > last else last)
        for v in range(first, last + 1):
            _set_spans(np.float32(v), np.float32(v - centre), outline[group:], np.float32(width), low, high)
            _mark(low, high, bits[v], group)


@kernel
def _mark_near_limb(g, kinv, depth, limbs, bits, scratch, where):
    """Mark a limb that reaches behind the camera in `bits` (height, words), by casting a ray per pixel."""
    width = depth.shape[1]
    if g[BOX] > g[BOX + 1]:
        return
    flat = depth.reshape(-1)
    fill(flat, np.inf)
    draw_limb(g, kinv, np.uint8(1), width, flat, limbs.reshape(-1), scratch, where)
    for v in range(int(g[BOX + 2]), int(g[BOX + 3]) + 1):
        for u in range(width):
            if depth[v, u] < np.inf:
                bits[v, u >> 6] |= _ONE << np.uint64(u & 63)


@kernel
def mark_bodies(w, radii, r, t, k, kinv, bits, width, spans, outline, extent):
    """Mark the silhouettes of a block's bodies in `bits` (height, words, LANES), one bit per pixel.

    `w` is from `set_limbs`; radii and camera are given as in `silhouette_sums`. Scratch: spans (2, GROUP) int64,
    outline (OUTLINE,) float32 and extent (EXTENT,) int32.
    """
    height = len(bits)
    for limb in range(len(radii)):
        ends = w[6 * LANES * limb : 6 * LANES * (limb + 1)]
        _set_outlines(ends, radii[limb], r, t, k, height, outline, extent)
        _mark_limb(outline, extent, k[1, 2], width, spans, bits)
        for j in range(LANES):
            if extent[_NEAR + j]:
                _mark_near(ends, j, radii[limb], r, t, k, kinv, width, bits)


@kernel
def _mark_near(ends, lane, radius, r, t, k, kinv, width, bits):
    """Mark a limb of one body that reaches behind the camera."""
    height = len(bits)
    g, both = np.empty(COLUMNS), np.empty((2, 3))
    for i in range(6):
        both[i // 3, i % 3] = ends[i * LANES + lane]
    set_limb(both, radius, r, t, k, kinv, width, height, g)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    depth, limbs = np.empty((height, width), np.float32), np.empty((height, width), np.uint8)
    _mark_near_limb(g, kinv, depth, limbs, bits[:, :, lane], scratch, where)


@kernel
def add_marked(bits, picture, out):
    """Write the sum of `picture` over each body's marked pixels to `out` (LANES,), and clear the marks."""
    fill(out, 0.0)
    for v in range(len(bits)):
        for word in range(bits.shape[1]):
            row = bits[v, word]
            some = _NONE
            for j in range(LANES):
                some |= row[j]
            if some == _NONE:
                continue
            values = picture[v, 64 * word :]
            for u in range(trailing_zeros(some), 64 - leading_zeros(some)):  # type: ignore[call-arg]
                value, shift = values[u], np.uint64(u)
                for j in range(len(out)):
                    out[j] += value if (row[j] >> shift) & _ONE != _NONE else 0.0
            fill(row, _NONE)


@kernel
def fill(a, value):
    """Write a value to every entry of a vector."""
    for i in range(len(a)):
        a[i] = value


@kernel
def silhouette_sums(ends, radii, r, t, k, kinv, picture, out):
    """Write to `out` (n,) the sum of `picture` over the pixels whose centres lie in each body's silhouette.

    Bodies are `ends` (n, limbs, 2, 3) and `radii` (limbs, 2) [m]; the camera is its extrinsics `r, t`, world → camera,
    its intrinsics `k` (3, 3), upper triangular with positive diagonal, and their inverse `kinv`.
    """
    height, width = picture.shape
    bits, spans = np.zeros((height, (width + 63) >> 6, LANES), np.uint64), np.empty((2, GROUP), np.int64)
    outline, extent = np.empty(OUTLINE, np.float32), np.empty(EXTENT, np.int32)
    w, sums = np.empty(END_ROWS * LANES), np.empty(LANES)
    for start in range(0, len(ends), LANES):
        n = min(LANES, len(ends) - start)
        for j in range(LANES):
            body = ends[min(start + j, len(ends) - 1)].reshape(-1)
            for row in range(END_ROWS):
                w[row * LANES + j] = body[row]
        mark_bodies(w, radii, r, t, k, kinv, bits, width, spans, outline, extent)
        add_marked(bits, picture, sums)
        for j in range(n):
            out[start + j] = sums[j]
