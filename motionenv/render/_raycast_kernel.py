"""Depth and limb ids of rounded cones seen by a pinhole camera: compiled, exact, the same bits every time.

A limb is the convex hull of two spheres: a tapered cylinder with rounded ends. With a the larger sphere's centre,
b = a + e the other's, radii r_a >= r_b, rr = r_a - r_b, and a ray o + t d, the tangent cone of the two spheres is

    k2 t² + 2 k1 t + k0 = 0,    D = e·e - rr²
    k2 = D d·d - (e·d)²
    k1 = D o·d - (e·o)(e·d) + rr r_a e·d
    k0 = D o·o - (e·o)² + 2 rr r_a e·o - e·e r_a²      (o measured from a)

and the point at t lies between the circles where the cone touches its spheres when 0 < e·o - rr r_a + t e·d < D;
beyond them one of the spheres is what the ray meets. d has z = 1, so t is depth. To keep float32 exact to microns
the ray starts at depth t0 just in front of the limb, and all of a row's coefficients are made in float64: along a
row every term above is a polynomial in the column.
"""

import math

import numpy as np
from numba import njit

jit = njit(nogil=True, cache=True, error_model="numpy")

#: Nothing nearer to the camera than this is drawn [m].
NEAR = 0.02

# Columns of the limb table (float64): larger sphere's centre, axis to the other, larger radius, radius difference,
# e·e, D, depth where rays start, bounding box in pixels (inclusive), the two sides as lines (l·(u, v, 1) >= 0 inside).
A, E, RA, RR, EE, DD, T0, BOX, SIDES, COLUMNS = 0, 3, 6, 7, 8, 9, 10, 11, 15, 21

_ZERO = np.float32(0)


@jit
def _sphere_bounds(c, r, row, size):
    """Pixel range [low, high] along one image axis of a sphere in front of the camera; `row` is that row of K.

    The planes through the camera that touch the sphere and cut the picture at coordinate w satisfy
    ((row - w z)·c)² = r² |row - w z|², a quadratic in w.
    """
    q = c[2] * c[2] - r * r
    p = row[0] * c[0] + row[1] * c[1] + row[2] * c[2]
    half = p * c[2] - r * r * row[2]
    rest = p * p - r * r * (row[0] * row[0] + row[1] * row[1] + row[2] * row[2])
    root = math.sqrt(max(half * half - q * rest, 0.0))
    low, high = (half - root) / q, (half + root) / q
    return max(math.ceil(low - 1e-3), 0.0), min(math.floor(high + 1e-3), size - 1.0)


@jit
def _set_sides(g, kinv):
    """Lines where the two planes through the camera that touch both spheres cut the picture.

    Their unit normals n satisfy n·a = r_a, n·b = r_b. Without such planes (one sphere hides the other) the lines
    are set to zero, which excludes nothing.
    """
    g[SIDES : SIDES + 6] = 0.0
    a = g[A : A + 3]
    b = a + g[E : E + 3]
    ra, rb = g[RA], g[RA] - g[RR]
    cross = np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    size = cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2
    aa, bb = a[0] ** 2 + a[1] ** 2 + a[2] ** 2, b[0] ** 2 + b[1] ** 2 + b[2] ** 2
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if size < 1e-12 * aa * bb:
        return
    middle = ((ra * bb - rb * ab) * a + (rb * aa - ra * ab) * b) / size
    rest = 1.0 - (middle[0] ** 2 + middle[1] ** 2 + middle[2] ** 2)
    if rest <= 0.0:
        return
    step = cross * math.sqrt(rest / size)
    for side in range(2):
        n = middle + (step if side == 0 else -step)
        for i in range(3):  # from rays to pixels
            g[SIDES + 3 * side + i] = n[0] * kinv[0, i] + n[1] * kinv[1, i] + n[2] * kinv[2, i]


@jit
def _contains_camera(g):
    """Whether the limb contains the camera's centre: the signed distance of the rounded cone is negative."""
    a, e = g[A : A + 3], g[E : E + 3]
    along = -(a[0] * e[0] + a[1] * e[1] + a[2] * e[2]) - g[RA] * g[RR]
    share = 0.0 if g[DD] <= 0.0 else min(max(along / g[DD], 0.0), 1.0)
    x, y, z = a[0] + share * e[0], a[1] + share * e[1], a[2] + share * e[2]
    radius = g[RA] - share * g[RR] + 1e-6
    return x * x + y * y + z * z <= radius * radius


@jit
def set_limb(ends, radii, camera_r, camera_t, k, kinv, width, height, g):
    """Fill one row `g` of the limb table; an empty bounding box says that nothing of it can be seen."""
    big = 0 if radii[0] >= radii[1] else 1
    for i in range(3):
        p = camera_r[i, 0] * ends[big, 0] + camera_r[i, 1] * ends[big, 1] + camera_r[i, 2] * ends[big, 2]
        q = camera_r[i, 0] * ends[1 - big, 0] + camera_r[i, 1] * ends[1 - big, 1] + camera_r[i, 2] * ends[1 - big, 2]
        g[A + i], g[E + i] = p + camera_t[i], q - p
    g[RA], g[RR] = radii[big], radii[big] - radii[1 - big]
    g[EE] = g[E] ** 2 + g[E + 1] ** 2 + g[E + 2] ** 2
    g[DD] = g[EE] - g[RR] ** 2
    if g[DD] <= 1e-12 * g[EE]:
        g[E : E + 3] = 0.0  # the larger sphere contains the other: a sphere is all there is
        g[RR] = g[EE] = g[DD] = 0.0
    za, zb = g[A + 2], g[A + 2] + g[E + 2]
    ra, rb = g[RA], g[RA] - g[RR]
    front = min(za - ra, zb - rb)
    g[T0] = max(front - 0.01 * ra, NEAR)
    g[BOX], g[BOX + 1], g[BOX + 2], g[BOX + 3] = 0.0, width - 1.0, 0.0, height - 1.0
    g[SIDES : SIDES + 6] = 0.0
    if max(za + ra, zb + rb) <= NEAR or _contains_camera(g):
        g[BOX + 1] = -1.0
    elif front > NEAR:
        _bound_limb(g, k, kinv, width, height)


@jit
def _bound_limb(g, k, kinv, width, height):
    """Set bounding box and sides of a limb that lies wholly in front of the camera."""
    a = g[A : A + 3]
    b = a + g[E : E + 3]
    ra, rb = g[RA], g[RA] - g[RR]
    for axis in range(2):
        size = width if axis == 0 else height
        low, high = _sphere_bounds(a, ra, k[axis], size)
        other_low, other_high = _sphere_bounds(b, rb, k[axis], size)
        g[BOX + 2 * axis], g[BOX + 2 * axis + 1] = min(low, other_low), max(high, other_high)
    _set_sides(g, kinv)


@jit
def row_span(g, v):
    """First and last column (inclusive; empty when last < first) of row `v` that the limb can cover."""
    low, high = g[BOX], g[BOX + 1]
    for side in range(2):
        l0 = g[SIDES + 3 * side]
        rest = g[SIDES + 3 * side + 1] * v + g[SIDES + 3 * side + 2]
        if l0 > 1e-12:
            low = max(low, math.ceil(-rest / l0 - 1e-3))
        elif l0 < -1e-12:
            high = min(high, math.floor(-rest / l0 + 1e-3))
    return int(max(low, g[BOX])), int(min(high, g[BOX + 1]))


@jit
def set_row(g, kinv, u, v, c):
    """Fill `c` (22,) with the polynomials, in columns counted from `u`, of row `v`."""
    dx, dy = kinv[0, 0] * u + kinv[0, 1] * v + kinv[0, 2], kinv[1, 0] * u + kinv[1, 1] * v + kinv[1, 2]
    sx, sy = kinv[0, 0], kinv[1, 0]
    ex, ey, ez, ra, rr, dd, t0 = g[E], g[E + 1], g[E + 2], g[RA], g[RR], g[DD], g[T0]
    ox, oy, oz = t0 * dx - g[A], t0 * dy - g[A + 1], t0 - g[A + 2]
    qx, qy = t0 * sx, t0 * sy
    eo0, eo1 = ex * ox + ey * oy + ez * oz - ra * rr, ex * qx + ey * qy  # e·o - rr r_a
    ed0, ed1 = ex * dx + ey * dy + ez, ex * sx + ey * sy  # e·d
    a0, a1, a2 = dx * dx + dy * dy + 1.0, 2.0 * (dx * sx + dy * sy), sx * sx + sy * sy  # d·d
    b0, b1, b2 = dx * ox + dy * oy + oz, dx * qx + dy * qy + sx * ox + sy * oy, sx * qx + sy * qy  # d·o
    c0, c1, c2 = ox * ox + oy * oy + oz * oz - ra * ra, 2.0 * (ox * qx + oy * qy), qx * qx + qy * qy  # o·o - r_a²
    c[0], c[1], c[2], c[3] = eo0, eo1, ed0, ed1
    c[4], c[5], c[6] = a0, a1, a2
    c[7], c[8], c[9] = b0, b1, b2
    c[10], c[11], c[12] = c0, c1, c2
    # With m = e·o - rr r_a: k1 = D d·o - m e·d and k0 = D (o·o - r_a²) - m², the formulas above rearranged.
    c[13], c[14], c[15] = dd * a0 - ed0 * ed0, dd * a1 - 2.0 * ed0 * ed1, dd * a2 - ed1 * ed1
    c[16], c[17], c[18] = dd * b0 - eo0 * ed0, dd * b1 - eo0 * ed1 - eo1 * ed0, dd * b2 - eo1 * ed1
    c[19], c[20], c[21] = dd * c0 - eo0 * eo0, dd * c1 - 2.0 * eo0 * eo1, dd * c2 - eo1 * eo1


@jit
def draw_row(c, dd, t0, limb, depth, limbs):
    """Put what row polynomials `c` (22,) describe in front of what `depth` and `limbs` (n,) hold already.

    No branches: the compiler turns the loop into vector instructions. Divisions by zero give infinities and NaN,
    which every comparison below refuses.
    """
    m0, m1, d0, d1, a0, a1, a2 = c[0], c[1], c[2], c[3], c[4], c[5], c[6]
    b0, b1, b2, c0, c1, c2 = c[7], c[8], c[9], c[10], c[11], c[12]
    p0, p1, p2, q0, q1, q2, r0, r1, r2 = c[13], c[14], c[15], c[16], c[17], c[18], c[19], c[20], c[21]
    for j in range(len(depth)):
        x = np.float32(j)
        m, ed = m0 + m1 * x, d0 + d1 * x
        k2, k1, k0 = p0 + (p1 + p2 * x) * x, q0 + (q1 + q2 * x) * x, r0 + (r1 + r2 * x) * x
        h = k1 * k1 - k0 * k2
        t = k0 / (math.sqrt(h if h > _ZERO else _ZERO) - k1)
        y = m + t * ed
        between = (y > _ZERO) & (y < dd)
        # Within the cone's own angle and from the thick end, the nearer sphere is the larger, wherever t lies.
        far = (y >= dd) & ((k2 >= _ZERO) | (ed <= _ZERO))
        b = b0 + (b1 + b2 * x) * x - (ed if far else _ZERO)
        s = c0 + (c1 + c2 * x) * x + (dd - m - m if far else _ZERO)
        hs = b * b - s * (a0 + (a1 + a2 * x) * x)
        ts = s / (math.sqrt(hs if hs > _ZERO else _ZERO) - b)
        t = t if between else ts
        z = t0 + t
        seen = ((h >= _ZERO) | (k2 < _ZERO)) & (between | (hs >= _ZERO)) & (t >= _ZERO) & (z < depth[j])
        depth[j] = z if seen else depth[j]
        limbs[j] = limb if seen else limbs[j]


@jit
def draw_limb(g, kinv, limb, depth, limbs, row):
    """Draw one limb of table row `g` into `depth` and `limbs` (height, width); `row` (22,) float32 is scratch."""
    exact = np.empty(22)
    dd, t0 = np.float32(g[DD]), np.float32(g[T0])
    for v in range(int(g[BOX + 2]), int(g[BOX + 3]) + 1):
        first, last = row_span(g, v)
        if first <= last:
            set_row(g, kinv, first, v, exact)
            row[:] = exact
            draw_row(row, dd, t0, limb, depth[v, first : last + 1], limbs[v, first : last + 1])
