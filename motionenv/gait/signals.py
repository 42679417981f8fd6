"""Filtering and interpolation of captured paths."""

import numpy as np
from scipy.signal import butter, filtfilt

_ORDER = 2  # of the Butterworth filter, applied forwards and backwards


def bridged(path: np.ndarray) -> np.ndarray:
    """`path` (frames, n) with gaps filled linearly, and the ends held; NaN if nothing is known."""
    known = np.isfinite(path).all(-1)
    if not known.any():
        return path
    frames = np.arange(len(path))
    return np.stack([np.interp(frames, frames[known], column[known]) for column in path.T], -1)


def smoothed(path: np.ndarray, fps: float, cutoff: float) -> np.ndarray:
    """`path` (frames, n) with gaps bridged, low-pass filtered without delay.

    At the frequency `cutoff` [Hz] the amplitude is halved; above 0.45 of the frame rate `fps` [Hz] nothing is filtered.
    """
    path = bridged(path)
    if cutoff >= 0.45 * fps or len(path) < 10:
        return path
    b, a = butter(_ORDER, cutoff / (fps / 2))
    # Straight paths pass unchanged, and two periods of the cut-off at either end let the filter settle.
    trend = np.linspace(path[0], path[-1], len(path))
    return trend + filtfilt(b, a, path - trend, axis=0, padlen=min(round(2 * fps / cutoff), len(path) - 1))
