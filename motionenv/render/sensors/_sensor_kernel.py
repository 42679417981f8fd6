"""Sensors: composition of images per pixel (background, objects, light, noise), and markers with noise and gaps.

A kernel each, so that only those are compiled that an environment asks for.
"""

import math

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv._core.random import restart, uniform

#: Background depth, and greatest depth [m].
FAR = 20.0

#: Steps of the table of Gaussian noise per standard deviation.
STEPS = 32.0

# Columns of the table of objects (float64): first sprite and number of sprites of its cycle, cycles per frame and
# initial phase; initial left edge [pixels], speed [pixels per frame], period of its path [pixels]; top edge, width and
# height [pixels]; depth [m]; 1 if mirrored; gain; parallax: panning speed relative to the background's, which is the
# ratio of their distances.
SPRITE, PHASES, CYCLES, PHASE, X, SPEED, PERIOD, TOP, WIDE, HIGH, DEPTH, MIRROR, GAIN, PARALLAX, THING = range(15)

_HALF, _MOST, _ZERO = np.float32(0.5), np.float32(255), np.float32(0)
_TURN = 2.0 * np.pi


@kernel
def put_colours(start, stop, slots, colours, rise, limbs, rgb):
    """Draw a uniform colour behind the bodies of images `start` to `stop`, which are on black.

    `slots` (m,) are the images' episodes, which have colours (n, 3) and a gradient from top to bottom, `rise` (n,),
    that must keep them within 0 to 255.
    """
    height, width = limbs.shape[1:]
    base, line = np.empty(3 * width, np.uint8), np.empty(3 * width, np.uint8)
    for i in range(start, stop):
        slot = slots[i]
        for j in range(3 * width):
            base[j] = colours[slot, j % 3]
        for v in range(height):
            row = rgb[i, v].reshape(-1)
            body = _any(limbs[i, v])
            higher = np.uint8(math.floor(rise[slot] * ((v + 0.5) / height - 0.5) + 0.5) % 256)
            _fade(base, higher, line if body else row)
            if body:
                _put_around(limbs[i, v], line, row)


@kernel
def put_photographs(start, stop, slots, pan, photographs, which, offset, gain, limbs, rgb):
    """Draw photographs behind the bodies of images `start` to `stop`, which are on black.

    `photographs` are (b, height, period + width, 3). `slots` (m,) are the images' episodes, each with a photograph
    `which`, an `offset` [pixels] and a `gain`, an integer up to 256, (n,); `pan` (m,) [pixels] is the images'.
    """
    height, width = limbs.shape[1:]
    period, line = photographs.shape[2] - width, np.empty(3 * width, np.uint8)
    for i in range(start, stop):
        slot = slots[i]
        at = (offset[slot] + pan[i]) % period
        first = min(int(at), period - 1)
        right = np.uint32((at - first) * gain[slot] + 0.5)
        left = np.uint32(gain[slot] - right)
        for v in range(height):
            row = rgb[i, v].reshape(-1)
            body = _any(limbs[i, v])
            _slide(photographs[which[slot], v].reshape(-1)[3 * first :], left, right, line if body else row)
            if body:
                _put_around(limbs[i, v], line, row)


@kernel
def put_things(start, stop, slots, time, pan, sprites, table, pictures):
    """Draw objects into images `start` to `stop` at `time` (m,) [frames] and `pan` (m,) [pixels].

    `slots` (m,) are the images' episodes, whose objects are `table` (n, k, THING) of `sprites` (s, rows, columns, 4).
    `pictures` are depth, limbs and rgb, which is skipped if of length 0.
    """
    depth, limbs, rgb = pictures
    columns = np.empty(depth.shape[2], np.int64)
    for i in range(start, stop):
        picture = rgb[i] if len(rgb) > 0 else np.empty((0, 0, 3), np.uint8)
        for k in range(table.shape[1]):
            _put_thing(table[slots[i], k], time[i], pan[i], sprites, columns, depth[i], limbs[i], picture)


@kernel
def develop(start, stop, slots, time, light, rgb):
    """Apply light and sensor noise to images `start` to `stop` of the episodes `slots` (m,) at `time` (m,) [frames].

    `light` is the relative amplitude of its variation; frequency [rad/frame] and phase of two waves (n, 4); noise [grey
    levels], its keys (n,) and its table (int8, STEPS per standard deviation, g for g + 1/2).
    """
    share, waves, noise, keys, gaussian = light
    state = np.empty(1, np.uint64)
    for i in range(start, stop):
        gain = np.float32(1.0 + share * _wave(waves[slots[i]], time[i]))
        restart(state, keys[slots[i]], np.int64(time[i]))
        _develop(gain, np.float32(noise / STEPS), gaussian, state, rgb[i])


@part
def _wave(wave, time):
    """Sum of two sines, from -1 to 1."""
    return 0.6 * math.sin(wave[0] * time + wave[1]) + 0.4 * math.sin(wave[2] * time + wave[3])


@part
def _any(limbs):
    """Whether a row shows any part of the body."""
    seen = np.uint8(0)
    for u in range(len(limbs)):
        seen |= limbs[u]
    return seen > 0


@part
def _fade(base, rise, row):
    """Write `base` plus `rise` (negative modulo 256) as uint8, which compiles to 32-byte SIMD."""
    for j in range(len(row)):
        row[j] = base[j] + rise


@part
def _slide(photograph, left, right, row):
    """Write a row of a photograph, shifted by subpixels: `left` / 256 of each pixel, `right` / 256 of the next."""
    here, next_ = photograph[: len(row)], photograph[3 : len(row) + 3]
    half, bits = np.uint32(128), np.uint32(8)  # unsigned, so that the compiler can use 16-bit SIMD
    for j in range(len(row)):
        row[j] = (np.uint32(here[j]) * left + np.uint32(next_[j]) * right + half) >> bits


@part
def _put_around(limbs, line, row):
    """Copy `line` (3 · width,) to `row` where there is no limb."""
    for u in range(len(limbs)):
        if limbs[u] == 0:
            row[3 * u], row[3 * u + 1], row[3 * u + 2] = line[3 * u], line[3 * u + 1], line[3 * u + 2]


@part
def _put_thing(thing, time, pan, sprites, columns, depth, limbs, rgb):
    """Draw an object in front of everything farther away; `columns` (width,) is scratch."""
    height, width = depth.shape
    sprite = sprites[int(thing[SPRITE]) + int((thing[PHASE] + thing[CYCLES] * time) % 1.0 * thing[PHASES])]
    left = (thing[X] + thing[SPEED] * time - thing[PARALLAX] * pan) % thing[PERIOD] - thing[WIDE]
    first, last = max(math.ceil(left - 0.5), 0), min(math.ceil(left + thing[WIDE] - 0.5), width)
    top, bottom = max(math.ceil(thing[TOP] - 0.5), 0), min(math.ceil(thing[TOP] + thing[HIGH] - 0.5), height)
    across, down = sprite.shape[1] / thing[WIDE], sprite.shape[0] / thing[HIGH]
    for u in range(first, last):
        column = min(max(int((u + 0.5 - left) * across), 0), sprite.shape[1] - 1)
        columns[u] = sprite.shape[1] - 1 - column if thing[MIRROR] > 0.0 else column
    z, gain = np.float32(thing[DEPTH]), np.float32(thing[GAIN])
    for v in range(top, bottom):
        pixels = sprite[min(max(int((v + 0.5 - thing[TOP]) * down), 0), sprite.shape[0] - 1)]
        for u in range(first, last):
            pixel = pixels[columns[u]]
            if pixel[3] > 0 and z < depth[v, u]:
                depth[v, u], limbs[v, u] = z, 0
                for c in range(3 if len(rgb) > 0 else 0):
                    rgb[v, u, c] = np.uint8(np.float32(pixel[c]) * gain)


@part
def _develop(gain, noise, gaussian, state, rgb):
    """Apply the light's gain, and noise that is read from a random offset of the table `gaussian` (n,) for each row.

    `noise` is in grey levels per step of the table; `state` (1,) is the random stream's.
    """
    middle = _HALF + _HALF * noise  # half a grey level plus half a table step, for unbiased rounding
    places = len(gaussian) - 3 * rgb.shape[1]
    for v in range(len(rgb)):
        place = int(uniform(state) * places) if noise > _ZERO else 0
        row, grain = rgb[v].reshape(-1), gaussian[place:]
        for j in range(len(row)):
            x = np.float32(row[j]) * gain + np.float32(grain[j]) * noise + middle
            x = x if x > _ZERO else _ZERO
            row[j] = np.uint8(np.int32(x if x < _MOST else _MOST))


@kernel
def look(slots, walkers, alphas, keys, time, setting, joints, hidden, points, seen) -> None:
    """Rotate walkers (k, 15, 3) [m], who walk along x, by their view angle and observe them.

    All randomness in a frame is derived from the episode's key and the frame number, in the same order for each marker.
    At time 0 gaps are drawn from their stationary distribution, later by a Markov chain. `slots` (k,) are rows of the
    other arrays: `alphas` [rad], `keys` and `time` (n,), true `joints` (n, 15, 3) [m] with the camera at α = 0,
    `hidden` (n, 15), markers in a gap, and observed `points` (n, 15, 2) [m] with `seen` (n, 15), both 0 if missing.
    `setting` is noise [m], dropout, gap fraction, probabilities of starting and of continuing a gap, distance and
    height of the camera [m].
    """
    noise, dropout, share, start, stay, distance, height = setting
    state = np.empty(1, dtype=np.uint64)
    for i in range(len(slots)):
        e = slots[i]
        restart(state, keys[e], time[e])
        s, c = np.sin(alphas[e]), np.cos(alphas[e])
        for m in range(joints.shape[1]):
            x, y, z = walkers[i, m, 0], walkers[i, m, 1], walkers[i, m, 2]
            across, depth = c * x + s * y, c * y - s * x
            joints[e, m, 0], joints[e, m, 1], joints[e, m, 2] = across, depth, z
            chance = share if time[e] == 0 else stay if hidden[e, m] else start
            hidden[e, m] = uniform(state) < chance
            dropped = uniform(state) < dropout
            first, second = uniform(state), uniform(state)
            if hidden[e, m] or dropped:
                seen[e, m], points[e, m, 0], points[e, m, 1] = 0, 0.0, 0.0
                continue
            scale = distance / (distance + depth) if distance < np.inf else 1.0
            radius, angle = noise * np.sqrt(-2.0 * np.log(1.0 - first)), _TURN * second  # Box & Muller (1958)
            seen[e, m] = 1
            points[e, m, 0] = scale * across + radius * np.cos(angle)
            points[e, m, 1] = height + scale * (z - height) + radius * np.sin(angle)
