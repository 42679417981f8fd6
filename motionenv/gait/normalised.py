"""Curves over the gait cycle: joint angles of each stride in percent from initial contact to initial contact."""

from collections.abc import Sequence

import numpy as np

from motionenv.gait.strides import Stride

#: Samples of a normalised curve: 0 to 100 % of the cycle.
SAMPLES = 101


def normalised(values: np.ndarray, fps: float, strides: Sequence[Stride]) -> np.ndarray:
    """Cut curves `values` (frames, n), NaN in gaps, into `strides` and resample each at 0, 1, ..., 100 % of its cycle.

    At the frame rate `fps` [Hz]. The result (strides, 101, n) is linearly interpolated; NaN beside unknown frames.
    """
    values = np.asarray(values, dtype=np.float64)
    share = np.linspace(0.0, 1.0, SAMPLES)
    out = np.full((len(strides), SAMPLES, values.shape[1]), np.nan)
    for cut, stride in zip(out, strides, strict=True):
        frames = (stride.start + share * stride.seconds) * fps
        inside = (frames >= 0) & (frames <= len(values) - 1)
        before = np.minimum(frames[inside].astype(int), max(len(values) - 2, 0))
        weight = (frames[inside] - before)[:, None]
        after = np.minimum(before + 1, len(values) - 1)
        cut[inside] = np.where(weight > 0, (1 - weight) * values[before] + weight * values[after], values[before])
    return out


def mean_and_sd(curves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of `curves` (n, ...) at each sample; NaN where fewer than one or two are known."""
    known = np.isfinite(curves)
    count = known.sum(0)
    mean = np.where(known, curves, 0.0).sum(0) / np.where(count > 0, count, np.nan)
    squares = np.where(known, (curves - mean) ** 2, 0.0).sum(0)
    return mean, np.sqrt(squares / np.where(count > 1, count - 1, np.nan))
