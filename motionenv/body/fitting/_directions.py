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
Where going straight on and turning around lead to different directions, both are tried, and the cheaper one is taken.
"""

import math

import numpy as np
from scipy.linalg import solveh_banded

#: Weight of frames that are taken exactly.
_EXACT = 1e9
#: Weight of the neutral direction.
_FAINT = 1e-6
_ROUNDS = 8


def steady_directions(vectors, time, neutral, *, known: float, stiffness: float, reversible: bool) -> np.ndarray:
    """Continuous directions θ (frames,) [rad] of vectors.

    Args:
        vectors: (frames,) complex numbers of length 0 (direction unknown) to 1, in axes that don't themselves turn.
        time: (frames,) increasing [s].
        neutral: (frames,) complex numbers, the direction to take where no frame says anything.
        known: length from which on a direction is taken exactly.
        stiffness: cost of speed [s]: a direction of length r is averaged over about √stiffness / r seconds.
        reversible: whether long vectors, too, may point against θ, after v has passed through 0.
    """
    if not len(vectors):
        return np.empty(0)
    length, along = np.abs(vectors), np.angle(vectors)
    exact = length >= known
    coupling = stiffness / np.diff(time)
    short = length / known
    weight = np.where(exact, _EXACT, length**2 / np.maximum(1.0 - short**4, 1e-9))
    theta = along
    if not exact.all():
        mean = _solved(weight + _FAINT, coupling, weight * np.exp(1j * along) + _FAINT * neutral)
        theta = np.where(exact, along, np.angle(mean))
    theta = np.unwrap(theta)
    ends = _passages(exact)
    excess = _excess(theta, length, ends, math.pi if reversible else 2 * math.pi)
    around = theta if exact.all() else _relaxed(along, theta, weight, coupling)
    if not excess.any():
        return around
    straight = _relaxed(along, _straightened(theta, ends, excess), weight, coupling)
    cheaper = _spent(length, along, straight, coupling, ends) < _spent(length, along, around, coupling, ends)
    return _joined(around, straight, ends, np.where(cheaper, excess, 0.0))


def _passages(exact: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last frames of all passages, each from one well-known frame to the next."""
    at = np.flatnonzero(exact)
    return at[:-1], at[1:]


def _excess(theta, length, ends, turn: float) -> np.ndarray:
    """By how much (passages,) [rad] each passage of θ turns further than the nearest whole `turn` would.

    A passage straight on comes within reach of length 0. Between two vectors that are too long for that, turning is
    the shorter way.
    """
    first, last = ends
    moved = theta[last] - theta[first]
    excess = turn * np.round(moved / turn)
    start, end = (np.arcsin(np.minimum(length[at], 1.0)) for at in ends)
    through = np.abs(moved - excess) + start + end
    aside = np.abs(moved) + np.abs(start - end)
    return np.where((turn < 6.0) & (through > aside), 0.0, excess)


def _straightened(theta, ends, excess) -> np.ndarray:
    """θ whose passages with an excess run straight to where they end without it."""
    out = theta.copy()
    shift = np.zeros(len(theta))
    shift[ends[1]] = excess
    out -= np.cumsum(shift)
    for first, last in zip(ends[0][excess != 0], ends[1][excess != 0], strict=True):
        out[first : last + 1] = np.linspace(out[first], out[last], last - first + 1)
    return out


def _joined(around, straight, ends, excess) -> np.ndarray:
    """The path `around` with the passages of `straight` wherever that has an excess taken away."""
    shift = np.zeros(len(around))
    shift[ends[1]] = excess
    out = around - np.cumsum(shift)
    for first, last in zip(ends[0][excess != 0], ends[1][excess != 0], strict=True):
        out[first : last + 1] = straight[first : last + 1] + (out[first] - straight[first])
    return out


def _relaxed(along, theta, weight, coupling) -> np.ndarray:
    """θ (frames,) moved to the next minimum of the cost, by majorisation: no round increases it."""
    for _ in range(_ROUNDS):
        theta = _solved(weight + _FAINT, coupling, (weight + _FAINT) * theta + 0.5 * weight * np.sin(2 * (along - theta)))
    return theta


def _spent(length, along, theta, coupling, ends) -> np.ndarray:
    """Cost (passages,) of each passage of θ."""
    cost = (length * np.sin(along - theta)) ** 2
    cost[:-1] += coupling * np.diff(theta) ** 2
    total = np.concatenate([[0.0], np.cumsum(cost)])
    return total[ends[1]] - total[ends[0]]


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
