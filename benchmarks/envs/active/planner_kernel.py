"""Lookahead of `Planner`, compiled: the expected errors of all beliefs, for many plans of where to look."""

import numba
import numpy as np

from motionenv.envs.active.scene_kernel import (
    ACCELERATIONS,
    ASPECT,
    MAST,
    NARROW,
    OUTER,
    RATES,
    WIDE,
    hidden,
    steer,
)  # fmt: skip

kernel = numba.njit(nogil=True, error_model="numpy")

STEP = 0.2  # [s] of the lookahead
_LEVEL = 0.9  # [m] at which people are looked at
_GROWTH, _LOST = 0.5, 6.0  # [m/s], [m]: error of the belief about a person who isn't seen, at most
_CERTAIN = 0.1  # [m] error of the belief about a person who is seen from near
_DWELL = 2  # steps to look at a person before the plan goes on
_MARGIN = 0.85  # of the image, inside of which people are surely seen


@kernel
def towards(camera, x, y, zoom, dt, command) -> None:
    """Fill `command` (3,): turn as fast as can be braked in time to look at (x, y) [m] with a `zoom`."""
    pan = (np.arctan2(y, x) - camera[0] + np.pi) % (2 * np.pi) - np.pi
    errors = pan, np.arctan2(_LEVEL - MAST, np.hypot(x, y)) - camera[1], zoom - camera[2]
    for i in range(3):
        brake = 0.5 * ACCELERATIONS[i] * dt  # it acts in whole steps
        rate = min(np.sqrt(brake**2 + 2 * ACCELERATIONS[i] * abs(errors[i])) - brake, abs(errors[i]) / dt)
        command[i] = min(rate / RATES[i], 1.0) * np.sign(errors[i])


@kernel
def foresee(cloud, pillars, points, covered) -> None:
    """Positions `points` (steps, people, m, 2) and whether they are `covered` (steps, people, m), walking straight."""
    for h in range(len(points)):
        for k in range(points.shape[1]):
            for i in range(points.shape[2]):
                p = cloud[k, i]
                gone = p[3] * STEP * h
                x, y = p[0] + gone * np.cos(p[2]), p[1] + gone * np.sin(p[2])
                shrink = min(1.0, OUTER / np.hypot(x, y))
                points[h, k, i, 0], points[h, k, i, 1] = shrink * x, shrink * y
                covered[h, k, i] = hidden(shrink * x, shrink * y, pillars)


@kernel
def _observe(camera, points, covered, noise, dropout, errors) -> float:
    """Update expected `errors` (people, m) [m] with a look at particles `points` (people, m, 2); returns their mean."""
    cp, sp, ct, st = np.cos(camera[0]), np.sin(camera[0]), np.cos(camera[1]), np.sin(camera[1])
    half, total = WIDE * NARROW ** camera[2], 0.0
    for k in range(len(points)):
        for i in range(points.shape[1]):
            x, y = points[k, i, 0], points[k, i, 1]
            error = min(errors[k, i] + _GROWTH * STEP, max(_LOST, errors[k, i]))
            ahead = cp * x + sp * y
            depth = ct * ahead + st * (_LEVEL - MAST)
            edge = _MARGIN * depth * half
            across, down = abs(sp * x - cp * y), abs(st * ahead - ct * (_LEVEL - MAST))
            if depth > 0.3 and across < edge and down < ASPECT * edge and not covered[k, i]:
                certain = _CERTAIN + noise * half * depth**2 / MAST
                error = (1 - dropout) * min(certain, error) + dropout * error
            errors[k, i] = error
            total += error
    return total / errors.size


@kernel
def _outcome(camera, goals, first, second, points, covered, noise, dropout, start) -> float:
    """Mean expected error [m] of looking at one goal, then at another; rows of `goals` are person, particle, zoom."""
    camera, errors, command = camera.copy(), start.copy(), np.zeros(3)
    total, dwelt, goal = 0.0, 0, goals[first]
    for h in range(len(points)):
        if dwelt >= _DWELL:
            goal = goals[second]
        x, y = _target(goal, points[h])
        towards(camera, x, y, goal[2], STEP, command)
        steer(camera, command, STEP)
        off = (np.arctan2(y, x) - camera[0] + np.pi) % (2 * np.pi) - np.pi
        dwelt += abs(off) < 0.5 * WIDE * NARROW ** camera[2]
        total += _observe(camera, points[h], covered[h], noise, dropout, errors)
    return total / len(points)


@kernel
def _target(goal, points):
    """Where (x, y) [m] a goal is: a particle; with particle -1 a person's mean; with person -1 a direction."""
    k, i = int(goal[0]), int(goal[1])
    if k < 0:
        return 8.0 * np.cos(goal[1]), 8.0 * np.sin(goal[1])
    if i >= 0:
        return points[k, i, 0], points[k, i, 1]
    return points[k, :, 0].mean(), points[k, :, 1].mean()


@kernel
def best_goals(cameras, pillars, clouds, sigmas, goals, steps, breadth, noise, dropout, commands, dt) -> None:
    """Fill `commands` (n, 3) with the first move of the best plan of two `goals` (g, 3) over `steps`.

    `clouds` (n, people, m, 4) are particles, `sigmas` (n, people) their standard deviations [m]. Plans begin with the
    `breadth` goals that are best by themselves.
    """
    people, m = clouds.shape[1:3]
    points, covered = np.empty((steps, people, m, 2)), np.empty((steps, people, m), np.bool_)
    for e in range(len(clouds)):
        foresee(clouds[e], pillars[e], points, covered)
        start = np.repeat(sigmas[e], m).reshape(people, m)
        alone = np.empty(len(goals))
        for a in range(len(goals)):
            alone[a] = _outcome(cameras[e], goals, a, a, points, covered, noise, dropout, start)
        order = np.argsort(alone)
        best, least = order[0], alone[order[0]]
        for a in order[:breadth]:
            for b in range(len(goals)):
                value = _outcome(cameras[e], goals, a, b, points, covered, noise, dropout, start)
                if value < least:
                    best, least = a, value
        x, y = _target(goals[best], points[0])
        towards(cameras[e], x, y, goals[best, 2], dt, commands[e])
