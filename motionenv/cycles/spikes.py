"""Samples that stand out from those around them, as a lost and found marker makes them."""

import numpy as np

SPIKE = 20.0  # robust deviations by which a spike stands out
AT_ENDS = 2.0  # factor at the ends of a row, where all neighbours are on one side
NORMAL = 1.4826  # standard deviations in a median absolute deviation


def spikes(x: np.ndarray, typical: float) -> np.ndarray:
    """How far samples of `x` (rows, samples) are from the mean of two on the nearer side; 0 where they aren't spikes.

    A spike stands out 20 times as much as half of the samples do, and by `typical`; none has a gap beside it.
    """
    wide = np.pad(x, ((0, 0), (2, 2)), mode="symmetric")
    left, right = (wide[:, :-4] + wide[:, 1:-3]) / 2, (wide[:, 3:-1] + wide[:, 4:]) / 2
    left[:, 0], right[:, -1] = right[:, 0], left[:, -1]
    off = np.minimum(np.abs(x - left), np.abs(x - right))
    usual = NORMAL * float(np.median(off[np.isfinite(off)])) if np.isfinite(off).any() else 0.0
    off[:, [0, -1]] /= AT_ENDS
    off[~(off > max(SPIKE * usual, typical))] = 0.0
    return off
