"""The binary tree of paper C (section 4.1) and its probabilistic search (section 4.2).

The windows of a database are sorted by their first coefficient, each half by the second, and so on to the depth b. To
draw a window for a probe z_t, one walks from the top, right with probability Φ((z_t,l - θ)/√β) at level l (eq. 7; all
coefficients are over their σ here, and θ = 0 for the paper's splits by sign), and picks one window of the leaf.

Where a node has one child, the paper takes it whatever the probe. Such nodes decide nothing and are left out (a
Patricia trie, Morrison 1968): the probability of every leaf, so the distribution, is exactly the same.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv.errors import MotionError
from motionenv.models._threads import in_chunks
from motionenv.models.tree import _descent_kernels as kernels

#: How a node is split: by the sign of the coefficient, or at its median over the windows of the node.
SPLITS = ("sign", "median")
#: How a window of a leaf is chosen: all alike, or by p(cᵢ | cₜ).
LEAVES = ("uniform", "kernel")


@dataclass(frozen=True, eq=False)
class CoefficientTree:
    """Windows, by their positions 0 ... n - 1, in the leaves of a binary tree over their coefficients.

    The coefficients themselves stay outside: every method that needs them takes the `blocks` that `build` took.

    Attributes:
        nodes: (leaves - 1,) records of the nodes that have two children, depth first: the level they look at, the
            threshold, and left and right child, a node from 0 on or leaf k as ~k.
        starts: (leaves + 1,) int32, where each leaf's members start in `members`.
        members: (n,) int32 positions, leaf after leaf, ascending within each.
        depth: number of coefficients b.
    """

    nodes: np.ndarray
    starts: np.ndarray
    members: np.ndarray
    depth: int

    def __post_init__(self):
        for name in ("nodes", "starts", "members"):
            object.__setattr__(self, name, _read_only(getattr(self, name)))

    @classmethod
    def build(cls, blocks, n: int, splits: str = "sign") -> "CoefficientTree":
        """Sort windows into a tree; takes 12 bytes a window besides what it keeps.

        Args:
            blocks: (⌈n/32⌉, b, 32) float32, coefficient l of window i over its σ at [i // 32, l, i % 32].
            n: number of windows.
            splits: "sign" (the paper's), or "median" of the node's windows, which gives a balanced tree. Windows with
                coefficients equal to the threshold go right. A split that leaves one side empty is none.

        Raises:
            MotionError: `blocks` doesn't fit `n`, or holds NaN or infinity; or unknown `splits`.
        """
        if splits not in SPLITS:
            raise MotionError(f'splits must be "sign" or "median", got {splits!r}')
        _whole("n", n, 1, 2**31)
        blocks = _checked_blocks(blocks, n)
        if not kernels.all_finite(blocks, n):
            raise MotionError(f"blocks must be finite for all {n} windows: leave out windows with NaN or infinity")
        most = min(n, 2 ** min(blocks.shape[1], 31))
        nodes, starts = np.empty(most - 1, kernels.NODE), np.empty(most + 1, np.int32)
        members = np.empty(n, np.int32)
        used = kernels.build(blocks, splits == "median", nodes, starts, members)
        return cls(nodes[:used].copy(), starts[: used + 2].copy(), members, blocks.shape[1])

    def __len__(self) -> int:
        """Number of windows n."""
        return len(self.members)

    @property
    def n_leaves(self) -> int:
        """Number of leaves that hold a window, of the 2ᵇ that there could be."""
        return len(self.starts) - 1

    @property
    def sizes(self) -> np.ndarray:
        """Number of windows (leaves,) in each leaf."""
        return np.diff(self.starts)

    @cached_property
    def largest(self) -> int:
        """Number of windows in the fullest leaf: how much scratch `_descent_kernels.draw` needs."""
        return int(self.sizes.max())

    @cached_property
    def _leaves(self) -> np.ndarray:
        """Leaf (n,) of each position."""
        leaves = np.empty(len(self), np.int32)
        leaves[self.members] = np.repeat(np.arange(self.n_leaves, dtype=np.int32), self.sizes)
        return leaves

    def leaf_of(self, positions) -> np.ndarray:
        """Numbers of the leaves of the windows at `positions` (...), from 0 on, left to right.

        Raises:
            MotionError: positions that aren't whole numbers from 0 to n - 1.
        """
        return self._leaves[self._checked_positions(positions)]

    def draw(
        self, probes, count: int, beta: float, key: int, leaf: str, blocks, *, first: int = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw windows by the paper's search.

        The normal distribution in eq. 7 is that of scipy.stats.norm to 1e-10, except that a branch further than 8√β
        from the probe is never taken. Draw j for probe k depends on the key, j, k and the probe, on nothing else.

        Args:
            probes: (B, b) coefficients over their σ.
            count: draws for each probe.
            beta: temperature, above 0.
            key: seed of the random numbers, a whole number from 0 to 2⁶⁴ - 1.
            leaf: how to choose in the leaf, "uniform" or "kernel" (by p(cᵢ | cₜ)).
            blocks: what the tree was built from.
            first: number of the first probe, for drawing a batch in parts.

        Returns:
            Positions (B, count) int32, and the logarithms (B, count) float64 of the probabilities with which this
            search draws these windows for these probes: the branches', times that of the choice in the leaf.

        Raises:
            MotionError: a value that is not as above, or NaN or infinity in the probes.
        """
        probes, beta, blocks = self._checked(probes, beta, leaf, blocks)
        _whole("count", count, 1, 2**31)
        _whole("key", key, 0, 2**64)
        _whole("first", first, 0, 2**63)
        positions = np.empty((len(probes), count), np.int32)
        log_probability = np.empty((len(probes), count))

        def work(start, stop):
            kernels.draw_all(
                self.nodes, self.starts, self.members, blocks, probes[start:stop], beta, leaf == "kernel",
                np.uint64(key), np.uint64(first + start), self.largest, positions[start:stop],
                log_probability[start:stop],
            )  # fmt: skip

        in_chunks(work, len(probes))
        return positions, log_probability

    def log_prob(self, probes, positions, beta: float, leaf: str, blocks) -> np.ndarray:
        """Logarithms (B, k) of the probabilities with which `draw` draws given windows; -inf for what it never draws.

        Args:
            probes: (B, b) coefficients over their σ.
            positions: (B, k) of the windows.
            beta: temperature, above 0.
            leaf: how `draw` chooses in the leaf, "uniform" or "kernel".
            blocks: what the tree was built from.

        Raises:
            MotionError: a value that is not as above, or NaN or infinity in the probes.
        """
        probes, beta, blocks = self._checked(probes, beta, leaf, blocks)
        positions = self._checked_positions(positions)
        if positions.ndim != 2 or len(positions) != len(probes):
            raise MotionError(f"positions must have shape ({len(probes)}, k), a row per probe, got {positions.shape}")
        out = np.empty(positions.shape)

        def work(start, stop):
            kernels.log_probability_of_all(
                self.nodes, self.starts, self.members, blocks, probes[start:stop], positions[start:stop], beta,
                leaf == "kernel", self.largest, out[start:stop],
            )  # fmt: skip

        in_chunks(work, len(probes))
        return out

    def _checked(self, probes, beta, leaf, blocks) -> tuple[np.ndarray, float, np.ndarray]:
        if leaf not in LEAVES:
            raise MotionError(f'leaf must be "uniform" or "kernel", got {leaf!r}')
        if (
            isinstance(beta, bool)
            or not isinstance(beta, int | float | np.floating)
            or not (math.isfinite(beta) and beta > 0)
        ):
            raise MotionError(f"beta must be a finite number above 0, the temperature, got {beta!r}")
        blocks = _checked_blocks(blocks, len(self))
        if blocks.shape[1] != self.depth:
            raise MotionError(f"blocks must hold the {self.depth} coefficients of the tree, got {blocks.shape[1]}")
        return self._checked_probes(probes), float(beta), blocks

    def _checked_probes(self, probes) -> np.ndarray:
        try:
            with np.errstate(over="ignore"):  # what is too large becomes infinite, and is refused below
                probes = np.ascontiguousarray(probes, dtype=np.float32)
        except (TypeError, ValueError):
            raise MotionError(f"probes must be an array of numbers (B, {self.depth}), got {probes!r}") from None
        if probes.ndim != 2 or probes.shape[1] != self.depth:
            raise MotionError(f"probes must have shape (B, {self.depth}), as deep as the tree, got {probes.shape}")
        if not np.isfinite(probes).all():
            row = int(np.flatnonzero(~np.isfinite(probes).all(1))[0])
            raise MotionError(f"probes must be finite, got {probes[row]} in row {row}: fill gaps in the history first")
        return _read_only(probes)

    def _checked_positions(self, positions) -> np.ndarray:
        positions = np.asarray(positions)
        if not np.issubdtype(positions.dtype, np.integer):
            raise MotionError(f"positions must be whole numbers, got {positions.dtype}")
        if positions.size and not 0 <= positions.min() <= positions.max() < len(self):
            raise MotionError(
                f"positions must be from 0 to {len(self) - 1}, got {positions.min()} to {positions.max()}"
            )
        return _read_only(np.ascontiguousarray(positions, dtype=np.int32))


def _checked_blocks(blocks, n: int) -> np.ndarray:
    blocks = np.asarray(blocks)
    if blocks.dtype != np.float32 or blocks.ndim != 3 or blocks.shape[::2] != (-(-n // 32), 32) or not blocks.shape[1]:
        raise MotionError(
            f"blocks must be float32 of shape ({-(-n // 32)}, b, 32) for {n} windows, got {blocks.dtype} {blocks.shape}"
        )
    return _read_only(np.ascontiguousarray(blocks))


def _read_only(array) -> np.ndarray:
    """A view that can't be written to: also, kernels are compiled for one kind of array only."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view


def _whole(name: str, value, least: int, end: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value < end:
        raise MotionError(f"{name} must be a whole number from {least} to {end - 1}, got {value!r}")
