"""Sums of a picture under the silhouettes of bodies, without drawing them.

The silhouette of a limb, which is the convex hull of two spheres, is the convex hull of the spheres' ellipses. With
a ray (x, y, 1), w = y Y + Z and a sphere of radius r about (X, Y, Z), C = X² + Y² + Z² - r² and q = Y² + Z² - r²,

    x = (X w ± √(C (w² - q (1 + y²)))) / q

so every row of pixels meets an ellipse in a span whose middle is linear, and whose half width squared is quadratic,
in the row. The hull adds the two straight lines that touch both ellipses; a row's span reaches from the leftmost to
the rightmost of ellipses and lines. Spans are gathered in rows of bits, one per pixel, so that limbs may overlap, and
the sum over a run of bits is a difference of two running sums.
"""

import math

import numpy as np
from numba import njit

from motionenv.render._raycast_kernel import BOX, COLUMNS, GATHER, NEAR, draw_limb, set_limb

jit = njit(nogil=True, cache=True, error_model="numpy")

_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_NONE, _ONE, _SIXTY_THREE = np.uint64(0), np.uint64(1), np.uint64(63)

# Position of the lowest bit set, by a de Bruijn sequence (Leiserson, Prokop & Randall 1998).
_SEQUENCE = 0x03F79D71B4CB0A89
_DE_BRUIJN, _SHIFT = np.uint64(_SEQUENCE), np.uint64(58)
_POSITION = np.empty(64, np.uint8)
for _i in range(64):
    _POSITION[(_SEQUENCE << _i & 0xFFFFFFFFFFFFFFFF) >> 58] = _i


@jit
def _set_balls(ends, radii, r, t, balls):
    """Write centre in the camera's frame and radius of a limb's spheres, (2, 4); returns how near its front is."""
    front = np.inf
    for end in range(2):
        ball = balls[end]
        for i in range(3):
            ball[i] = r[i, 0] * ends[end, 0] + r[i, 1] * ends[end, 1] + r[i, 2] * ends[end, 2] + t[i]
        ball[3] = radii[end]
        front = min(front, ball[2] - ball[3])
    return front


@jit
def _set_ellipse(ball, k, e):
    """Write the ellipse `e` (7,) of a sphere (x, y, z, r) in front of a camera with upper triangular `k`.

    First and last row (real numbers), m0 and m1 of the middle m0 + m1 v of row v's span, and h0, h1 and h2 of half
    its width squared h0 + h1 v + h2 v².
    """
    x, y, z, r = ball[0], ball[1], ball[2], ball[3]
    fx, skew, cx, fy, cy = k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]
    y1 = 1.0 / fy
    y0 = -cy * y1
    q = y * y + z * z - r * r
    fq, fb = fx / q, fy / (z * z - r * r)
    middle, reach = y * z * fb + cy, r * math.sqrt(q) * fb
    w1, w0 = y * y1, y * y0 + z
    h = fq * fq * (x * x + q)
    e[0], e[1] = middle - reach, middle + reach
    e[2], e[3] = fq * x * w0 + skew * y0 + cx, fq * x * w1 + skew * y1
    e[4] = h * (w0 * w0 - q * (1.0 + y0 * y0))
    e[5] = 2.0 * h * (w1 * w0 - q * y1 * y0)
    e[6] = h * (w1 * w1 - q * y1 * y1)


@jit
def _set_lines(balls, k, lines):
    """Write the two straight pieces of a limb's outline, (2, 4): first and last row, l0 and l1 of u = l0 + l1 v.

    They are where planes through the camera touch both spheres: unit normals n with n·a = r_a, n·b = r_b, between the
    points a - r_a n and b - r_b n. There are none (last row before the first) where one sphere hides the other.
    """
    ax, ay, az, ra = balls[0, 0], balls[0, 1], balls[0, 2], balls[0, 3]
    bx, by, bz, rb = balls[1, 0], balls[1, 1], balls[1, 2], balls[1, 3]
    fx, skew, cx, fy, cy = k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = nx * nx + ny * ny + nz * nz
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    over = 1.0 / size
    p, q = (ra * bb - rb * ab) * over, (rb * aa - ra * ab) * over
    mx, my, mz = p * ax + q * bx, p * ay + q * by, p * az + q * bz
    rest = 1.0 - (mx * mx + my * my + mz * mz)
    for side in range(2):
        lines[side, 0], lines[side, 1] = np.inf, -np.inf
    if size < 1e-12 * aa * bb or rest <= 0.0:
        return
    step = math.sqrt(rest * over)
    for side in range(2):
        x, y, z = mx + step * nx, my + step * ny, mz + step * nz
        va, vb = cy + fy * (ay - ra * y) / (az - ra * z), cy + fy * (by - rb * y) / (bz - rb * z)
        fn = -fx / x
        slope = (fn * y + skew) / fy
        lines[side, 0], lines[side, 1] = min(va, vb), max(va, vb)
        lines[side, 2], lines[side, 3] = fn * z + cx - cy * slope, slope
        step = -step


@jit
def _set_spans(first, a, b, lines, width, low, high):
    """Write first and last pixel (n,) of a limb in rows from `first` on; last < first where there is none.

    Args:
        first: row of the picture.
        a, b: (7,) its ellipses.
        lines: (2, 4) the straight pieces.
        width: of the picture.
        low, high: (n,) int64 to write.

    No branches: the compiler turns the loop into vector instructions.
    """
    at, ab, am0, am1, ah0, ah1, ah2 = a[0], a[1], a[2], a[3], a[4], a[5], a[6]
    bt, bb, bm0, bm1, bh0, bh1, bh2 = b[0], b[1], b[2], b[3], b[4], b[5], b[6]
    lt, lb, l0, l1 = lines[0, 0], lines[0, 1], lines[0, 2], lines[0, 3]
    rt, rb, r0, r1 = lines[1, 0], lines[1, 1], lines[1, 2], lines[1, 3]
    right = width - 1.0
    for j in range(len(low)):
        v = np.float64(first + j)
        ah, bh = ah0 + v * (ah1 + v * ah2), bh0 + v * (bh1 + v * bh2)
        ah, bh = math.sqrt(ah if ah > 0.0 else 0.0), math.sqrt(bh if bh > 0.0 else 0.0)
        am, bm, p, q = am0 + v * am1, bm0 + v * bm1, l0 + v * l1, r0 + v * r1
        in_a, in_b = (v >= at) & (v <= ab), (v >= bt) & (v <= bb)
        in_l, in_r = (v >= lt) & (v <= lb), (v >= rt) & (v <= rb)
        x, y = (am - ah if in_a else np.inf), (am + ah if in_a else -np.inf)
        x, y = (bm - bh if in_b & (bm - bh < x) else x), (bm + bh if in_b & (bm + bh > y) else y)
        x, y = (p if in_l & (p < x) else x), (p if in_l & (p > y) else y)
        x, y = (q if in_r & (q < x) else x), (q if in_r & (q > y) else y)
        x, y = (x if x > 0.0 else 0.0), (y if y < right else right)
        low[j], high[j] = np.int64(math.ceil(x if x < width else width)), np.int64(math.floor(y if y > -1.0 else -1.0))


@jit
def _mark(low, high, bits):
    """Set the bits from `low` to `high` (n,) of rows `bits` (words, n)."""
    for word in range(len(bits)):
        row, start = bits[word], 64 * word
        for j in range(len(row)):
            first, last = low[j] - start, high[j] - start
            first, last = (first if first > 0 else 0), (last if last < 63 else 63)
            mask = (_ALL << np.uint64(first & 63)) & (_ALL >> np.uint64((63 - last) & 63))
            row[j] |= mask if first <= last else _NONE


@jit
def _mark_limb(balls, k, width, height, spans, ellipses, lines, bits):
    """Mark a limb that lies wholly in front of the camera; returns its first and last row."""
    a, b = ellipses[0], ellipses[1]
    _set_ellipse(balls[0], k, a)
    _set_ellipse(balls[1], k, b)
    first = math.ceil(min(max(min(a[0], b[0]), 0.0), height))
    last = math.floor(max(min(max(a[1], b[1]), height - 1.0), -1.0))
    if first <= last:
        _set_lines(balls, k, lines)
        low, high = spans[0, : last + 1 - first], spans[1, : last + 1 - first]
        _set_spans(first, a, b, lines, width, low, high)
        _mark(low, high, bits[:, first : last + 1])
    return first, last


@jit
def _mark_near_limb(g, kinv, depth, limbs, bits, scratch, where):
    """Mark a limb that reaches behind the camera, by casting a ray per pixel; returns its first and last row."""
    height, width = depth.shape
    first, last = int(g[BOX + 2]), int(g[BOX + 3])
    if g[BOX] > g[BOX + 1]:
        return height, -1
    depth[:] = np.inf
    draw_limb(g, kinv, np.uint8(1), width, depth.reshape(-1), limbs.reshape(-1), scratch, where)
    for v in range(first, last + 1):
        for u in range(width):
            if depth[v, u] < np.inf:
                bits[u >> 6, v] |= _ONE << np.uint64(u & 63)
    return first, last


@jit
def _sum(bits, first, last, running):
    """Sum of a picture over the bits set in rows `first` to `last`.

    Args:
        bits: (words, height) uint64, cleared on the way.
        first, last: rows.
        running: (height, width + 1), sums of each row of the picture up to a column.
    """
    total, words, width = 0.0, len(bits), running.shape[1] - 1
    for v in range(first, last + 1):
        row, carry, sign = running[v], _NONE, -1.0
        for word in range(words):
            b = bits[word, v]
            bits[word, v] = _NONE
            change = b ^ ((b << _ONE) | carry)
            carry = b >> _SIXTY_THREE
            while change != _NONE:
                lowest = change & (~change + _ONE)
                total += sign * row[64 * word + _POSITION[(lowest * _DE_BRUIJN) >> _SHIFT]]
                sign = -sign
                change ^= lowest
        if sign > 0.0:
            total += row[width]
    return total


@jit
def silhouette_sums(ends, radii, r, t, k, kinv, running, out):
    """Sum of a picture over the pixels whose centres lie in each body's silhouette.

    Args:
        ends: (n, limbs, 2, 3) [m], world.
        radii: (limbs, 2) [m].
        r, t: world → camera.
        k: (3, 3) intrinsics, upper triangular with positive diagonal.
        kinv: their inverse.
        running: (height, width + 1), sums of each row of the picture up to a column.
        out: (n,) to write.
    """
    height, width = running.shape[0], running.shape[1] - 1
    bits, spans = np.zeros(((width + 63) >> 6, height), np.uint64), np.empty((2, height), np.int64)
    balls, ellipses, lines, g = np.empty((2, 4)), np.empty((2, 7)), np.empty((2, 4)), np.empty(COLUMNS)
    scratch, where = np.empty((4, GATHER), np.float32), np.empty(GATHER, np.int64)
    depth, limbs = np.empty((height, width), np.float32), np.empty((height, width), np.uint8)
    for i in range(len(ends)):
        first, last = height, -1
        for limb in range(len(radii)):
            if _set_balls(ends[i, limb], radii[limb], r, t, balls) > NEAR:
                a, b = _mark_limb(balls, k, width, height, spans, ellipses, lines, bits)
            else:
                set_limb(ends[i, limb], radii[limb], r, t, k, kinv, width, height, g)
                a, b = _mark_near_limb(g, kinv, depth, limbs, bits, scratch, where)
            if a <= b:
                first, last = min(first, a), max(last, b)
        out[i] = _sum(bits, first, last, running)
