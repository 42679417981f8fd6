"""The body's shadow on the ground, per limb: sharp where the limb touches the ground, blurred with height."""

import math

import numpy as np

from motionenv._core.compilation import part
from motionenv.render.raycast._ground_kernel import mix_row, share_row

# Width of the shadow's penumbra [m]: at the ground, and per metre of height.
_EDGE, _EDGE_PER_METRE = np.float32(0.012), np.float32(0.07)
_ZERO, _ONE, _HALF = np.float32(0), np.float32(1), np.float32(0.5)


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
