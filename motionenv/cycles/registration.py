"""Registration of cycles: timing and shape told apart, by events.

Components of cycles that aren't registered describe both, as in paper A: where steps are fast, toe-off comes early, and
a mixture of speeds blurs every peak (Ramsay & Silverman 2005, chapter 7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from motionenv.errors import MotionError
from motionenv.types import Cycles


@dataclass(frozen=True, eq=False)
class Registered:
    """Registered cycles.

    Attributes:
        values: (K, P, m) shapes: what each cycle showed at the phases of `warps`.
        warps: (K, P) phases of the cycles [cycles], rising with common phase j / P; less that, they are the timing.
    """

    values: np.ndarray
    warps: np.ndarray

    @property
    def timing(self) -> np.ndarray:
        """(K, P) how much later than in common phase each cycle is [cycles]; also a channel to find components of."""
        return self.warps - np.arange(self.warps.shape[1]) / self.warps.shape[1]

    def of(self, cycles: Cycles) -> Cycles:
        """The `cycles` that were registered, with these values."""
        return replace(cycles, values=self.values)


def register(cycles: Cycles | ArrayLike, events: ArrayLike, targets: ArrayLike | None = None) -> Registered:
    """Bring events of cycles to common phases, by monotone cubics that join smoothly from cycle to cycle.

    Args:
        cycles: `Cycles`, or an array (K, P, m), NaN where missing.
        events: (K, L) phases of L events in each cycle, such as contact and toe-off, rising by less than a cycle.
        targets: (L,) their common phases; None takes the means.

    Raises:
        MotionError: arrays of other shapes, or events that aren't finite or don't rise.
    """
    values = np.asarray(cycles.values if isinstance(cycles, Cycles) else cycles, dtype=np.float64)
    if values.ndim != 3 or not values.size:
        raise MotionError(f"cycles must be Cycles or an array (cycles, samples, channels), got {values.shape}")
    phases = np.asarray(events, dtype=np.float64)
    if phases.ndim != 2 or len(phases) != len(values) or not phases.shape[1]:
        raise MotionError(f"events must be phases (cycles, events) of {len(values)} cycles, got {phases.shape}")
    to = phases.mean(axis=0) if targets is None else np.asarray(targets, dtype=np.float64)
    for name, rows in (("events", phases), ("targets", to[None])):
        rising = np.diff(np.c_[rows, rows[:, :1] + 1], axis=1) > 0
        if rows.shape[1] != phases.shape[1] or not (np.isfinite(rows).all() and rising.all()):
            raise MotionError(f"{name} must be finite and rise by less than a cycle, one for each event")
    turns = np.arange(-3, 4)  # enough that the ends of the interpolation don't matter
    knots = (turns[:, None] + to).ravel()
    grid = np.arange(values.shape[1]) / values.shape[1]
    warps = np.array([PchipInterpolator(knots, (turns[:, None] + row).ravel())(grid) for row in phases])
    return Registered(_at(values, warps), warps)


def _at(values: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Values (K, P, m) at `phases` (K, P), by straight lines between samples; NaN beside a gap."""
    samples, rows = values.shape[1], np.arange(len(values))[:, None]
    at = phases * samples
    before = np.floor(at).astype(int)
    share = (at - before)[..., None]
    first, second = values[rows, before % samples], values[rows, (before + 1) % samples]
    return np.where(share < 1e-12, first, (1 - share) * first + share * second)
