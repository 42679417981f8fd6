"""Particles of `Beliefs`, compiled."""

import numpy as np

from motionenv._core.compilation import kernel, part
from motionenv._core.random import gaussian, restart, uniform
from motionenv.envs.active import scene_kernel as scene

_SWAY = 0.06  # [m] of what is seen of a body about its position
_HALF = 0.25  # [m] about the middle of a body, in which its edges count as seen or unseen
_MIDDLE = 0.53  # of the body's height
_MOST = 0.999  # chance that somebody in view is detected
_JUMP = 1e-3  # share of the belief that anybody could be anywhere
_WIDTH = 0.7  # of kernels about particles, relative to Silverman's
_JITTER = 0.02, 0.1, 0.05  # [m], [rad], [m/s] of particles
_AREA = np.pi * (scene.OUTER**2 - scene.INNER**2)


@kernel
def scatter(slots, keys, pillars, particles) -> None:
    """Draw the `particles` (n, people, m, 4) of `slots` anywhere."""
    state = np.empty(1, dtype=np.uint64)
    for e in slots:
        restart(state, keys[e], 0)
        for k in range(particles.shape[1]):
            for i in range(particles.shape[2]):
                scene.appear(state, particles[e, k, i], pillars[e])


@kernel
def weigh(cameras, pillars, heights, hues, found, noise, widths, particles, weights, unseen, gains) -> None:
    """Compare `particles` (n, people, m, 4) with detections `found` (n, people, 5).

    Rows of `found` are u, v, height of what is seen relative to the body's, number of points (0: none), hue. Fills
    `weights` (n, people, detections, 1 + m), of which the first is that of jumps, `unseen` (n, people, m), the
    likelihood of not being detected, and `gains` (n, people, detections), log Bayes factors.
    """
    m = particles.shape[2]
    for e in range(len(particles)):
        blur = noise[1] * scene.NARROW ** cameras[e, 2]
        sharp = min((1.0 - noise[2]) * scene.sharpness(cameras[e], noise[3]), _MOST)
        for k in range(particles.shape[1]):
            missing = 0.0
            for i in range(m):
                p = particles[e, k, i]
                unseen[e, k, i] = 1.0 - sharp * _visible(cameras[e], pillars[e], p[0], p[1], _MIDDLE * heights[e, k])
                missing += unseen[e, k, i] / m
            for d in range(found.shape[1]):
                if found[e, d, 3] == 0:
                    break
                total = _match(cameras[e], found[e, d], heights[e, k], noise[0], widths[e, k], particles[e, k],
                               weights[e, k, d])  # fmt: skip
                off = (found[e, d, 4] - hues[e, k] + np.pi) % (2 * np.pi) - np.pi
                gains[e, k, d] = np.log(total) - np.log(missing) - 0.5 * (off / blur) ** 2


@part
def _visible(camera, pillars, x, y, z) -> float:
    """Chance that enough of a body about (x, y, z) [m] is in view, and not behind a pillar: of three points in it."""
    u, v, depth = scene.sight(camera, x, y, z)
    margin = 2.0 * _HALF / (max(depth, 1.0) * scene.WIDE * scene.NARROW ** camera[2])
    if abs(u) > 1.0 + margin or abs(v) > scene.ASPECT + margin:
        return 0.0
    count, far = 0.0, np.hypot(x, y)
    for side in (-_HALF, 0.0, _HALF):
        a, b = x - side * y / far, y + side * x / far
        u, v, _ = scene.sight(camera, a, b, z + side)
        count += scene.inside(u, v) and not scene.hidden(a, b, pillars)
    return count / 3.0


@part
def _match(camera, detection, height, noise, width, particles, weights) -> float:
    """Fill `weights` (1 + m,) of particles, kernels of a `width` [m], for a detection; returns their sum."""
    z, m, half = detection[2] * height, len(particles), scene.WIDE * scene.NARROW ** camera[2]
    x, y = _ground(camera, detection[0], detection[1], z)
    depth = scene.sight(camera, x, y, z)[2]
    weights[0] = total = _JUMP / _AREA * (depth * half) ** 2 * depth / (scene.MAST - z)  # ∫ likelihood dx dy
    for i in range(m):
        u, v, deep = scene.sight(camera, particles[i, 0], particles[i, 1], z)
        a, b, error = _variances(detection, noise, half, deep, z, width)
        a, b = a + error, b + error
        away = (u - detection[0]) ** 2 / a + (v - detection[1]) ** 2 / b
        weights[1 + i] = (1 - _JUMP) * np.exp(-0.5 * away) / (2 * np.pi * np.sqrt(a * b) * m)
        total += weights[1 + i]
    return total


@part
def _variances(detection, noise, half, depth, z, width):
    """Variances of u and v of a kernel of a `width` [m] on the ground, and of a detection of a body, which sways."""
    depth = max(depth, 1.0)
    square = (width / (depth * half)) ** 2
    return square, square * ((scene.MAST - z) / depth) ** 2, noise**2 / detection[3] + (_SWAY / (depth * half)) ** 2


@part
def _ground(camera, u, v, z):
    """Where (x, y) [m] the ray through (u, v) meets the height z [m]; as far as the square reaches at most."""
    half = scene.WIDE * scene.NARROW ** camera[2]
    cp, sp, ct, st = np.cos(camera[0]), np.sin(camera[0]), np.cos(camera[1]), np.sin(camera[1])
    ahead, down = ct + half * v * st, half * v * ct - st
    far = (scene.MAST - z) / down if down > 0.0 else np.inf
    reach = np.hypot(ahead, half * u)
    far = min(far, scene.OUTER / reach)
    return far * (cp * ahead + sp * half * u), far * (sp * ahead - cp * half * u)


@kernel
def share(gains, counts, shares) -> None:
    """Fill `shares` (n, people, 1 + detections), the probabilities that a person is nobody or one of the detections.

    Exact joint probabilistic data association (Bar-Shalom & Fortmann 1988) from log Bayes factors `gains` (n, people,
    detections): sums over all one-to-one assignments of the first `counts` (n,) detections to people, by recursion over
    people and sets of detections, forwards and backwards.
    """
    people = gains.shape[1]
    for e in range(len(gains)):
        sets, factors = 1 << counts[e], np.zeros((people, counts[e]))
        for d in range(counts[e]):
            factors[:, d] = np.exp(gains[e, :, d] - gains[e, :, d].max())
        before, after = np.zeros((people + 1, sets)), np.zeros((people + 1, sets))
        before[0, 0] = after[people, sets - 1] = 1.0
        for k in range(people):
            _assign(factors[k], before[k], before[k + 1])
        for k in range(people - 1, -1, -1):
            _assign(factors[k], after[k + 1][::-1], after[k][::-1])
        for k in range(people):
            _marginals(factors[k], before[k], after[k + 1], shares[e, k])


@part
def _assign(factors, before, after) -> None:
    """Add one more person with `factors` (detections,) to the sums (sets,) over who has which detections."""
    for taken in range(len(before)):
        after[taken] += before[taken]
        for d in range(len(factors)):
            if not taken >> d & 1:
                after[taken | 1 << d] += factors[d] * before[taken]


@part
def _marginals(factors, before, after, shares) -> None:
    """Fill `shares` (1 + detections,) of a person from the sums (sets,) over those before and those after."""
    shares[0] = (before * after).sum()
    for d in range(len(factors)):
        for taken in range(len(before)):
            if not taken >> d & 1:
                shares[1 + d] += factors[d] * before[taken] * after[taken | 1 << d]
    shares /= shares.sum()


@kernel
def renew(keys, time, cameras, pillars, heights, found, shares, weights, unseen, noise, pace, widths, particles, sums):
    """Resample `particles` (n, people, m, 4) given `shares`, sum them up, and move them on.

    `sums` (n, people, 3) become mean x, y and standard deviation [m]. `pace` is the chance of a turn and the time of a
    frame [s].
    """
    state, m = np.empty(1, dtype=np.uint64), particles.shape[2]
    for e in range(len(particles)):
        restart(state, keys[e], 1 + time[e])
        for k in range(particles.shape[1]):
            cloud, chances, jumps = particles[e, k], np.zeros((1 + found.shape[1], m)), np.zeros(found.shape[1])
            chances[0] = shares[e, k, 0] / unseen[e, k].sum() * unseen[e, k]
            for d in range(len(jumps)):
                if shares[e, k, 1 + d] > 0:
                    each = shares[e, k, 1 + d] / weights[e, k, d].sum()
                    chances[1 + d] = each * weights[e, k, d, 1:]
                    jumps[d] = each * weights[e, k, d, 0]
            old, total = cloud.copy(), jumps.sum()
            for i, at in enumerate(_resampled(state, chances.sum(axis=0))):
                cloud[i] = old[at]
                jumped = uniform(state) < total
                d = _drawn(state, jumps) if jumped else _drawn(state, chances[:, at]) - 1
                if d >= 0:
                    width = np.inf if jumped else widths[e, k]
                    _spring(state, cameras[e], found[e, d], heights[e, k], noise[0], width, cloud[i])
            _sum(cloud, sums[e, k])
            for i in range(m):
                _move(state, cloud[i], pillars[e], pace)
            widths[e, k] = _WIDTH * sums[e, k, 2] * m ** (-1.0 / 6.0)


@part
def _drawn(state, chances) -> int:
    """An index, drawn in proportion to `chances`."""
    goal = chances.sum() * uniform(state)
    return min(np.searchsorted(np.cumsum(chances), goal, side="right"), len(chances) - 1)


@part
def _resampled(state, chances):
    """Indices (m,) of particles, drawn systematically (Kitagawa 1996)."""
    m, at, reached = len(chances), 0, chances[0]
    drawn, step = np.empty(m, np.intp), chances.sum() / m
    goal = step * uniform(state)
    for i in range(m):
        while reached < goal and at < m - 1:
            at += 1
            reached += chances[at]
        goal += step
        drawn[i] = at
    return drawn


@part
def _move(state, walk, pillars, pace) -> None:
    """Move a particle on by a frame, with a little noise, which keeps particles apart."""
    walk[0] += _JITTER[0] * gaussian(state)
    walk[1] += _JITTER[0] * gaussian(state)
    walk[2] += _JITTER[1] * gaussian(state)
    walk[3] = min(max(walk[3] + _JITTER[2] * gaussian(state), scene.SPEEDS[0]), scene.SPEEDS[1])
    scene.stroll(state, walk, pillars, pace[0], pace[1])


@part
def _spring(state, camera, detection, height, noise, width, walk) -> None:
    """Move `walk` (4,), a kernel of a `width` [m], to where a detection may be: a draw from what a Kalman filter says.

    With an infinite width it comes from anywhere, and walks in any direction.
    """
    z, half = detection[2] * height, scene.WIDE * scene.NARROW ** camera[2]
    u, v, depth = scene.sight(camera, walk[0], walk[1], z)
    a, b, error = _variances(detection, noise, half, depth, z, width)
    p, q = a / (a + error), b / (b + error)
    if width == np.inf:
        p = q = 1.0
        scene.set_off(state, walk)
    u += p * (detection[0] - u) + np.sqrt(p * error) * gaussian(state)
    v += q * (detection[1] - v) + np.sqrt(q * error) * gaussian(state)
    walk[0], walk[1] = _ground(camera, u, v, z)


@part
def _sum(cloud, sums) -> None:
    """Mean position and standard deviation of a coordinate of particles (m, 4)."""
    sums[0], sums[1] = cloud[:, 0].mean(), cloud[:, 1].mean()
    square = ((cloud[:, 0] - sums[0]) ** 2 + (cloud[:, 1] - sums[1]) ** 2).mean()
    sums[2] = np.sqrt(0.5 * square)
