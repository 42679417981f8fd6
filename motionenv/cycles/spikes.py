"""Samples that stand out from those around them, as a lost and found marker makes them."""

import numpy as np

SPIKE = 20.0  # robust deviations by which a spike stands out
AT_ENDS = 5.0  # factor at the ends of a row, where all neighbours are on one side
NORMAL = 1.4826  # standard deviations in a median absolute deviation


def spikes(x: np.ndarray, typical: float) -> np.ndarray:
    """How far samples of `x` (rows, samples) are from the median of the four around them; 0 where they aren't spikes.

    A spike stands out by 20 times as much as half of the samples do, and by at least `typical`. Samples with a gap
    beside them are never spikes.
    """
    wide = np.pad(x, ((0, 0), (2, 2)), mode="reflect")
    around = [wide[:, shift : shift + x.shape[1]] for shift in (0, 1, 3, 4)]
    off = np.abs(x - (np.sum(around, axis=0) - np.max(around, axis=0) - np.min(around, axis=0)) / 2)
    usual = NORMAL * float(np.median(off[np.isfinite(off)])) if np.isfinite(off).any() else 0.0
    off[:, [0, 1, -2, -1]] /= AT_ENDS
    off[~(off > max(SPIKE * usual, typical))] = 0.0
    return off
