"""The ground, checkered tiles that fade into the horizon, the sky, and the body's shadow.

Colours depend on the image size, the camera's intrinsics, rotation and height; the tile pattern also on its position.
`colour_background` is therefore slow and cached; `draw_background` blends its results for one position, row by row.
The shadow is drawn limb by limb, sharp where the limb touches the ground and blurred with height.
"""

import math

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.render.raycast._shade_kernel import byte, reflect

_ZERO, _ONE, _TWO, _HALF, _QUARTER = (np.float32(x) for x in (0, 1, 2, 0.5, 0.25))
_LEAST_WIDTH = np.float32(1e-5)  # [tiles] least width of a pixel on the ground
_FLATTEST = np.float32(-1e-6)  # greatest z of a ray that intersects the ground
# Width of the shadow's penumbra [m]: at the ground, and per metre of height.
_EDGE, _EDGE_PER_METRE = np.float32(0.012), np.float32(0.07)


@kernel
def colour_background(to_world, height, settings, lights, ambient, colours, encode, lit, dark):
    """Write the bytes of every pixel for ground of the second tile colour, of an equal mixture, and of the first.

    `to_world` (3, 3) maps pixels (u, v, 1) to directions in the world; the camera is `height` [m] above the ground;
    `settings` are the distance of half fading [m] and whether there is a ground (0 or 1). `lights` (2, 6) of
    `Scene.lights`, `ambient` (3,) and `colours` (4, 3) of the two tiles, horizon and zenith are linear. `lit` and
    `dark`, uint8 (3, rows, columns, 3), are in full light and without the key light, equal in the sky.
    """
    for v in range(lit.shape[1]):
        for u in range(lit.shape[2]):
            x = to_world[0, 0] * u + to_world[0, 1] * v + to_world[0, 2]
            y = to_world[1, 0] * u + to_world[1, 1] * v + to_world[1, 2]
            z = to_world[2, 0] * u + to_world[2, 1] * v + to_world[2, 2]
            if settings[1] > 0 and z < 0.0 and height > 0.0:
                pixels = lit[:, v, u], dark[:, v, u]
                _colour_ground(x, y, z, height, settings[0], lights, ambient, colours, encode, *pixels)
            else:
                rise = 1.0 - min(abs(z) / math.sqrt(x * x + y * y + z * z), 1.0)
                high = 1.0 - rise * rise * rise
                for c in range(3):
                    light = byte(np.float32(colours[2, c] + (colours[3, c] - colours[2, c]) * high), encode)
                    for i in range(3):
                        lit[i, v, u, c] = dark[i, v, u, c] = light


@part
def _colour_ground(x, y, z, height, half_faded, lights, ambient, colours, encode, lit, dark):
    """Write the bytes (3, 3) of the ground at which the ray with direction (x, y, z), z < 0, intersects it."""
    length = math.sqrt(x * x + y * y + z * z)
    distance = -height / z * math.sqrt(x * x + y * y)
    fade = distance * distance / (distance * distance + half_faded * half_faded)
    shares = np.empty((2, 2))
    for k in range(2):
        lv = -(lights[k, 0] * x + lights[k, 1] * y + lights[k, 2] * z) / length
        shares[k, 0], shares[k, 1] = reflect(np.float32(lights[k, 2]), np.float32(-z / length), np.float32(lv))
    for i in range(3):
        for c in range(3):
            base = colours[1, c] + (colours[0, c] - colours[1, c]) * 0.5 * i
            dim = base * ambient[c] + (base * shares[1, 0] + shares[1, 1]) * lights[1, 3 + c]
            bright = dim + (base * shares[0, 0] + shares[0, 1]) * lights[0, 3 + c]
            lit[i, c] = byte(np.float32(bright + (colours[2, c] - bright) * fade), encode)
            dark[i, c] = byte(np.float32(dim + (colours[2, c] - dim) * fade), encode)


@part
def _wave(x, width):
    """Mean over [x - width/2, x + width/2] of the square wave that alternates between +1 and -1 at integers."""
    middle, reach = _HALF * x, _QUARTER * width
    middle -= np.floor(middle)  # near 0, for single precision
    low, high = middle - reach, middle + reach
    return _TWO * (abs(high - np.floor(high) - _HALF) - abs(low - np.floor(low) - _HALF)) / width


@part
def _footprint(far, slope, across, down, across_z, down_z):
    """Extent of a pixel on the ground along one world axis [tiles], from the derivatives along both image axes."""
    a, b = abs(far * (across - slope * across_z)), abs(far * (down - slope * down_z))
    a = a if a > b else b
    return a if a > _LEAST_WIDTH else _LEAST_WIDTH


@part
def share_row(to_world, centre, v, first, share):
    """Write the fraction of the first tile colour in each pixel of row `v` from column `first`, box-filtered exactly.

    `to_world` (3, 3) maps pixels (u, v, 1) to directions in the world, from a camera at `centre` (3,) [tiles].
    """
    ax, ay, az = to_world[0, 0], to_world[1, 0], to_world[2, 0]
    dx, dy, dz = to_world[0, 1], to_world[1, 1], to_world[2, 1]
    row = np.float32(v)
    x0, y0, z0 = dx * row + to_world[0, 2], dy * row + to_world[1, 2], dz * row + to_world[2, 2]
    cx, cy, cz = centre[0], centre[1], centre[2]
    for j in range(len(share)):
        u = np.float32(first + j)
        z = z0 + az * u
        inverse = _ONE / (z if z < _FLATTEST else _FLATTEST)
        slope_x, slope_y, far = (x0 + ax * u) * inverse, (y0 + ay * u) * inverse, -cz * inverse
        wave_x = _wave(cx - cz * slope_x, _footprint(far, slope_x, ax, dx, az, dz))
        wave_y = _wave(cy - cz * slope_y, _footprint(far, slope_y, ay, dy, az, dz))
        mixed = _HALF + _HALF * wave_x * wave_y
        mixed = mixed if mixed > _ZERO else _ZERO
        share[j] = mixed if mixed < _ONE else _ONE


@part
def mix_row(colours, v, first, share, row):
    """Write pixels (n, 3) of row `v` from column `first`: the parabola through the three bytes, at the tiles' share.

    The error against encoding the mixed light is at most half a byte unless the tiles' bytes differ by more than 100.
    `colours` are from `colour_background`; `share` (4, n) holds the shares in its first row, and scratch below.
    """
    n = row.shape[0]
    wide, out = share.reshape(-1)[n:], row.reshape(-1)
    for j in range(n):
        wide[3 * j] = wide[3 * j + 1] = wide[3 * j + 2] = share[0, j]
    span = slice(3 * first, 3 * (first + n))
    none, half = colours[0, v].reshape(-1)[span], colours[1, v].reshape(-1)[span]
    full = colours[2, v].reshape(-1)[span]
    for j in range(3 * n):
        a, b, c = np.float32(none[j]), np.float32(half[j]), np.float32(full[j])
        bend = a + c - _TWO * b
        out[j] = np.uint8(np.int32(a + wide[j] * (c - a - _TWO * bend * (_ONE - wide[j])) + _HALF))


@part
def draw_background(to_world, centre, lit, rgb):
    """Write the image without a body: see `share_row` and `mix_row`."""
    height, width = rgb.shape[:2]
    share = np.empty((4, width), np.float32)
    first = np.int64(0)  # for a literal 0, the parts below would be compiled a second time
    for v in range(height):
        left = to_world[2, 1] * np.float32(v) + to_world[2, 2]
        if left < _ZERO or left + to_world[2, 0] * np.float32(width - 1) < _ZERO:
            share_row(to_world, centre, v, first, share[0])
            mix_row(lit, v, first, share, rgb[v])
        else:
            sky, row = lit[0, v].reshape(-1), rgb[v].reshape(-1)
            for i in range(3 * width):
                row[i] = sky[i]


@part
def _shadow_box(limb, to_pixel, width, height, box):
    """Write the bounding box (first and last column and row) of the shadow of a limb of `_project_limb` to `box` (4,).

    `to_pixel` (3, 3) maps points of the light's plane (s, t, 1) to pixel times depth.
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


@part
def _project_limb(ends, radii, across, limb):
    """Write the limb's projection along the light's rays, the hull of two circles, to `limb` (10,).

    Larger circle's centre (2), vector to the other's (2), larger radius, difference of the radii, height of the larger
    end and rise to the other [m], inverse of the vector's length, offset of the tangent points towards the larger
    circle.
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
    length = math.sqrt(limb[2] * limb[2] + limb[3] * limb[3])
    if length <= limb[5] + 1e-9:  # projected along its axis: one circle contains the other
        limb[2] = limb[3] = limb[5] = limb[8] = limb[9] = 0.0
    else:
        limb[8], limb[9] = 1.0 / length, limb[5] / math.sqrt(length * length - limb[5] * limb[5])


@part
def _shade_row(limb, start, step, shade):
    """Raise `shade` (n,) to the limb's shadow in each pixel of a row, 0 to 1.

    `start` and `step` (3,) are the homogeneous point of the light's plane at the row's first pixel, and per pixel.
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


@part
def draw_shadows(ends, radii, view, samples, shade, rgb):
    """Darken the ground of `rgb` where limbs block the key light: sharp at the feet, blurred with height.

    The view's `across` (2, 3) are two unit vectors perpendicular to the light, and its `to_pixel` and `from_pixel` (3,
    3) map homogeneous points of the light's plane (s, t, 1) to a ray's pixel and back. `shade` is scratch, with samples
    × samples rays per pixel.
    """
    height, width = shade.shape
    shapes, boxes = np.empty((len(radii), 10), np.float32), np.empty((len(radii), 4), np.int64)
    shape, box = np.empty(10), np.empty(4)
    low_u, high_u, low_v, high_v = width, 0, height, 0
    for i in range(len(radii)):
        _project_limb(ends[i], radii[i], view.across, shape)
        _shadow_box(shape, view.to_pixel, width, height, box)
        _keep(shape, shapes[i])
        _keep(box, boxes[i])
        low_u, high_u = min(low_u, max(boxes[i, 0], 0)), max(high_u, boxes[i, 1] + 1)
        low_v, high_v = min(low_v, max(boxes[i, 2], 0)), max(high_v, boxes[i, 3] + 1)
    if low_u >= high_u or low_v >= high_v:
        return
    low_u, high_u = low_u - low_u % samples, high_u + -high_u % samples  # whole pixels
    low_v, high_v = low_v - low_v % samples, high_v + -high_v % samples
    for v in range(low_v, high_v):
        _clear(shade[v, low_u:high_u])
    start, step = np.empty(3, np.float32), np.empty(3, np.float32)
    for i in range(len(radii)):
        first, last = boxes[i, 0], boxes[i, 1] + 1
        for v in range(boxes[i, 2], boxes[i, 3] + 1 if last > first else boxes[i, 2]):
            for x in range(3):
                step[x] = view.from_pixel[x, 0]
                start[x] = view.from_pixel[x, 0] * first + view.from_pixel[x, 1] * v + view.from_pixel[x, 2]
            _shade_row(shapes[i], start, step, shade[v, first:last])
    low_u, high_u = low_u // samples, high_u // samples
    share, row = np.empty((4, high_u - low_u), np.float32), np.empty((high_u - low_u, 3), np.uint8)
    mean = np.empty(high_u - low_u, np.float32)
    for v in range(low_v // samples, high_v // samples):
        share_row(view.to_world, view.centre, v, low_u, share[0])
        mix_row(view.dark, v, low_u, share, row)
        _mean_row(shade[v * samples : (v + 1) * samples, low_u * samples : high_u * samples], mean)
        _darken_row(row, mean, rgb[v, low_u:high_u])


@part
def _keep(values, out):
    """Write values (n,) to `out`, of another type."""
    for i in range(len(values)):
        out[i] = values[i]


@part
def _clear(row):
    for i in range(len(row)):
        row[i] = _ZERO


@part
def _mean_row(fine, row):
    """Write the mean of each square of `fine` (samples, samples · n) to `row` (n,)."""
    samples = len(fine)
    part = _ONE / np.float32(samples * samples)
    for u in range(len(row)):
        total = _ZERO
        for y in range(samples):
            for x in range(samples):
                total += fine[y, samples * u + x]
        row[u] = total * part


@part
def _darken_row(dark, shade, rgb):
    """Blend a row of pixels (n, 3) towards `dark` by `shade` (n,)."""
    for u in range(len(shade)):
        if shade[u] > _ZERO:
            for k in range(3):
                a, b = np.float32(rgb[u, k]), np.float32(dark[u, k])
                rgb[u, k] = np.uint8(a + (b - a) * shade[u] + _HALF)
