"""The ground, checkered tiles that fade into the horizon, and the sky.

Colours depend on the image size, the camera's intrinsics, rotation and height; the tile pattern also on its position.
`colour_background` is therefore slow and cached; `draw_background` blends its results for one position, row by row.
"""

import math

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.render.raycast._shade_kernel import byte, reflect

_ZERO, _ONE, _TWO, _HALF, _QUARTER = (np.float32(x) for x in (0, 1, 2, 0.5, 0.25))
_LEAST_WIDTH = np.float32(1e-5)  # [tiles] least width of a pixel on the ground
_FLATTEST = np.float32(-1e-6)  # greatest z of a ray that intersects the ground


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
