"""Left and right labels that a detector swapped: found by continuity or geometry of motion, and put back."""

from dataclasses import replace

import numpy as np

from motionenv.types import MARKERS, Points

#: Marker pairs that a detector swaps together: the columns of labels.
GROUPS = {"arms": ("shoulder", "elbow", "wrist"), "legs": ("hip", "knee", "ankle")}
PAIRS = {name: np.array([[MARKERS.index(f"{side}_{joint}") for joint in joints] for side in ("left", "right")])
         for name, joints in GROUPS.items()}  # fmt: skip

_FRAMES = 8  # least number of frames in which a pair is seen
_SWITCH = 5.0  # log-odds against a swap from one frame to the next
_ODD = 20.0  # cap on the log-likelihood of one pair in one frame
_RAY_SWITCH, _RAY_CAP = 6.0, 12.0  # the same for rays, with a cap for each marker


def swapped_back(points: Points, labels: np.ndarray) -> Points:
    """`points` with left and right of arms and legs exchanged where `labels` (frames, 2) are True."""
    confidence = None if points.confidence is None else exchanged(points.confidence, labels)
    feet = points.feet
    if feet is not None:
        feet = np.where(labels[:, 1, None, None], feet[:, [2, 3, 0, 1]], feet)
    return replace(points, positions=exchanged(points.positions, labels), confidence=confidence, feet=feet)


def continuous_labels(points: Points) -> np.ndarray:
    """Labels (frames, 2) of `points` that minimise the jumps of left minus right; False in most frames."""
    labels = np.zeros((len(points.positions), len(GROUPS)), dtype=bool)
    for g, pair in enumerate(PAIRS.values()):
        between = points.upward[:, pair[0]] - points.upward[:, pair[1]]
        steps = np.linalg.norm([between[1:] - between[:-1], between[1:] + between[:-1]], axis=-1).min(axis=0)
        known = np.isfinite(steps).sum(axis=0) >= _FRAMES
        if known.any():
            near = between[:, known] / np.maximum(np.nanmedian(steps[:, known], axis=0), 1e-9)[:, None]
            labels[:, g] = _viterbi(np.stack([near, -near]), 1.0, 1.0)[0]
    return labels ^ (labels.mean(axis=0) > 0.5)


def _viterbi(off: np.ndarray, correlation: float, variance: float) -> tuple[np.ndarray, float]:
    """The path (frames,) of least cost through residuals (2, frames, pairs, 2) of the two labels, and its cost.

    Residuals are autoregressive of order 1 with coefficient `correlation` and innovation `variance`.
    """
    before = np.nan_to_num(off[:, None, :-1])  # after a gap, predict 0
    variances = np.where(np.isnan(off[0, :-1]).any(axis=-1), 1.0, variance)
    steps = _cost(off[None, :, 1:] - correlation * before, variances)  # (from, to, frames - 1)
    return _cheapest_path(_cost(off[:, 0], np.ones(off.shape[2])), steps, _SWITCH)


def _cheapest_path(first: np.ndarray, steps: np.ndarray, switch: float) -> tuple[np.ndarray, float]:
    """The path (frames,) of least cost through two states by the Viterbi algorithm, and its cost.

    Costs are `first` (2,) of the first frame, `steps` (from, to, frames - 1), and `switch` of each change to the other
    state, a start in state 1 included.
    """
    cost, change = first + np.array([0.0, switch]), switch * (1 - np.eye(2))
    back = np.zeros((steps.shape[2] + 1, 2), dtype=np.intp)
    for i in range(1, len(back)):
        ways = cost[:, None] + steps[:, :, i - 1] + change
        back[i], cost = ways.argmin(axis=0), ways.min(axis=0)
    path = np.empty(len(back), dtype=np.intp)
    path[-1] = cost.argmin()
    for i in range(len(back) - 1, 0, -1):
        path[i - 1] = back[i, path[i]]
    return path == 1, float(cost.min())


def _cost(off: np.ndarray, variance) -> np.ndarray:
    """Negative log-likelihood (...) of residuals (..., pairs, 2), capped for each pair, 0 where a pair isn't seen."""
    return np.minimum(np.nan_to_num((off**2).sum(axis=-1)) / (2 * variance), _ODD).sum(axis=-1)


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
    for column, (left, right) in enumerate(PAIRS.values()):
        pair, crossed = np.concatenate([left, right]), np.concatenate([right, left])
        cost = np.stack([_ray_cost(rays[:, pair] - towards[:, shown], scale) for shown in (pair, crossed)])
        steps = np.broadcast_to(cost[:, 1:], (2, 2, len(rays) - 1))
        out[:, column] = _cheapest_path(cost[:, 0], steps, _RAY_SWITCH)[0]
    return out


def exchanged(values: np.ndarray, swapped: np.ndarray) -> np.ndarray:
    """`values` (frames, 15, ...) with left and right exchanged where `swapped` (frames, 2) says so."""
    out = values.copy()
    for (left, right), where in zip(PAIRS.values(), swapped.T, strict=True):
        rows = np.flatnonzero(where)[:, None]
        out[rows, left], out[rows, right] = values[rows, right], values[rows, left]
    return out


def _ray_cost(off: np.ndarray, scale: float) -> np.ndarray:
    """Negative log-likelihood (frames,) of directions' errors (frames, markers, 3), capped, 0 where not seen."""
    square = (off**2).sum(axis=-1) / (2 * scale**2)
    return np.minimum(np.nan_to_num(square, nan=0.0), _RAY_CAP).sum(axis=1)
