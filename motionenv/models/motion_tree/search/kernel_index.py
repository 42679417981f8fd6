r"""Exact sampler of p(i | t) ∝ exp(-|z_i - z_t|² / 2β) (paper C, eq. 3 with Observation 1).

Points are stored in a kd-tree with bounding boxes (layout: `kernel_index_kernels`). A point at squared distance D from
the probe has the kernel exp(-D / 2β). Branch and bound finds the nearest point and all leaves whose boxes are near
enough that their kernels count; a draw then picks a leaf by the running sum of its kernels, and a point within it. Of
the sum, at most 1e-6 is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.threads import in_chunks
from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import MotionError
from motionenv.models.motion_tree.search import kernel_index_kernels as kernels

_FARTHEST = 1e15  # squares of greater numbers overflow in single precision
_TOLERANCE = 0.01  # share of a sum of kernels that may be left out
_SAMPLE = 256  # points from which the axis of a split is chosen
_CHUNK = 2**16  # points


@dataclass(frozen=True, eq=False)
class KernelIndex:
    """Points in a kd-tree.

    Attributes:
        blocks: (⌈n / 32⌉, b, 32) float32 coordinates; position i is `blocks[i // 32, :, i % 32]`. The last block is
            padded with +inf.
        boxes: (groups, 2, 16, width) float32, see `kernel_index_kernels`.
        n: number of points.
    """

    blocks: np.ndarray
    boxes: np.ndarray
    n: int

    @classmethod
    def build(cls, rows: np.ndarray, order: np.ndarray) -> KernelIndex:
        """Build an index of points in the memory of `rows`.

        Args:
            rows: (⌈n / 32⌉ · 32, b) float32, contiguous; the first n are the points. Its memory becomes the index's
                `blocks`, so don't use it afterwards.
            order: (n,) int32, one at least, permuted in place like the points.
        """
        n, b = len(order), rows.shape[1]
        points, places = rows[:n], np.arange(n)
        _arrange(points, places, kernels.FAN ** kernels.first_groups(n)[0])
        for column in points.T:  # one by one, as a copy of all may not fit in memory
            column[:] = column[places]
        order[:] = order[places]
        boxes = _boxes(points)
        rows[n:] = np.inf
        for i in range(0, len(rows), _CHUNK):
            part = rows[i : i + _CHUNK]
            part[:] = part.reshape(-1, kernels.BLOCK, b).swapaxes(1, 2).reshape(part.shape)
        return cls(rows.reshape(-1, b, kernels.BLOCK), boxes, n)

    def coefficients(self, positions: ArrayLike) -> np.ndarray:
        """Coordinates (..., b) float32 of the points at `positions` (...)."""
        positions = np.asarray(positions)
        return self.blocks[positions // kernels.BLOCK, :, positions % kernels.BLOCK]

    def draw(self, probes: np.ndarray, count: int, beta: float, key: int) -> np.ndarray:
        """Positions (probes, count) int32 drawn with probabilities proportional to exp(-|z - probe|² / 2β).

        Args:
            probes: (probes, b).
            count: draws for each probe.
            beta: temperature β.
            key: key of the random streams, from 0 to 2⁶⁴ - 1; probe i uses stream i.

        Raises:
            MotionError: probes of another width or not finite, a count below 1, or β not above 0.
        """
        probes, beta = self.checked(probes, beta)
        out = np.empty((len(probes), checked_whole(count, "count", 1)), np.int32)
        stream = np.uint64(key)

        def draw(start, stop):
            kernels.draw_all(self.blocks, self.boxes, self.n, probes[start:stop], beta, stream, start, out[start:stop])

        in_chunks(draw, len(probes))
        return out

    def log_kernel(self, probes: np.ndarray, positions: np.ndarray, beta: float) -> np.ndarray:
        """-|z_i - z|² / 2β (probes, count) of `probes` and the points at `positions` (probes, count); β is `beta`.

        Raises:
            MotionError: see `draw`.
        """
        probes, beta = self.checked(probes, beta)
        away = self.coefficients(positions) - probes.astype(np.float64)[:, None]
        return -np.einsum("...b,...b->...", away, away) / (2.0 * beta)

    def log_normaliser(self, probes: ArrayLike, beta: float) -> np.ndarray:
        """Log of Σᵢ exp(-|z_i - probe|² / 2β) (probes,), underestimated by at most 0.01.

        Takes `probes` and `beta` as `draw` does, and raises its errors.
        """
        probes, beta = self.checked(probes, beta)
        out = np.empty(len(probes))

        def fill(start, stop):
            kernels.log_sums(self.blocks, self.boxes, self.n, probes[start:stop], beta, _TOLERANCE, out[start:stop])

        in_chunks(fill, len(probes))
        return out

    def checked(self, probes: ArrayLike, beta: float) -> tuple[np.ndarray, float]:
        """`probes` as contiguous float32 and `beta` as a float; a MotionError as of `draw`."""
        b = self.blocks.shape[1]
        probes = np.ascontiguousarray(probes, dtype=np.float32)
        if probes.ndim != 2 or probes.shape[1] != b:
            raise MotionError(f"probes must have shape (probes, {b}), got {probes.shape}")
        if not (np.abs(probes) <= _FARTHEST).all():
            worst = np.argwhere(~(np.abs(probes) <= _FARTHEST))[0]
            raise MotionError(
                f"probes must be finite numbers below {_FARTHEST:g}, got {probes[tuple(worst)]} in probe {worst[0]}: "
                "leave out or fill missing values"
            )
        return probes, checked_number(beta, "beta (temperature)", above=0)


def _arrange(points: np.ndarray, order: np.ndarray, unit: int) -> None:
    """Sort `order` (m,), indices of `points` (n, b), into the tree's order, in place.

    Splits a range of several units (16ᵐ points) between units, so that only its last group is not full, and by the
    coordinate of largest mean absolute deviation, which is robust to outliers.
    """
    while len(order) > kernels.FAN:
        while unit >= len(order):
            unit //= kernels.FAN
        middle = (-(-len(order) // unit) + 1) // 2 * unit
        some = points[order[:: max(1, len(order) // _SAMPLE)]]
        widest = np.abs(some - some.mean(axis=0)).mean(axis=0).argmax()
        order[:] = order[np.argsort(points[order, widest], kind="stable")]
        _arrange(points, order[:middle], unit)
        order = order[middle:]


def _boxes(points: np.ndarray) -> np.ndarray:
    """The boxes (groups, 2, 16, width) of `points` (n, b) in the tree's order."""
    b, fan, low, high = points.shape[1], kernels.FAN, points, points
    levels: list[np.ndarray] = []
    while not levels or len(levels[-1]) > 1:
        starts = np.arange(0, len(low), fan)
        low, high = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        groups = -(-len(low) // fan)
        children = np.full((2, groups * fan, b), np.inf, np.float32)
        children[:, : len(low)] = low, high
        levels.append(np.zeros((groups, 2, fan, -(-b // 8) * 8), np.float32))
        levels[-1][..., :b] = children.reshape(2, groups, fan, b).swapaxes(0, 1)
    return np.concatenate(levels[::-1])
