"""Lookahead of `Planner`, compiled: the expected errors of all beliefs, for many goals to look at next.

Directions are (pan, tilt) [rad] from the camera; a goal is a row of person, particle and zoom. The last particle is
the person's mean; with person -1 it is the direction that particle and zoom say, in the widest view.
"""

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv.envs.active import scene_kernel as scene

LEVEL = 0.9  # [m] at which people are looked at
_LOST = 6.0  # [m] error of the belief about a person who could be anywhere
_CERTAIN = 0.2  # [m] error of the belief about a person who is seen
_MARGIN = 0.85  # of the image, inside of which people are surely seen


@part
def _turn(off):
    """An angle between -π and π."""
    return (off + np.pi) % (2 * np.pi) - np.pi


@part
def towards(camera, pan, tilt, zoom, dt, command) -> None:
    """Fill `command` (3,): turn as fast as can be braked in time to reach `pan`, `tilt` [rad] and `zoom`."""
    errors = _turn(pan - camera[0]), tilt - camera[1], zoom - camera[2]
    for i in range(3):
        brake = 0.5 * scene.ACCELERATIONS[i] * dt  # it acts in whole steps
        rate = min(np.sqrt(brake**2 + 2 * scene.ACCELERATIONS[i] * abs(errors[i])) - brake, abs(errors[i]) / dt)
        command[i] = min(rate / scene.RATES[i], 1.0) * np.sign(errors[i])


@kernel
def turn_to(cameras, goals, dt, commands) -> None:
    """Fill `commands` (n, 3) that turn `cameras` (n, 6) towards `goals` (n, 3) of pan, tilt and zoom."""
    for e in range(len(cameras)):
        towards(cameras[e], goals[e, 0], goals[e, 1], goals[e, 2], dt, commands[e])


@part
def _foresee(cloud, pillars, dt, ways, free) -> None:
    """Directions `ways` (steps, people, m + 1, 2) of particles and, last, their mean, walking straight on.

    `free` (steps, people, m) tells who isn't behind a pillar.
    """
    m = len(cloud[0])
    for h in range(len(ways)):
        for k in range(len(cloud)):
            s, c, t = 0.0, 0.0, 0.0
            for i in range(m):
                p = cloud[k, i]
                gone = p[3] * dt * (h + 1)
                x, y = p[0] + gone * np.cos(p[2]), p[1] + gone * np.sin(p[2])
                far = np.hypot(x, y)
                x, y, far = min(1.0, scene.OUTER / far) * x, min(1.0, scene.OUTER / far) * y, min(scene.OUTER, far)
                ways[h, k, i, 0], ways[h, k, i, 1] = np.arctan2(y, x), np.arctan2(LEVEL - scene.MAST, far)
                free[h, k, i] = not scene.hidden(x, y, pillars)
                s, c, t = s + y / far, c + x / far, t + ways[h, k, i, 1]
            ways[h, k, m, 0], ways[h, k, m, 1] = np.arctan2(s, c), t / m


@part
def _aim(goal, ways):
    """Pan, tilt and zoom of a goal, among people in directions `ways` (people, m + 1, 2)."""
    k, i = int(goal[0]), int(goal[1])
    if k < 0:
        return goal[1], goal[2], 0.0
    return ways[k, i, 0], ways[k, i, 1], goal[2]


@part
def _edges(tilt, zoom):
    """How far [rad] from a camera's direction people are surely seen, across and down."""
    half = _MARGIN * scene.WIDE * scene.NARROW**zoom
    return half / np.cos(tilt), scene.ASPECT * half


@part
def _in_view(pan, tilt, edges, way) -> bool:
    """Whether a direction `way` (2,) is within `edges` of another."""
    if abs(tilt - way[1]) > edges[1]:
        return False
    off = abs(way[0] - pan)
    return min(off, 2.0 * np.pi - off) < edges[0]


@part
def _observe(camera, ways, free, noise, growth, errors) -> float:
    """Update expected `errors` (people, m) [m] with a look at particles; returns their mean."""
    edges, total = _edges(camera[1], camera[2]), 0.0
    found = (1.0 - noise[2]) * scene.sharpness(camera, noise[3])
    for k in range(errors.shape[0]):
        for i in range(errors.shape[1]):
            error = errors[k, i] = min(errors[k, i] + growth, max(_LOST, errors[k, i]))
            if free[k, i] and _in_view(camera[0], camera[1], edges, ways[k, i]):
                errors[k, i] -= found * max(error - _CERTAIN, 0.0)
            total += errors[k, i]
    return total / errors.size


@part
def _time(camera, pan, tilt) -> float:
    """About how long [s] it takes to turn to `pan` and `tilt`."""
    rate, acceleration = scene.RATES[0], scene.ACCELERATIONS[0]
    apart = max(abs(_turn(pan - camera[0])), abs(tilt - camera[1]) * rate / scene.RATES[1])
    return min(2.0 * np.sqrt(apart / acceleration), apart / rate + rate / acceleration)


@part
def _worth(camera, goal, ways, free, errors, dwell) -> float:
    """Expected error [m] in view of a goal, for the time [s] that it takes to turn and look there."""
    pan, tilt, zoom = _aim(goal, ways)
    edges, gain = _edges(tilt, zoom), 0.0
    for k in range(errors.shape[0]):
        for i in range(errors.shape[1]):
            if free[k, i] and _in_view(pan, tilt, edges, ways[k, i]):
                gain += max(errors[k, i] - _CERTAIN, 0.0)
    return gain / (dwell + _time(camera, pan, tilt))


@part
def _worths(camera, goals, ways, free, errors, dwell):
    """What each of the goals is worth by itself."""
    return np.array([_worth(camera, goal, ways, free, errors, dwell) for goal in goals])


@part
def _outcome(camera, goals, first, ways, free, noise, dt, growth, dwell, errors) -> float:
    """Mean expected error [m] of looking at the goal `first`, and then at what is best next, again and again."""
    command, total, looked, goal = np.zeros(3), 0.0, 0.0, first
    for h in range(len(ways)):
        if looked >= dwell:
            goal, looked = _worths(camera, goals, ways[h], free[h], errors, dwell).argmax(), 0.0
        pan, tilt, zoom = _aim(goals[goal], ways[h])
        towards(camera, pan, tilt, zoom, dt, command)
        scene.steer(camera, command, dt)
        total += _observe(camera, ways[h], free[h], noise, growth * dt, errors)
        if _in_view(camera[0], camera[1], _edges(camera[1], camera[2]), (pan, tilt)):
            looked += dt * scene.sharpness(camera, noise[3])
    return total / len(ways)


@kernel
def look_at(cameras, aims, blur, dt, looked) -> None:
    """Add to `looked` (n,) how long [s] cameras have seen their `aims` (n, 3) sharply in a frame of `dt` [s]."""
    for e in range(len(cameras)):
        edges = _edges(cameras[e, 1], cameras[e, 2])
        if _in_view(cameras[e, 0], cameras[e, 1], (0.5 * edges[0], 0.5 * edges[1]), (aims[e, 0], aims[e, 1])):
            looked[e] += dt * scene.sharpness(cameras[e], blur)


@kernel
def plan(slots, cameras, pillars, clouds, sigmas, goals, breadth, steps, noise, growth, dwell, dt, aims) -> None:
    """Fill `aims` (n, 3), pan, tilt and zoom of the best of `goals` (g, 3), for some `slots`.

    Of the goals, the `breadth` most worthwhile are tried, looking `steps` of `dt` [s] ahead.
    `clouds` (n, people, m, 4) are particles, `sigmas` (n, people) their standard deviations [m], which grow by `growth`
    [m/s]. A look takes `dwell` [s].
    """
    people, m = clouds.shape[1:3]
    ways, free = np.empty((steps, people, m + 1, 2)), np.empty((steps, people, m), np.bool_)
    for e in slots:
        _foresee(clouds[e], pillars[e], dt, ways, free)
        now = np.repeat(sigmas[e], m).reshape(people, m)
        worths = _worths(cameras[e], goals, ways[0], free[0], now, dwell)
        least, best = np.inf, goals[0]
        for g in np.argsort(-worths)[:breadth]:
            value = _outcome(cameras[e].copy(), goals, g, ways, free, noise, dt, growth, dwell, now.copy())
            if value < least:
                least, best = value, goals[g]
        pan, tilt, _ = _aim(best, ways[0])
        arrival = min(int(_time(cameras[e], pan, tilt) / dt), steps - 1)
        aims[e, 0], aims[e, 1], aims[e, 2] = _aim(best, ways[arrival])
