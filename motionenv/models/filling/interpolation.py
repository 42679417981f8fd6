"""Interpolation of a channel across a gap: Gaussian-process regression on the frames around it.

The process is a constant, which differs from gap to gap, plus one with a Matérn covariance of smoothness 5/2
(Rasmussen & Williams 2006, eq. 4.17): twice differentiable, as limbs move, and returning to the constant within about
half a second, since what is farther away tells nothing of the present movement.
"""

import numpy as np

#: Standard deviations of constant, movement and error of measurement, relative to each other, and the movement's scale.
CONSTANT, MOVEMENT, ERROR = 2.0, 1.0, 0.01
SCALE = 0.15  # [s]
#: Frames within this time [s] of a gap are used.
REACH = 1.0

_RATE = 60.0  # [Hz] at which they are used at most


def interpolated(values: np.ndarray, first: int, last: int, fps: float) -> np.ndarray:
    """Values (last - first,) of the gap of `values` (frames,) from frame `first` up to, not including, frame `last`.

    They are about 0 where nothing else is known, and 0 if nothing is known around the gap.
    """
    seen = around(first, last, len(values), fps)
    seen = seen[np.isfinite(values[seen])]
    if not seen.size:
        return np.zeros(last - first)
    covariance = _covariance(seen, seen, fps) + ERROR**2 * np.eye(len(seen))
    return _covariance(np.arange(first, last), seen, fps) @ np.linalg.solve(covariance, values[seen])


def around(first: int, last: int, frames: int, fps: float) -> np.ndarray:
    """Frames (n,) before and after a gap from `first` to `last` in a motion of `frames`, at 60 Hz at most."""
    step, reach = max(1, round(fps / _RATE)), round(REACH * fps)
    before = np.arange(first - 1, max(first - 1 - reach, -1), -step)[::-1]
    return np.concatenate([before, np.arange(last, min(last + reach, frames), step)])


def _covariance(a: np.ndarray, b: np.ndarray, fps: float) -> np.ndarray:
    """Covariance (n, m) between frames a (n,) and b (m,)."""
    r = np.sqrt(5.0) * np.abs(a[:, None] - b) / (SCALE * fps)
    return CONSTANT**2 + MOVEMENT**2 * (1 + r + r**2 / 3) * np.exp(-r)
