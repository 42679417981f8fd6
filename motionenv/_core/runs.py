"""Runs of True in arrays of flags."""

import numpy as np


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First index and one past the last of each run of True in `flags` (frames,)."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
