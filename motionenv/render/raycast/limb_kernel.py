"""Depth and limb ids of rounded cones seen by a pinhole camera: compiled, exact, bit-reproducible.

A limb is the convex hull of two spheres: a tapered cylinder with rounded ends. With a the larger sphere's centre,
a + e the other's, radii r_a >= r_b, s = r_a - r_b, and a ray o + t d relative to a, the cone that touches both is

    k2 t² + 2 k1 t + k0 = 0,    D = e·e - s²,    m = e·o - s r_a
    k2 = D d·d - (e·d)²
    k1 = D o·d - m e·d
    k0 = D (o·o - r_a²) - m²

and the point at t lies between the tangent circles of cone and spheres if 0 < m + t e·d < D; otherwise the ray may hit
one of the spheres. d has z = 1, so t is depth. Rays start at depth t0 just in front of the limb, and o is one float64
value per limb plus small float32 steps, so that float32 is accurate to microns at any distance.
"""

import math

import numpy as np

from motionenv._core.compilation import part

#: Near plane [m].
NEAR = 0.02

# Columns of the limb table (float64): larger sphere's centre a, axis e, its radius r_a, s, D, depth t0 at which rays
# start, bounding box in pixels (inclusive), and for each side of the outline: -1 if it bounds columns from the left, 1
# from the right, 0 if it doesn't exist, and its slope and offset in u = slope·v + offset.
A, E, RA, RR, DD, T0, BOX, SIDES, COLUMNS = 0, 3, 6, 7, 8, 9, 10, 14, 20

#: Pixels whose rays are cast together: fits the L1 cache.
GATHER = 512

_ZERO, _ONE = np.float32(0), np.float32(1)


@part
def _sphere_bounds(x, y, z, r, row):
    """Range of image coordinates along one axis of a sphere in front of the camera; `row` is that row of K.

    Planes through the camera that touch the sphere and intersect the image at coordinate w satisfy
    ((row - w z)·c)² = r² |row - w z|², a quadratic in w.
    """
    q = z * z - r * r
    p = row[0] * x + row[1] * y + row[2] * z
    half = p * z - r * r * row[2]
    rest = p * p - r * r * (row[0] * row[0] + row[1] * row[1] + row[2] * row[2])
    root = math.sqrt(max(half * half - q * rest, 0.0))
    return (half - root) / q, (half + root) / q


@part
def _set_sides(g, kinv):
    """The image lines of the two planes through the camera that touch both spheres.

    Their unit normals n satisfy n·a = r_a, n·b = r_b. They don't exist if one sphere hides the other.
    """
    ax, ay, az = g[A], g[A + 1], g[A + 2]
    bx, by, bz = ax + g[E], ay + g[E + 1], az + g[E + 2]
    ra, rb = g[RA], g[RA] - g[RR]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = cx * cx + cy * cy + cz * cz
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    if size < 1e-12 * aa * bb:
        return
    p, q = (ra * bb - rb * ab) / size, (rb * aa - ra * ab) / size
    mx, my, mz = p * ax + q * bx, p * ay + q * by, p * az + q * bz
    rest = 1.0 - (mx * mx + my * my + mz * mz)
    if rest <= 0.0:
        return
    for side in range(2):
        step = math.sqrt(rest / size) if side == 0 else -math.sqrt(rest / size)
        nx, ny, nz = mx + step * cx, my + step * cy, mz + step * cz
        l0 = nx * kinv[0, 0] + ny * kinv[1, 0]  # from rays to pixels: l·(u, v, 1) >= 0 inside
        l1 = nx * kinv[0, 1] + ny * kinv[1, 1]
        l2 = nx * kinv[0, 2] + ny * kinv[1, 2] + nz
        if abs(l0) > 1e-9 * abs(l1):
            at = SIDES + 3 * side
            g[at], g[at + 1], g[at + 2] = (-1.0 if l0 > 0.0 else 1.0), -l1 / l0, -l2 / l0


@part
def _contains_camera(g):
    """Whether the limb contains the camera's centre, by the signed distance of the rounded cone."""
    along = -(g[A] * g[E] + g[A + 1] * g[E + 1] + g[A + 2] * g[E + 2]) - g[RA] * g[RR]
    share = 0.0 if g[DD] <= 0.0 else min(max(along / g[DD], 0.0), 1.0)
    x, y, z = g[A] + share * g[E], g[A + 1] + share * g[E + 1], g[A + 2] + share * g[E + 2]
    radius = g[RA] - share * g[RR] + 1e-6
    return x * x + y * y + z * z <= radius * radius


@part
def _set_shape(ends, radii, camera_r, camera_t, g):
    """Write a, e, r_a, s and D in the camera's frame."""
    big = 0 if radii[0] >= radii[1] else 1
    ee = 0.0
    for i in range(3):
        p = camera_r[i, 0] * ends[big, 0] + camera_r[i, 1] * ends[big, 1] + camera_r[i, 2] * ends[big, 2]
        q = camera_r[i, 0] * ends[1 - big, 0] + camera_r[i, 1] * ends[1 - big, 1] + camera_r[i, 2] * ends[1 - big, 2]
        g[A + i], g[E + i] = p + camera_t[i], q - p
        ee += (q - p) * (q - p)
    g[RA], g[RR] = radii[big], radii[big] - radii[1 - big]
    g[DD] = ee - g[RR] * g[RR]
    if g[DD] <= 1e-12 * ee:  # the larger sphere contains the other
        g[E] = g[E + 1] = g[E + 2] = g[RR] = g[DD] = 0.0


@part
def set_limb(ends, radii, camera_r, camera_t, k, kinv, width, height, g):
    """Write one row `g` (COLUMNS,) of the limb table; an empty bounding box means that the limb isn't visible.

    The limb has `ends` (2, 3) [m] in the world and `radii` (2,) [m]; the camera has the extrinsics `camera_r,
    camera_t`, world → camera, the intrinsics `k` and their inverse `kinv`, and images of `width` × `height` [pixels].
    """
    _set_shape(ends, radii, camera_r, camera_t, g)
    ra, rb = g[RA], g[RA] - g[RR]
    front = min(g[A + 2] - ra, g[A + 2] + g[E + 2] - rb)
    back = max(g[A + 2] + ra, g[A + 2] + g[E + 2] + rb)
    g[T0] = max(front - 0.01 * ra, NEAR)
    g[BOX], g[BOX + 1], g[BOX + 2], g[BOX + 3] = 0.0, width - 1.0, 0.0, height - 1.0
    g[SIDES] = g[SIDES + 3] = 0.0
    if back <= NEAR or (front <= NEAR and _contains_camera(g)):
        g[BOX + 1] = -1.0
    elif front > NEAR:
        _bound_limb(g, k, kinv)


@part
def _bound_limb(g, k, kinv):
    """Tighten bounding box and sides of a limb wholly in front of the camera."""
    x, y, z = g[A], g[A + 1], g[A + 2]
    for axis in range(2):
        low, high = _sphere_bounds(x, y, z, g[RA], k[axis])
        other_low, other_high = _sphere_bounds(x + g[E], y + g[E + 1], z + g[E + 2], g[RA] - g[RR], k[axis])
        at = BOX + 2 * axis
        g[at] = max(g[at], math.ceil(min(low, other_low) - 1e-3))
        g[at + 1] = min(g[at + 1], math.floor(max(high, other_high) + 1e-3))
    _set_sides(g, kinv)


@part
def row_span(g, v):
    """First and last column (inclusive; empty if last < first) of row `v` that the limb can cover."""
    low, high = g[BOX], g[BOX + 1]
    for at in (SIDES, SIDES + 3):
        edge = g[at + 1] * v + g[at + 2]
        if g[at] < 0.0:
            low = max(low, math.ceil(edge - 1e-3))
        elif g[at] > 0.0:
            high = min(high, math.floor(edge + 1e-3))
    return int(low), int(high)


@part
def _set_rays(g, kinv, u, v, c):
    """Write the arguments of `_cast`, for pixels relative to (u, v), to `c` (20,) float32."""
    dx, dy = kinv[0, 0] * u + kinv[0, 1] * v + kinv[0, 2], kinv[1, 0] * u + kinv[1, 1] * v + kinv[1, 2]
    t0 = g[T0]
    c[0], c[1], c[2] = dx, kinv[0, 0], kinv[0, 1]
    c[3], c[4], c[5] = dy, kinv[1, 0], kinv[1, 1]
    c[6], c[7], c[8] = t0 * dx - g[A], t0 * kinv[0, 0], t0 * kinv[0, 1]
    c[9], c[10], c[11] = t0 * dy - g[A + 1], t0 * kinv[1, 0], t0 * kinv[1, 1]
    c[12], c[13], c[14], c[15] = t0 - g[A + 2], g[E], g[E + 1], g[E + 2]
    c[16], c[17], c[18], c[19] = g[RA] * g[RA], g[RR] * g[RA], g[DD], t0


@part
def _cast(c, across, down, z):
    """Depth `z` (n,) at which rays enter the limb `c` of `_set_rays`; infinite if they miss.

    The rays' columns and rows, `across` and `down` (n,), are relative to the pixel of `c`. The loop has no branches, so
    that it compiles to SIMD. Divisions by zero give infinities and NaN, for which all comparisons below are False.
    """
    d0, d1, d2, f0, f1, f2 = c[0], c[1], c[2], c[3], c[4], c[5]
    o0, o1, o2, p0, p1, p2 = c[6], c[7], c[8], c[9], c[10], c[11]
    oz, ex, ey, ez, rara, rra, dd, t0 = c[12], c[13], c[14], c[15], c[16], c[17], c[18], c[19]
    nothing = np.float32(np.inf)
    for i in range(len(z)):
        x, y = across[i], down[i]
        dx, dy = d0 + x * d1 + y * d2, f0 + x * f1 + y * f2
        ox, oy = o0 + x * o1 + y * o2, p0 + x * p1 + y * p2
        dod, od, oo = dx * dx + dy * dy + _ONE, dx * ox + dy * oy + oz, ox * ox + oy * oy + oz * oz - rara
        m, ed = ex * ox + ey * oy + ez * oz - rra, ex * dx + ey * dy + ez
        k2, k1, k0 = dd * dod - ed * ed, dd * od - m * ed, dd * oo - m * m
        h = k1 * k1 - k0 * k2
        t = k0 / (math.sqrt(h if h > _ZERO else _ZERO) - k1)
        along = m + t * ed
        between = (along > _ZERO) & (along < dd)
        # For rays inside the cone's angle, or from the thick end, the nearer sphere is always the larger one.
        far = (along >= dd) & ((k2 >= _ZERO) | (ed <= _ZERO))
        b, s = od - (ed if far else _ZERO), oo + (dd - m - m if far else _ZERO)
        hs = b * b - s * dod
        t = t if between else s / (math.sqrt(hs if hs > _ZERO else _ZERO) - b)
        met = ((h >= _ZERO) | (k2 < _ZERO)) & (between | (hs >= _ZERO)) & (t >= _ZERO)
        z[i] = t0 + t if met else nothing


@part
def _put(z, where, limb, depth, limbs):
    """Write `limb` at depth `z` (n,) where it is in front of the pixels `where` (n,) of flat `depth` and `limbs`."""
    for i in range(len(z)):
        at = where[i]
        if z[i] < depth[at]:
            depth[at] = z[i]
            limbs[at] = limb


@part
def draw_limb(g, kinv, limb, width, depth, limbs, scratch, where):
    """Draw the limb with the row `g` of the limb table, and the id `limb`, into `depth` and `limbs` (height · width,).

    `kinv` are the inverse intrinsics, and `width` is the image's [pixels]. Scratch memory: `scratch` (4, GATHER)
    float32 and `where` (GATHER,) int64.
    """
    rays, across, down, z = scratch[3], scratch[0], scratch[1], scratch[2]
    middle_u, middle_v = int((g[BOX] + g[BOX + 1]) / 2), int((g[BOX + 2] + g[BOX + 3]) / 2)
    _set_rays(g, kinv, middle_u, middle_v, rays)
    n = 0
    for v in range(int(g[BOX + 2]), int(g[BOX + 3]) + 1):
        first, last = row_span(g, v)
        while first <= last:
            count = min(last + 1 - first, GATHER - n)
            for i in range(n, n + count):
                across[i], down[i], where[i] = first + i - n - middle_u, v - middle_v, v * width + first + i - n
            n += count
            first += count
            if n == GATHER:
                _cast(rays, across, down, z)
                _put(z, where, limb, depth, limbs)
                n = 0
    _cast(rays, across[:n], down[:n], z[:n])
    _put(z[:n], where, limb, depth, limbs)
