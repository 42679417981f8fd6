"""Compiled: feet that stand still on the ground, one frame after the other, with nothing of the future.

A foot is locked where its ball is when it begins to stand. What the motion says it slips is taken out twice: the root
follows slowly, so that a walk covers the ground that its steps do, and the leg reaches for the rest (damped least
squares over hip flexion, hip abduction and knee flexion; Buss 2004). A foot that is let go glides back to its motion.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.compilation import kernel
from motionenv.body.kinematics import feet_of

#: What `keep_footing` remembers: ground (3,) of the clip as in `outlook.FutureCost`; per foot whether it is locked
#: (2,), where its ball then is (2, 2) [m], and by how much its ball is moved (2, 2) [m].
Footing = namedtuple("Footing", ["ground", "locked", "place", "shift"])

_ADAPT = 0.1  # share of the way to another clip's ground that is gone in a frame
_FOLLOW = 0.15  # share of the slip by which the root follows in a frame
_RETURN = 0.75  # share of its shift that a foot in the air keeps from frame to frame
_REACH = 0.15  # [m] a foot whose motion is this far from its place has left it
_ROLL = 0.03  # rise of the ankle over which a foot rolls from the sole onto its ball [shares of the body's height]
_DAMPING = 0.01  # [m] of the least squares: legs that are nearly straight don't whip
_STEPS, _TOLERANCE = 6, 2e-4  # of the least squares: how often at most, and how near [m]
_PROBE = 1e-4  # [rad] of the finite differences
_MOST = 0.25  # [rad] by which a joint turns in one step of the least squares
_KNEE = 2.6  # [rad] most flexed
_LEG = np.array([[17, 18, 20], [21, 22, 24]])  # hip flexion, hip abduction, knee flexion


def footing_on(ground: ArrayLike) -> Footing:
    """Over a ground (3,), no foot locked, nothing moved."""
    return Footing(np.array(ground, dtype=np.float64), np.zeros(2, dtype=np.bool_), np.zeros((2, 2)), np.zeros((2, 2)))


@kernel
def keep_footing(pose, stands, ground, footing, offsets, height):
    """Move the root and turn the legs of `pose` (1, 25) so that feet that stand, as `stands` (2,) says, stay in place.

    The root's x and y are to be carried on by the caller. `ground` (3,) is that of the clip that the pose is from.
    """
    ankles, balls, target = np.empty((1, 2, 3)), np.empty((1, 2, 3)), np.empty((2, 3))
    for i in range(3):
        footing.ground[i] += _ADAPT * (ground[i] - footing.ground[i])
    feet_of(pose, offsets, height, ankles, balls)
    _lock(balls[0], stands, footing)
    _carry_root(pose, balls[0], footing)
    pose[0, 2] += footing.ground[0]
    for side in range(2):
        for i in range(2):
            if footing.locked[side]:
                footing.shift[side, i] = footing.place[side, i] - balls[0, side, i]
            else:
                footing.shift[side, i] *= _RETURN
            target[side, i] = balls[0, side, i] + footing.shift[side, i]
        rolled = min(max((ankles[0, side, 2] - footing.ground[1]) / (_ROLL * height), 0.0), 1.0)
        target[side, 2] = ankles[0, side, 2] + footing.ground[0] + rolled * footing.ground[2]
    _reach(pose, target, offsets, height)


@kernel
def _lock(balls, stands, footing):
    """Lock feet that begin to stand, let go those that no longer do or are too far from their place."""
    for side in range(2):
        if footing.locked[side]:
            away = np.hypot(footing.place[side, 0] - balls[side, 0], footing.place[side, 1] - balls[side, 1])
            if not stands[side] or away > _REACH:
                footing.locked[side] = False
        elif stands[side]:
            footing.locked[side] = True
            for i in range(2):
                footing.place[side, i] = balls[side, i] + footing.shift[side, i]


@kernel
def _carry_root(pose, balls, footing):
    """Let the root, and `balls` (2, 3) with it, follow what the locked feet slip."""
    locked = footing.locked[0] + footing.locked[1]
    if locked == 0:
        return
    for i in range(2):
        slip = 0.0
        for side in range(2):
            if footing.locked[side]:
                slip += footing.place[side, i] - balls[side, i]
        step = _FOLLOW * slip / locked
        pose[0, i] += step
        balls[0, i] += step
        balls[1, i] += step


@kernel
def _reach(pose, target, offsets, height):
    """Turn the hips and knees of `pose` (1, 25) until the feet are at `target` (2, 3): x, y of balls, z of ankles.

    The slopes are the ankle's: how the foot tilts with it, and stops at the ground, is left to the next step.
    """
    ankles, balls = np.empty((1, 2, 3)), np.empty((1, 2, 3))
    slope, error, turn = np.empty((2, 3, 3)), np.empty((2, 3)), np.empty(3)
    straightest = min(pose[0, 20], 0.0), min(pose[0, 24], 0.0)
    for _ in range(_STEPS):
        feet_of(pose, offsets, height, ankles, balls)
        if _miss(target, ankles[0], balls[0], error) < _TOLERANCE:
            return
        _slopes(pose, ankles[0], offsets, height, slope)
        for side in range(2):
            _damped(slope[side], error[side], turn)
            for j in range(3):
                pose[0, _LEG[side, j]] += min(max(turn[j], -_MOST), _MOST)
            knee = _LEG[side, 2]
            pose[0, knee] = min(max(pose[0, knee], straightest[side]), _KNEE)


@kernel
def _miss(target, ankles, balls, error):
    """Write by how much (2, 3) the feet miss the target; the largest of that."""
    worst = 0.0
    for side in range(2):
        for i in range(3):
            error[side, i] = target[side, i] - (ankles if i == 2 else balls)[side, i]
            worst = max(worst, abs(error[side, i]))
    return worst


@kernel
def _slopes(pose, ankles, offsets, height, slope):
    """Write how the ankles move (2, 3, 3) with flexion and abduction of the hip and flexion of the knee, in turn."""
    probed, unused = np.empty((1, 2, 3)), np.empty((1, 2, 3))
    for j in range(3):
        for side in range(2):
            pose[0, _LEG[side, j]] += _PROBE
        feet_of(pose, offsets, height, probed, unused)
        for side in range(2):
            pose[0, _LEG[side, j]] -= _PROBE
            for i in range(3):
                slope[side, i, j] = (probed[0, side, i] - ankles[side, i]) / _PROBE


@kernel
def _damped(slope, error, turn):
    """Write to `turn` (3,) the least squares solution of slope · turn = error, damped: Jᵀ (J Jᵀ + λ²)⁻¹ e."""
    a = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a[i, j] = slope[i, 0] * slope[j, 0] + slope[i, 1] * slope[j, 1] + slope[i, 2] * slope[j, 2]
        a[i, i] += _DAMPING**2
    # a is symmetric and positive: its inverse by cofactors
    p = a[1, 1] * a[2, 2] - a[1, 2] ** 2
    q = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    r = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    s = a[0, 0] * a[2, 2] - a[0, 2] ** 2
    t = a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]
    u = a[0, 0] * a[1, 1] - a[0, 1] ** 2
    volume = a[0, 0] * p + a[0, 1] * q + a[0, 2] * r
    x = (p * error[0] + q * error[1] + r * error[2]) / volume
    y = (q * error[0] + s * error[1] + t * error[2]) / volume
    z = (r * error[0] + t * error[1] + u * error[2]) / volume
    for j in range(3):
        turn[j] = slope[0, j] * x + slope[1, j] * y + slope[2, j] * z
