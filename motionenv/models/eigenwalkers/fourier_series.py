r"""Periodic walking as a short Fourier series: paper B, section 3.1 (Zhang & Troje 2007).

    p(t) = p0 + p1 sin(ωt) + q1 cos(ωt) + p2 sin(2ωt) + q2 cos(2ωt)        (3.1)
    w = (p0, p1, q1, p2, q2), 5 × 45 numbers                               (3.2)

ω is the frequency of strides, not of steps. The paper leaves the normalisation that makes walkers comparable open; here

- Position: the walker walks along x in place, as on a treadmill. The mean of the pelvis is at x = y = 0, and the lowest
  point of the ankles is an ankle's height above the ground z = 0. Sizes aren't normalised.
- Phase: at phase 0 the fundamental of the left ankle's lead over the right one is greatest. The left foot is furthest
  ahead, about at heel strike.
- Frequency: stored beside w, not in it.

Two harmonics bend the knee by several degrees at contact and put the foot down late. Walks that are made therefore have
`HIGHER` harmonics beyond w: those of the average walker, in proportion to the length of strides. They aren't part of w.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.body.skeleton import ANKLE_HEIGHT, LEG_SHARE, NECK_ABOVE, TRUNK_SHARE
from motionenv.errors import GapError, MotionError
from motionenv.types import MARKERS, frozen

#: The rows of w.
PARTS = ("p0", "p1", "q1", "p2", "q2")
#: The harmonics beyond them of walks that are made.
HIGHER = (3, 4, 5, 6, 7, 8)
#: Markers without which a walker can't walk: of the pelvis and the legs.
WALKING = ("pelvis", *MARKERS[MARKERS.index("left_hip") :])
LEFT_ANKLE, RIGHT_ANKLE, PELVIS = (MARKERS.index(n) for n in ("left_ankle", "right_ankle", "pelvis"))

_SIDES = {"left": "right", "right": "left"}
#: Index of each marker's left-right counterpart; markers on the midline are their own.
OTHER_SIDE = tuple(MARKERS.index("_".join(_SIDES.get(part, part) for part in m.split("_"))) for m in MARKERS)

_LEGS = [[MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")]
_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]
_PHASES = np.arange(48) * (2 * np.pi / 48)
_TWELVE = _PHASES[::4]
_ROLL = 1.086  # feet roll over their balls: mean ratio of the stride lengths of two harmonics to the ankle's, ± 1 %


@dataclass(frozen=True, eq=False, repr=False)
class FourierWalker(OneLine):
    """One walk as a Fourier series, normalised as described in the module.

    Attributes:
        coefficients: (5, 15, 3) [m], the parts p0, p1, q1, p2, q2 of the 15 markers; NaN for unseen markers.
        frequency: strides per second, ω / 2π [Hz].
        speed: mean forward speed [m/s] of the captured pelvis; about 0 on a treadmill.
        shares: (2,) shares of the variance about the mean posture in the fundamental and the second harmonic; the rest
            is the residual of eq. 3.1.
        strides: number of strides seen.
        name: origin of the walk, for people.
        heading: direction of walking in the capture's world, from x towards y [rad].
        higher: (12, 15, 3) [m], sine and cosine of each of the `HIGHER` harmonics; None or NaN if unknown.
    """

    coefficients: np.ndarray
    frequency: float
    speed: float = np.nan
    shares: np.ndarray = (np.nan, np.nan)  # type: ignore[assignment]
    strides: float = np.nan
    name: str = ""
    heading: float = np.nan
    higher: np.ndarray | None = None

    def __post_init__(self) -> None:
        coefficients = frozen(self.coefficients, (len(PARTS), len(MARKERS), 3), "FourierWalker.coefficients")
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "shares", frozen(self.shares, (2,), "FourierWalker.shares"))
        if self.higher is not None:
            shape = 2 * len(HIGHER), len(MARKERS), 3
            object.__setattr__(self, "higher", frozen(self.higher, shape, "FourierWalker.higher"))
        if np.isinf(coefficients).any() or not 0 < self.frequency < np.inf:
            raise MotionError(
                f"FourierWalker needs coefficients without infinity, frequency above 0: got {self.frequency!r}"
            )


def columns(phase: ArrayLike, derivative: int = 0, harmonics: int = 2) -> np.ndarray:
    """The five functions of eq. 3.1 at phases ωt (...) [rad], (..., 5): 1, sin, cos, sin 2, cos 2, or a derivative.

    With more `harmonics`, their sine and cosine follow.
    """
    phase = np.asarray(phase, dtype=np.float64)
    turn = derivative * np.pi / 2
    waves = [h**derivative * f(h * phase + turn) for h in range(1, harmonics + 1) for f in (np.sin, np.cos)]
    return np.stack([np.full_like(phase, 0.0 if derivative else 1.0), *waves], axis=-1)


def positions_at(coefficients: np.ndarray, phase: ArrayLike, derivative: int = 0) -> np.ndarray:
    """Marker positions in place (..., frames, 15, 3) [m] (eq. 3.1), or a derivative of them by phase.

    Coefficients are (..., 5, 15, 3) [m], or more if there are more harmonics, phases ωt (frames,) [rad].
    """
    waves = columns(phase, derivative, coefficients.shape[-3] // 2)
    return np.einsum("th,...hmc->...tmc", waves, coefficients)


def later(coefficients: ArrayLike, phase: ArrayLike) -> np.ndarray:
    """Coefficients (..., 5, 15, 3), or more, of the same motion with `phase` (...) [rad] as its new zero."""
    w = np.asarray(coefficients, dtype=np.float64)
    moved = w.copy()
    for h in range(1, w.shape[-3] // 2 + 1):
        s, c = (f(h * np.asarray(phase, dtype=np.float64))[..., None, None] for f in (np.sin, np.cos))
        p, q = w[..., 2 * h - 1, :, :], w[..., 2 * h, :, :]
        moved[..., 2 * h - 1, :, :], moved[..., 2 * h, :, :] = c * p - s * q, s * p + c * q
    return moved


def mirrored(coefficients: ArrayLike) -> np.ndarray:
    """Coefficients (..., 5, 15, 3) of the mirror image, half a stride later, so that its left foot is furthest ahead.

    Left and right markers swap, y changes sign, and half a stride changes the sign of odd harmonics, of which there may
    be more than the first.
    """
    w = np.asarray(coefficients, dtype=np.float64)[..., OTHER_SIDE, :] * [1.0, -1.0, 1.0]
    odd = (np.arange(w.shape[-3]) + 1) // 2 % 2 == 1
    return np.where(odd[:, None, None], -w, w)


def in_phase(coefficients: ArrayLike) -> np.ndarray:
    """Coefficients (..., 5, 15, 3) shifted to phase 0 where the fundamental of the left ankle's lead is greatest.

    If only one ankle is known, the other is assumed to move half a stride later.

    Raises:
        GapError: no ankle is known.
    """
    fundamental = np.asarray(coefficients)[..., 1:3, [LEFT_ANKLE, RIGHT_ANKLE], 0] * [1.0, -1.0]
    if np.isnan(fundamental).all(axis=-1).any():
        raise GapError("too few frames show either ankle to determine the phase of the walk: leave it out")
    lead = np.nansum(fundamental, axis=-1)
    return later(coefficients, np.arctan2(lead[..., 0], lead[..., 1]))


def centred(coefficients: ArrayLike) -> np.ndarray:
    """Coefficients (..., 5, 15, 3) with the pelvis' mean horizontal position at 0."""
    w = np.array(coefficients, dtype=np.float64)
    w[..., 0, :, :2] -= w[..., 0, PELVIS, None, :2]
    return w


def grounded(coefficients: ArrayLike) -> np.ndarray:
    """Coefficients (..., 5, 15, 3) shifted vertically so that the walker stands on z = 0.

    The lowest point of the ankles is placed at the height of an ankle above its sole, 0.039 of the standing height,
    which is estimated from the pelvis' height above that point (Winter 2009, fig. 4.1).
    """
    w = np.array(coefficients, dtype=np.float64)
    cycle = np.arange(180) * (2 * np.pi / 180)
    lowest = np.nanmin(positions_at(w[..., [LEFT_ANKLE, RIGHT_ANKLE], 2:], cycle), axis=(-3, -2, -1))
    ankle = ANKLE_HEIGHT / LEG_SHARE * (w[..., 0, PELVIS, 2] - lowest)
    w[..., 0, :, 2] += (ankle - lowest)[..., None]
    return w


def harmonic_power(coefficients: ArrayLike) -> np.ndarray:
    """Variance over time (..., 2) [m²] of fundamental and second harmonic, summed over the known markers."""
    w = np.asarray(coefficients, dtype=np.float64)
    power = 0.5 * np.nansum(w[..., 1:, :, :] ** 2, axis=(-2, -1))
    return power.reshape(*power.shape[:-1], 2, 2).sum(axis=-1)


def body_heights(w: np.ndarray) -> np.ndarray:
    """Body heights (n,) [m] of coefficients (n, 5, 15, 3), from lengths averaged over the cycle.

    From the legs and the trunk, or from the legs alone where the shoulders are unknown (NaN).
    """
    cycle = positions_at(w, _TWELVE)
    length = lambda a, b: np.linalg.norm(a - b, axis=-1).mean(axis=1)
    legs = sum(
        length(cycle[..., a, :], cycle[..., b, :])
        for hip, knee, ankle in _LEGS
        for a, b in ((hip, knee), (knee, ankle))
    )
    trunk = NECK_ABOVE * length(cycle[..., _SHOULDERS, :].mean(axis=-2), cycle[..., PELVIS, :])
    return np.where(np.isnan(trunk), 0.5 * legs / LEG_SHARE, (0.5 * legs + trunk) / (LEG_SHARE + TRUNK_SHARE))


def stride_lengths(w: np.ndarray) -> np.ndarray:
    """Stride lengths (...) [m] of w (..., 5, 15, 3): what the foot whose ankle moves back fastest goes in a cycle."""
    ankles = positions_at(w[..., [LEFT_ANKLE, RIGHT_ANKLE], :1], _PHASES, derivative=1)[..., 0]
    return _ROLL * 2 * np.pi * -ankles.min(axis=-1).mean(axis=-1)
