r"""Exact sampler of p(i | t) ∝ exp(-|z_i - z_t|² / 2β) (paper C, eq. 3 with Observation 1).

Points are stored in a kd-tree with bounding boxes (layout: `kernel_index_kernels`). Rejection sampling draws from
bounds that are computed lazily:

1. In a box at squared distance D from the probe, each kernel is at most exp(-D / 2β), which bounds their sum.
2. A draw takes u uniformly below the root's bound and descends: u falls into one child's bound, or beyond all of them.
3. A node on the path that is visited for the first time is opened: its bound becomes the sum of its children's bounds
   or, for a leaf, the sum of its points' kernels. The bounds above are summed again; subtraction would cancel.
4. If u falls beyond the children's bounds, the draw is rejected and repeated with the tightened bounds.

Whichever nodes are open, point i is hit with a probability proportional to its kernel, so accepted draws are exact: the
total variation distance is that of rounding, about 1e-6. Open nodes only reduce rejections, and stay open for more
draws from the same probe.

Kernels are scaled so that a point near the probe (the nearest of the leaf that the nearest boxes lead to) has kernel 1.
If a closer point's kernel could exceed e⁶⁰ (small β, or a probe far from all points), a search finds a closer
reference point. So nothing overflows, and the sum is never zero.
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
        n = len(order)
        unit = kernels.FAN ** kernels.first_groups(n)[0]
        kernels.arrange(rows, order, 0, n, unit)
        kernels.to_blocks(rows, n)
        blocks = rows.reshape(-1, rows.shape[1], kernels.BLOCK)
        return cls(blocks, kernels.make_boxes(blocks, n, -(-rows.shape[1] // 8) * 8), n)

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
