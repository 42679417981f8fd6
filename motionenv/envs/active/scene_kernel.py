"""The physics of ActiveTracking, compiled: how people stroll, how the camera turns, and what it sees.

The camera stands on a mast in the middle of a round plaza. Its state is (pan, tilt [rad], zoom, and their rates per
second): pan from x towards y, tilt above the horizon, zoom from 0 (wide) to 1 (narrow). Image coordinates are in units
of half the image's width: u to the right, v down. Pillars are higher than the camera, so hiding is a question of the
plan.
"""

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv._core.random import gaussian, restart, uniform

#: Height of the camera [m]; people stay between the radii `INNER` and `OUTER` [m] of the plaza.
MAST, INNER, OUTER = 4.5, 3.0, 13.0
#: Half the field of view's width at depth 1 when wide, and the factor on it when narrow; height over width of images.
WIDE, NARROW, ASPECT = np.tan(np.radians(20.0)), 0.5, 0.75
#: Greatest rates and accelerations of pan, tilt [rad/s, rad/s²] and zoom [1/s, 1/s²]; limits of tilt [rad].
RATES, ACCELERATIONS, TILT = np.array([4.0, 2.0, 2.0]), np.array([12.0, 6.0, 4.0]), (-1.1, 0.0)
#: Slowest and fastest walk [m/s].
SPEEDS = 0.8, 1.6

_CLEAR, _AHEAD, _TRIES, _VEER = 0.4, 0.6, 30, 1.2  # [m], [m], draws, [rad] spread of turns
_SEEN = 8  # of 15 points, of whom is detected
_TURN = 2.0 * np.pi


@part
def free(x, y, pillars) -> bool:
    """Whether a person can stand at (x, y) [m] among `pillars` (p, 3), rows of x, y and radius."""
    r = np.hypot(x, y)
    if r < INNER or r > OUTER:
        return False
    for p in pillars:
        if np.hypot(x - p[0], y - p[1]) < p[2] + _CLEAR:
            return False
    return True


@part
def stroll(state, walk, pillars, chance, dt) -> None:
    """Move `walk` (x, y, heading, speed) on by `dt` [s]; it turns with a `chance`, and before what is in the way.

    `state` is a stream of random numbers.
    """
    if uniform(state) < chance:
        walk[2] += _VEER * gaussian(state)
    for _ in range(_TRIES):
        c, s = np.cos(walk[2]), np.sin(walk[2])
        if free(walk[0] + _AHEAD * c, walk[1] + _AHEAD * s, pillars):
            walk[0] += walk[3] * dt * c
            walk[1] += walk[3] * dt * s
            return
        walk[2] += _VEER * gaussian(state)


@part
def set_off(state, walk) -> None:
    """Draw heading and speed of `walk` (4,)."""
    walk[2] = _TURN * uniform(state)
    walk[3] = SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * uniform(state)


@part
def appear(state, walk, pillars) -> None:
    """Draw `walk` (4,) anywhere on the plaza that is free."""
    walk[0] = walk[1] = 0.0
    while not free(walk[0], walk[1], pillars):
        walk[0], walk[1] = OUTER * (2.0 * uniform(state) - 1.0), OUTER * (2.0 * uniform(state) - 1.0)
    set_off(state, walk)


@kernel
def wander(keys, pillars, chance, dt, walks) -> None:
    """Fill `walks` (people, frames, 4), each from a key of its own."""
    state = np.empty(1, dtype=np.uint64)
    for k in range(len(walks)):
        restart(state, keys[k], 0)
        appear(state, walks[k, 0], pillars)
        for t in range(1, walks.shape[1]):
            walks[k, t] = walks[k, t - 1]
            stroll(state, walks[k, t], pillars, chance, dt)


@part
def steer(camera, command, dt) -> None:
    """Advance `camera` (6,) by `dt` [s] towards the rates `command` (3,), from -1 to 1 of `RATES`."""
    for i in range(3):
        change = command[i] * RATES[i] - camera[3 + i]
        most = ACCELERATIONS[i] * dt
        camera[3 + i] += min(max(change, -most), most)
        camera[i] += camera[3 + i] * dt
    camera[0] = (camera[0] + np.pi) % _TURN - np.pi
    for i, (low, high) in enumerate((TILT, (0.0, 1.0))):
        at = min(max(camera[1 + i], low), high)
        if at != camera[1 + i]:
            camera[1 + i], camera[4 + i] = at, 0.0


@kernel
def steer_all(slots, cameras, commands, dt) -> None:
    """`steer` the cameras (n, 6) of `slots` by their commands (n, 3)."""
    for i in slots:
        steer(cameras[i], commands[i], dt)


@part
def sight(camera, x, y, z):
    """Image coordinates (u, v) and depth [m] of a point; u and v are 9 behind the camera."""
    cp, sp, ct, st = np.cos(camera[0]), np.sin(camera[0]), np.cos(camera[1]), np.sin(camera[1])
    ahead, up = cp * x + sp * y, z - MAST
    depth = ct * ahead + st * up
    if depth < 0.3:
        return 9.0, 9.0, depth
    scale = 1.0 / (depth * WIDE * NARROW ** camera[2])
    return (sp * x - cp * y) * scale, (st * ahead - ct * up) * scale, depth


@part
def hidden(x, y, pillars) -> bool:
    """Whether one of the `pillars` stands between the mast and (x, y)."""
    square = x * x + y * y
    for p in pillars:
        t = min(max((p[0] * x + p[1] * y) / square, 0.0), 1.0)
        if np.hypot(t * x - p[0], t * y - p[1]) < p[2]:
            return True
    return False


@part
def inside(u, v) -> bool:
    return abs(u) <= 1.0 and abs(v) <= ASPECT


@part
def sharpness(camera, blur) -> float:
    """Share of detections that a turning camera keeps: exp(-s²), if it moves by s halves of the image in `blur` [s]."""
    rate = np.hypot(camera[3] * np.cos(camera[1]), camera[4])
    return np.exp(-((blur * rate / (WIDE * NARROW ** camera[2])) ** 2))


@kernel
def look(slots, keys, time, cameras, pillars, bodies, hues, noise, points, seen, colours) -> None:
    """Detect people with joints `bodies` (k, people, 15, 3) [m] and `hues` (n, people) [rad], for k `slots`.

    Fills `points` (n, people, 15, 2), `seen` (n, people, 15) and `colours` (n, people, 2), from left to right. `noise`
    is that of points, of hues [rad] in the widest view, the share of people that are missed by a camera that stands
    still, and the time [s] over which a turning one blurs. All randomness of a frame comes from its key and number.
    """
    state, people = np.empty(1, dtype=np.uint64), bodies.shape[1]
    found, shown, tints = np.empty((people, 15, 2)), np.empty((people, 15), np.int8), np.empty(people)
    for i, e in enumerate(slots):
        restart(state, keys[e], time[e])
        detected = (1.0 - noise[2]) * sharpness(cameras[e], noise[3])
        order, camera = np.full(people, np.inf), cameras[e]
        for k in range(people):
            for j in range(15):
                x, y, z = bodies[i, k, j, 0], bodies[i, k, j, 1], bodies[i, k, j, 2]
                u, v, _ = sight(camera, x, y, z)
                shown[k, j] = clear = inside(u, v) and not hidden(x, y, pillars[e])
                found[k, j, 0] = clear * min(max(u + noise[0] * gaussian(state), -2.0), 2.0)
                found[k, j, 1] = clear * min(max(v + noise[0] * gaussian(state), -2.0), 2.0)
            count = shown[k].sum()
            tints[k] = hues[e, k] + noise[1] * NARROW ** camera[2] * gaussian(state)
            if uniform(state) < detected and count >= _SEEN:
                order[k] = found[k, :, 0].sum() / count
        for d, k in enumerate(np.argsort(order)):
            there = np.int8(order[k] < np.inf)
            colours[e, d, 0], colours[e, d, 1] = there * np.cos(tints[k]), there * np.sin(tints[k])
            seen[e, d], points[e, d] = there * shown[k], there * found[k]
