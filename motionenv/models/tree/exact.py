r"""The honest sampler: draws from p(i | t) ∝ exp(-|z_i - z_t|² / 2β) itself, not from the tree of signs.

Eq. 3 of paper C under its Observation 1. Points are kept in a kd-tree with boxes (`_exact_kernels` tells the layout),
and drawn by rejection from bounds that are made only where they are needed:

1. A box at squared distance D from the probe holds kernels of at most exp(-D / 2β), so its points' sum is bounded.
2. A draw throws u uniformly below the root's bound and walks down: u falls into one child's bound, or beyond them all.
3. A node on the way that wasn't opened before is opened: from now on the sum of its children's bounds (of a leaf, the
   sum of its points' kernels) is its bound. The bounds above it are summed anew, for subtraction would cancel.
4. If u falls beyond the children's bounds, the throw is rejected, and another is made below the bounds as they are now.

Whatever is open, a throw hits point i with a chance proportional to its kernel, so an accepted one is an exact draw:
the total variation is 0 but for rounding, some 1e-6. What is open only decides how many throws are rejected, and it
stays open for more draws from the same probe.

Kernels are told in units of that of a point near the probe (the nearest of the leaf that the nearest boxes lead to),
which gives 1. Where a closer point's could be above e⁶⁰ (a small β, a probe far from all points) one is searched that
is close enough, so that nothing overflows and the sum is never zero.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.models._threads import in_chunks
from motionenv.models.tree import _exact_kernels as kernels
from motionenv.models.tree import _index_kernels as building

_FARTHEST = 1e15  # squares of more overflow in single precision
_SPLIT = 1 << 17  # points from which threads pay


@dataclass(frozen=True, eq=False)
class KernelIndex:
    """Points in a kd-tree.

    Attributes:
        blocks: (⌈n / 32⌉, b, 32) float32 coordinates; position i is `blocks[i // 32, :, i % 32]`. The last block is
            filled up with +inf.
        boxes: (groups, 2, 16, width) float32, see `_exact_kernels`.
        n: number of points.
    """

    blocks: np.ndarray
    boxes: np.ndarray
    n: int

    @classmethod
    def build(cls, rows: np.ndarray, order: np.ndarray) -> "KernelIndex":
        """An index of points, made in the memory of `rows`.

        Args:
            rows: (⌈n / 32⌉ · 32, b) float32, contiguous, the first n of them points. Its memory becomes the index's
                `blocks`: don't use it after.
            order: (n,) int32, reordered as the points are: position -> what stood there before.

        Raises:
            MotionError: no point, or arrays of other shapes or kinds.
        """
        n = len(order)
        if n < 1:
            raise MotionError("an index needs at least one point, got none")
        expected = -(-n // kernels.BLOCK) * kernels.BLOCK
        if rows.dtype != np.float32 or rows.ndim != 2 or len(rows) != expected or not rows.flags.c_contiguous:
            raise MotionError(
                f"rows must be contiguous float32 ({expected}, b) for {n} points, got {rows.dtype} {rows.shape}"
            )
        unit = kernels.FAN ** kernels.first_groups(n)[0]
        if n <= _SPLIT:
            building.arrange(rows, order, 0, n, unit)
        else:
            _arrange_in_threads(rows, order, n, unit)
        building.to_blocks(rows, n)
        blocks = rows.reshape(-1, rows.shape[1], kernels.BLOCK)
        return cls(blocks, building.make_boxes(blocks, n, -(-rows.shape[1] // 8) * 8), n)

    def coefficients(self, positions) -> np.ndarray:
        """Coordinates (..., b) float32 of the points at `positions` (...)."""
        positions = np.asarray(positions)
        return self.blocks[positions // kernels.BLOCK, :, positions % kernels.BLOCK]

    def draw(self, probes, count: int, beta: float, key: int) -> np.ndarray:
        """Positions (probes, count) int32 drawn with probabilities proportional to exp(-|z - probe|² / 2β).

        Args:
            probes: (probes, b).
            count: draws for each.
            beta: temperature β.
            key: of the random streams, from 0 to 2⁶⁴ - 1: probe i takes stream i, whatever is drawn beside it.

        Raises:
            MotionError: probes of another width or not finite, a count below 1, β not above 0.
        """
        probes, beta = self._checked(probes, beta)
        if isinstance(count, bool) or int(count) != count or count < 1:
            raise MotionError(f"count must be a whole number from 1, got {count!r}")
        out = np.empty((len(probes), int(count)), np.int32)
        stream = np.uint64(key)

        def draw(start, stop):
            kernels.draw_all(self.blocks, self.boxes, self.n, probes[start:stop], beta, stream, start, out[start:stop])

        in_chunks(draw, len(probes))
        return out

    def log_kernel(self, probes, positions, beta: float) -> np.ndarray:
        """-|z_i - probe|² / 2β (probes, count) of `positions` (probes, count).

        Raises:
            MotionError: see `draw`.
        """
        probes, beta = self._checked(probes, beta)
        away = self.coefficients(positions) - probes.astype(np.float64)[:, None]
        return -np.einsum("...b,...b->...", away, away) / (2.0 * beta)

    def log_normaliser(self, probes, beta: float, tolerance: float = 0.01) -> np.ndarray:
        """Log of Σᵢ exp(-|z_i - probe|² / 2β) (probes,): the sum is short by `tolerance` of it at most.

        Args:
            probes: (probes, b).
            beta: temperature β.
            tolerance: relative error of the sum, above 0.

        Raises:
            MotionError: see `draw`; a tolerance not above 0.
        """
        probes, beta = self._checked(probes, beta)
        if not 0.0 < tolerance < np.inf:
            raise MotionError(f"tolerance must be above 0, got {tolerance!r}")
        out = np.empty(len(probes))

        def fill(start, stop):
            kernels.log_sums(self.blocks, self.boxes, self.n, probes[start:stop], beta, tolerance, out[start:stop])

        in_chunks(fill, len(probes))
        return out

    def _checked(self, probes, beta: float) -> tuple[np.ndarray, float]:
        """`probes` as contiguous float32 and `beta` as a float."""
        b = self.blocks.shape[1]
        probes = np.ascontiguousarray(probes, dtype=np.float32)
        if probes.ndim != 2 or probes.shape[1] != b:
            raise MotionError(f"probes must have shape (probes, {b}), got {probes.shape}")
        if not (np.abs(probes) <= _FARTHEST).all():
            worst = np.argwhere(~(np.abs(probes) <= _FARTHEST))[0]
            raise MotionError(
                f"probes must be finite numbers below {_FARTHEST:g}, got {probes[tuple(worst)]} in probe {worst[0]}: "
                "leave out or fill what is missing"
            )
        if not (isinstance(beta, int | float | np.integer | np.floating) and 0.0 < beta < np.inf):
            raise MotionError(f"beta (temperature) must be a finite number above 0, got {beta!r}")
        return probes, float(beta)


def _arrange_in_threads(rows: np.ndarray, order: np.ndarray, n: int, unit: int) -> None:
    """`arrange` with the two halves in two threads."""
    middle = building.split(rows, order, 0, n, unit)
    with ThreadPoolExecutor(2) as pool:
        halves = [pool.submit(building.arrange, rows, order, a, b, unit) for a, b in ((0, middle), (middle, n))]
        for half in halves:
            half.result()
