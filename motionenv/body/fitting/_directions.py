"""Directions in a plane over time, from vectors whose length tells how well they are known.

Two angles of a limb are of this kind. The plane of flexion is undefined when the limb's upper part points sideways
(gimbal lock): its vector has the length cos(abduction). The rotation about the limb's own axis is undefined when the
limb is straight: its vector has the length sin(flexion of the hinge). Where such a vector v is long, its direction is
taken exactly. Where it is short, the direction θ(t) minimises

    Σ w(|v|) sin²(arg v - θ) + Σ stiffness · (Δθ)² / Δt

between the well-known frames on both sides. For short v the weight w is |v|², so that the first term is the squared
error of the limb's direction; it grows without bound towards the well-known length, so that nothing changes abruptly
there. Only the line along θ counts: when v passes through 0, θ goes straight on, and the coordinate along the line
changes sign (abduction beyond 90°, a hinge that is overstretched), instead of turning by 180° between two frames.
Where going straight on and turning around lead to different directions, both are tried, and the cheapest sequence of
such choices is taken.
"""

import math

import numpy as np
from scipy.linalg import solveh_banded

#: Weight of frames that are taken exactly.
_EXACT = 1e9
#: Weight of the neutral direction.
_FAINT = 1e-6
#: Departure from the straight path [rad] from which on that is tried, too.
_ASTRAY = 0.8
_ROUNDS = 8


def steady_directions(
    vectors: np.ndarray, time: np.ndarray, neutral: np.ndarray, *, known: float, stiffness: float,
    reverse: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """Continuous directions θ (frames,) [rad] of vectors.

    Args:
        vectors: (frames,) complex numbers of length 0 (direction unknown) to 1, in axes that don't themselves turn.
        time: (frames,) increasing [s].
        neutral: (frames,) complex numbers, the direction to take where no frame says anything.
        known: length from which on a direction is taken exactly.
        stiffness: cost of turning [s]: a direction of length r is averaged over about √(stiffness · Δt) / r seconds, as
            suits noise that is new in every frame, and an angle that wanders.
        reverse: (frames,) cost of a vector that points against θ after v has passed through 0. None: long vectors never
            do.
    """
    if not len(vectors):
        return np.empty(0)
    length, along = np.abs(vectors), np.angle(vectors)
    exact = length >= known
    coupling = stiffness / np.diff(time)
    short = length / known
    weight = np.where(exact, _EXACT, length**2 / np.maximum(1.0 - short**4, 1e-9))
    around, at = along, np.flatnonzero(exact)
    if not exact.all():
        mean = _solved(weight + _FAINT, coupling, weight * np.exp(1j * along) + _FAINT * neutral)
        around = np.where(exact, along, np.angle(mean))
    around = np.unwrap(around)
    excess = _excess(around[at], length[at], reversible=reverse is not None)
    if exact.all() and not excess.any():
        return around
    straight = _straightened(vectors, around, at, excess)
    astray = np.abs(around - _stepped(excess, at, len(along)) - straight)
    tried = (excess != 0) | (_most(astray, at) > _ASTRAY)
    around = _relaxed(along, around, weight, coupling)
    if not tried.any():
        return around
    straight = _relaxed(along, straight, weight, coupling)
    dearer = _spent(length, along, straight, coupling, at) - _spent(length, along, around, coupling, at)
    chosen = _chosen(excess, np.where(tried, dearer, math.inf), at, reverse, len(along))
    return _joined(around, straight, at, np.where(chosen, excess, 0.0), chosen)


# Well-known frames `at` (n,) divide time into n + 1 passages: before the first of them, between them, after the last. A
# well-known frame belongs to the passage that it ends.


def _passage(at, frames: int) -> np.ndarray:
    """Number (frames,) of each frame's passage."""
    return np.searchsorted(at, np.arange(frames))


def _most(values, at) -> np.ndarray:
    """Greatest of values (frames,) in each passage (n + 1,)."""
    most = np.zeros(len(at) + 1)
    np.maximum.at(most, _passage(at, len(values)), values)
    return most


def _excess(theta, length, *, reversible: bool) -> np.ndarray:
    """Excess angle (n + 1,) [rad] of each passage over the shortest way, from θ and lengths (n,) at its ends.

    It may end whole turns from there, and if `reversible`, half turns. But a passage straight on comes within reach of
    length 0: between two vectors that are too long for that, turning is the shorter way.
    """
    turn = math.pi if reversible else 2 * math.pi
    moved = np.diff(theta)
    excess = turn * np.round(moved / turn)
    reach = np.arcsin(np.minimum(length, 1.0))
    through = np.abs(moved - excess) + reach[1:] + reach[:-1]
    aside = np.abs(moved) + np.abs(np.diff(reach))
    out = np.zeros(len(theta) + 1)
    out[1:-1] = np.where(reversible & (through > aside), 0.0, excess)
    return out


def _stepped(excess, at, frames: int) -> np.ndarray:
    """The sum (frames,) of the excesses of all passages that have ended."""
    steps = np.zeros(frames)
    steps[at] = excess[: len(at)]
    return np.cumsum(steps)


def _straightened(vectors, theta, at, excess) -> np.ndarray:
    """θ (frames,) that runs straight from each well-known frame to the next, and ends there without the excess."""
    if not len(at):  # the line to which all vectors are closest
        return np.full(len(theta), 0.5 * np.angle((vectors**2).sum()))
    return np.interp(np.arange(len(theta)), at, (theta - _stepped(excess, at, len(theta)))[at])


def _chosen(excess, dearer, at, reverse, frames: int) -> np.ndarray:
    """Whether to go straight (n + 1,): the cheapest sequence of choices, by dynamic programming.

    Each passage that is an odd number of half turns shorter if it goes straight reverses all vectors beyond it. The
    first ones may be reversed, too: then all directions are half a turn off, which is for the caller to see.
    """
    chosen = dearer < 0
    odd = np.round(excess / math.pi).astype(int) % 2
    open_ = np.flatnonzero(odd)
    if reverse is None or not len(open_):
        return chosen
    total = np.concatenate([[0.0], np.cumsum(reverse)])
    staying = total[np.append(at[open_[1:] - 1], frames)] - total[at[open_]]
    cost, decisions = [0.0, total[at[open_[0] - 1]]], []  # of not being reversed, and of being
    for passage, stay in zip(open_, staying, strict=True):
        through = [cost[1] + dearer[passage], cost[0] + dearer[passage]]
        decisions.append([through[0] < cost[0], through[1] < cost[1]])
        cost = [min(cost[0], through[0]), min(cost[1], through[1]) + stay]
    state = int(cost[1] < cost[0])
    for passage, decision in zip(open_[::-1], decisions[::-1], strict=True):
        chosen[passage] = decision[state]
        state ^= int(decision[state])
    return chosen


def _joined(around, straight, at, excess, chosen) -> np.ndarray:
    """The path `around` with the `chosen` passages (n + 1,) of `straight`, and without their `excess`."""
    if not len(at):
        return straight if chosen[0] else around
    out = around - _stepped(excess, at, len(around))
    passage = _passage(at, len(around))
    start = at[np.maximum(passage - 1, 0)]
    soft = chosen[passage]
    soft[at] = False
    return np.where(soft, straight - straight[start] + out[start], out)


def _relaxed(along, theta, weight, coupling) -> np.ndarray:
    """θ (frames,) moved to the next minimum of the cost, by majorisation: no round increases it."""
    held = weight + _FAINT
    for _ in range(_ROUNDS):
        theta = _solved(held, coupling, held * theta + 0.5 * weight * np.sin(2 * (along - theta)))
    return theta


def _spent(length, along, theta, coupling, at) -> np.ndarray:
    """Cost (n + 1,) of each passage of θ (frames,)."""
    passage = _passage(at, len(theta))
    cost = (length * np.sin(along - theta)) ** 2
    cost[1:] += coupling * np.diff(theta) ** 2
    return np.bincount(passage, weights=cost, minlength=len(at) + 1)


def _solved(weight, coupling, pull) -> np.ndarray:
    """Solution x of (diag(weight) + L) x = pull with the Laplacian L of a chain of springs `coupling`."""
    if len(weight) == 1:  # LAPACK wants two
        return pull / weight
    bands = np.zeros((2, len(weight)))
    bands[0, 1:] = -coupling
    bands[1] = weight
    bands[1, :-1] += coupling
    bands[1, 1:] += coupling
    return solveh_banded(bands, pull, check_finite=False)
