"""The ground: checkered tiles that fade into the horizon, the sky above them, and the body's shadow on them."""

import math

import numpy as np

from motionenv.render._raycast_kernel import jit
from motionenv.render._shade_kernel import byte, reflect

# Width of the shadow's edge [m]: at the ground, and per metre that the limb is above it.
_EDGE, _EDGE_PER_METRE = np.float32(0.012), np.float32(0.07)
_ZERO, _ONE, _HALF = np.float32(0), np.float32(1), np.float32(0.5)


@jit
def _tile(x, y, width_x, width_y):
    """Share (0 to 1) of the first colour in a box of the checkerboard with unit tiles: its exact average."""
    return 0.5 + 0.5 * _wave(x, width_x) * _wave(y, width_y)


@jit
def _wave(x, width):
    """Average over [x - width/2, x + width/2] of the square wave that alternates between +1 and -1 at whole numbers."""
    low, high = 0.5 * (x - 0.5 * width), 0.5 * (x + 0.5 * width)
    return 2.0 * (abs(high - math.floor(high) - 0.5) - abs(low - math.floor(low) - 0.5)) / width


@jit
def draw_background(to_world, centre, settings, lights, ambient, colours, encode, lit, dark):
    """Write the picture without a body, in full light (`lit`) and without the key light (`dark`), (height, width, 3).

    Args:
        to_world: (3, 3), pixel (u, v, 1) → direction in the world.
        centre: (3,) position of the camera [m].
        settings: side of a tile [m], distance of half fading [m], whether there is a ground (0 or 1).
        lights: (2, 6) of `Scene.lights`; ambient: (3,); both linear.
        colours: (4, 3) linear: the two tiles, horizon, zenith.
        encode: table of `encoding`.
        lit, dark: uint8 pictures to write.
    """
    for v in range(lit.shape[0]):
        for u in range(lit.shape[1]):
            x = to_world[0, 0] * u + to_world[0, 1] * v + to_world[0, 2]
            y = to_world[1, 0] * u + to_world[1, 1] * v + to_world[1, 2]
            z = to_world[2, 0] * u + to_world[2, 1] * v + to_world[2, 2]
            if settings[2] > 0 and z < 0.0 and centre[2] > 0.0:
                pixels = lit[v, u], dark[v, u]
                _draw_ground(x, y, z, to_world, centre, settings, lights, ambient, colours, encode, *pixels)
            else:
                rise = 1.0 - min(abs(z) / math.sqrt(x * x + y * y + z * z), 1.0)
                high = 1.0 - rise * rise * rise
                for i in range(3):
                    light = colours[2, i] + (colours[3, i] - colours[2, i]) * high
                    lit[v, u, i] = dark[v, u, i] = byte(np.float32(light), encode)


@jit
def _footprint(far, slope, row, row_z):
    """Extent of a pixel on the ground along one world axis [m], from the derivatives along both image axes."""
    return max(abs(far * (row[0] - slope * row_z[0])), abs(far * (row[1] - slope * row_z[1])), 1e-6)


@jit
def _draw_ground(x, y, z, to_world, centre, settings, lights, ambient, colours, encode, lit, dark):
    """Write the bytes of the ground where the ray with direction (x, y, z), z < 0, meets it."""
    far = -centre[2] / z
    # How much ground a pixel covers: the derivative of the point along both image axes.
    wide_x = _footprint(far, x / z, to_world[0], to_world[2]) / settings[0]
    wide_y = _footprint(far, y / z, to_world[1], to_world[2]) / settings[0]
    first = _tile((centre[0] + far * x) / settings[0], (centre[1] + far * y) / settings[0], wide_x, wide_y)
    length = math.sqrt(x * x + y * y + z * z)
    distance = far * math.sqrt(x * x + y * y)
    fade = distance * distance / (distance * distance + settings[1] * settings[1])
    for i in range(3):
        base = colours[1, i] + (colours[0, i] - colours[1, i]) * first
        dim = base * ambient[i]
        bright = dim
        for k in range(2):
            lv = -(lights[k, 0] * x + lights[k, 1] * y + lights[k, 2] * z) / length
            diffuse, specular = reflect(np.float32(lights[k, 2]), np.float32(-z / length), np.float32(lv))
            light = (base * diffuse + specular) * lights[k, 3 + i]
            bright += light
            dim += light if k == 1 else 0.0
        lit[i] = byte(np.float32(bright + (colours[2, i] - bright) * fade), encode)
        dark[i] = byte(np.float32(dim + (colours[2, i] - dim) * fade), encode)


@jit
def _shadow_box(limb, to_pixel, width, height, box):
    """Write to `box` the pixels (first and last column and row) that a limb's shadow can cover.

    Args:
        limb: (10,) as `_project_limb` writes it.
        to_pixel: (3, 3), point of the light's plane (s, t, 1) → pixel times depth.
        width, height: picture size [pixels].
        box: (4,) to write.
    """
    edge = 2.0 * (_EDGE + _EDGE_PER_METRE * max(limb[6], limb[6] + limb[7]))
    side = limb[4] + edge
    length = math.sqrt(limb[2] * limb[2] + limb[3] * limb[3])
    ax, ay = (limb[2] / length, limb[3] / length) if length > 1e-9 else (1.0, 0.0)
    box[0], box[1], box[2], box[3] = width, -1, height, -1
    for corner in range(4):
        along = -side if corner < 2 else length + side
        across = side if corner % 2 else -side
        s, t = limb[0] + along * ax - across * ay, limb[1] + along * ay + across * ax
        depth = to_pixel[2, 0] * s + to_pixel[2, 1] * t + to_pixel[2, 2]
        if depth < 1e-3:  # reaches behind the camera
            box[0], box[1], box[2], box[3] = 0, width - 1, 0, height - 1
            return
        u = (to_pixel[0, 0] * s + to_pixel[0, 1] * t + to_pixel[0, 2]) / depth
        v = (to_pixel[1, 0] * s + to_pixel[1, 1] * t + to_pixel[1, 2]) / depth
        box[0], box[1] = min(box[0], max(u - 1.0, 0.0)), max(box[1], min(u + 1.0, width - 1.0))
        box[2], box[3] = min(box[2], max(v - 1.0, 0.0)), max(box[3], min(v + 1.0, height - 1.0))


@jit
def _project_limb(ends, radii, across, limb):
    """Write the limb's shape along the light's rays, where it is the hull of two circles, to `limb` (10,).

    Larger circle's centre (2), way to the other's (2), larger radius, difference of the radii, height of the larger
    end and rise to the other [m], inverse of the way's length, how far the touching points lie towards the larger.
    """
    big = 0 if radii[0] >= radii[1] else 1
    for i in range(2):
        p, q = 0.0, 0.0
        for j in range(3):
            p += across[i, j] * ends[big, j]
            q += across[i, j] * ends[1 - big, j]
        limb[i], limb[2 + i] = p, q - p
    limb[4], limb[5] = radii[big], radii[big] - radii[1 - big]
    limb[6], limb[7] = ends[big, 2], ends[1 - big, 2] - ends[big, 2]
    length = math.sqrt(limb[2] ** 2 + limb[3] ** 2)
    if length <= limb[5] + 1e-9:  # seen along its length: one circle contains the other
        limb[2] = limb[3] = limb[5] = limb[8] = limb[9] = 0.0
    else:
        limb[8], limb[9] = 1.0 / length, limb[5] / math.sqrt(length**2 - limb[5] ** 2)


@jit
def _shade_row(limb, start, step, shade):
    """Raise `shade` (n,) to how dark the limb makes each pixel of a row, 0 to 1.

    Args:
        limb: (10,) float32.
        start, step: (3,) float32, homogeneous point of the light's plane at the row's first pixel and per pixel.
        shade: float32 to raise.
    """
    for j in range(len(shade)):
        x = np.float32(j)
        w = _ONE / (start[2] + step[2] * x)
        ps, pt = (start[0] + step[0] * x) * w - limb[0], (start[1] + step[1] * x) * w - limb[1]
        along = (ps * limb[2] + pt * limb[3]) * limb[8]
        aside = abs(ps * limb[3] - pt * limb[2]) * limb[8]
        share = (along - aside * limb[9]) * limb[8]
        share = _ZERO if not share > _ZERO else (_ONE if share > _ONE else share)
        qs, qt = ps - share * limb[2], pt - share * limb[3]
        outside = math.sqrt(qs * qs + qt * qt) - (limb[4] - share * limb[5])
        edge = _EDGE + _EDGE_PER_METRE * (limb[6] + share * limb[7])
        dark = _HALF - _HALF * outside / edge
        dark = _ZERO if not dark > _ZERO else (_ONE if dark > _ONE else dark)
        dark = dark * dark * (_ONE + _ONE + _ONE - dark - dark) if w > _ZERO else _ZERO
        shade[j] = dark if dark > shade[j] else shade[j]


@jit
def draw_shadows(ends, radii, across, to_pixel, from_pixel, lit, dark, limbs, shade, rgb):
    """Darken the ground where limbs keep the key light away, softly: sharp at the feet, blurred from above.

    Args:
        ends: (limbs, 2, 3) [m], world; radii: (limbs, 2) [m].
        across: (2, 3), two unit vectors at right angles to the light.
        to_pixel, from_pixel: (3, 3), point of the light's plane (s, t, 1) ↔ pixel, homogeneous.
        lit, dark: the ground in light and without the key light, bytes.
        limbs: ids; where they aren't 0 nothing changes.
        shade: float32 (height, width), scratch.
        rgb: the picture.
    """
    height, width = limbs.shape
    shapes, boxes = np.empty((len(radii), 10), np.float32), np.empty((len(radii), 4), np.int64)
    shape, box = np.empty(10), np.empty(4)
    for i in range(len(radii)):
        _project_limb(ends[i], radii[i], across, shape)
        _shadow_box(shape, to_pixel, width, height, box)
        shapes[i], boxes[i] = shape, box
    low_u, high_u = max(boxes[:, 0].min(), 0), boxes[:, 1].max() + 1
    low_v, high_v = max(boxes[:, 2].min(), 0), boxes[:, 3].max() + 1
    if low_u >= high_u or low_v >= high_v:
        return
    shade[low_v:high_v, low_u:high_u] = 0
    start, step = np.empty(3, np.float32), np.empty(3, np.float32)
    for i in range(len(radii)):
        first, last = boxes[i, 0], boxes[i, 1] + 1
        for v in range(boxes[i, 2], boxes[i, 3] + 1 if last > first else boxes[i, 2]):
            start[:] = from_pixel[:, 0] * first + from_pixel[:, 1] * v + from_pixel[:, 2]
            step[:] = from_pixel[:, 0]
            _shade_row(shapes[i], start, step, shade[v, first:last])
    for v in range(low_v, high_v):
        _darken_row(lit[v], dark[v], limbs[v], shade[v], rgb[v], low_u, high_u)


@jit
def _darken_row(lit, dark, limbs, shade, rgb, first, end):
    """Blend columns [first, end) of a row of the ground from `lit` towards `dark` by `shade`."""
    for u in range(first, end):
        if limbs[u] == 0 and shade[u] > _ZERO:
            for k in range(3):
                a, b = np.float32(lit[u, k]), np.float32(dark[u, k])
                rgb[u, k] = np.uint8(a + (b - a) * shade[u] + _HALF)
