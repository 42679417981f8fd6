"""Left and right that a detector exchanged, found by the motion itself."""

import numpy as np

from motionenv.types import MARKERS

#: Marker pairs that a detector exchanges together: the columns of `find_swaps`.
GROUPS = {"arms": ("shoulder", "elbow", "wrist"), "legs": ("hip", "knee", "ankle")}
_PAIRS = {name: np.array([[MARKERS.index(f"{side}_{joint}") for joint in joints] for side in ("left", "right")])
          for name, joints in GROUPS.items()}  # fmt: skip
_SWITCH = 6.0  # log-odds against an exchange from one frame to the next
_CAP = 12.0  # most that one marker can say in one frame


def find_swaps(rays: np.ndarray, places: np.ndarray, noise: float) -> np.ndarray:
    """Frames (frames, 2) in which arms and legs fit better with left and right exchanged.

    Args:
        rays: (frames, 15, 3) unit vectors; NaN where a marker isn't seen.
        places: (frames, 15, 3) estimated positions from the rays' origin.
        noise: standard deviation of a ray, relative to the body's apparent size.
    """
    distance = np.linalg.norm(places, axis=-1)
    towards = places / distance[..., None]
    scale = np.maximum(noise, 0.05) / np.median(distance)
    out = np.zeros((len(rays), len(GROUPS)), dtype=bool)
    for column, (left, right) in enumerate(_PAIRS.values()):
        pair, crossed = np.concatenate([left, right]), np.concatenate([right, left])
        straight = _cost(rays[:, pair] - towards[:, pair], scale)
        mixed = _cost(rays[:, pair] - towards[:, crossed], scale)
        out[:, column] = _most_probable(np.stack([straight, mixed], axis=1))
    return out


def exchanged(values: np.ndarray, swapped: np.ndarray) -> np.ndarray:
    """Values (frames, 15, ...) with left and right exchanged where `swapped` (frames, 2) says so."""
    out = values.copy()
    for (left, right), where in zip(_PAIRS.values(), swapped.T, strict=True):
        rows = np.flatnonzero(where)[:, None]
        out[rows, left], out[rows, right] = values[rows, right], values[rows, left]
    return out


def _cost(off: np.ndarray, scale: float) -> np.ndarray:
    """Negative log-likelihood (frames,) of directions' errors (frames, markers, 3), capped, 0 where not seen."""
    square = (off**2).sum(axis=-1) / (2 * scale**2)
    return np.minimum(np.nan_to_num(square, nan=0.0), _CAP).sum(axis=1)


def _most_probable(cost: np.ndarray) -> np.ndarray:
    """The path (frames,) of least cost (frames, 2) through two states, by the Viterbi algorithm."""
    total, back = cost[0] + [0.0, _SWITCH], np.zeros((len(cost), 2), dtype=int)
    for i in range(1, len(cost)):
        ways = total[:, None] + _SWITCH * (1 - np.eye(2))
        back[i] = ways.argmin(axis=0)
        total = ways.min(axis=0) + cost[i]
    path = np.empty(len(cost), dtype=bool)
    state = int(total.argmin())
    for i in range(len(cost) - 1, -1, -1):
        path[i] = state
        state = back[i, state]
    return path
