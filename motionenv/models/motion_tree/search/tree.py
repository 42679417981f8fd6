"""The binary tree of paper C (section 4.1) and its probabilistic search (section 4.2).

The windows of a database are split by their first coefficient, each half by the second, and so on to the depth b. To
draw a window for a probe z_t, the search descends from the root, to the right with probability Φ((z_t,l - θ)/√β) at
level l (eq. 7), and picks a window of the leaf. Coefficients are standardised, c / σ; the paper's splits by sign have
θ = 0.

At a node with a single child, the paper takes that child for every probe. Such nodes are omitted (a Patricia trie,
Morrison 1968), which leaves the probabilities of all leaves unchanged.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv._core.threads import in_chunks
from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import MotionError
from motionenv.models.motion_tree.search import tree_kernels as kernels

#: Splits of nodes: by the sign of the coefficient, or at its median over the windows of the node.
SPLITS = ("sign", "median")
#: Choice of a window within a leaf: uniform, or by p(cᵢ | cₜ).
LEAVES = ("uniform", "kernel")


@dataclass(frozen=True, eq=False)
class CoefficientTree:
    """Binary tree over the windows' coefficients, whose leaves hold the windows' positions 0 ... n - 1.

    The tree doesn't store the coefficients: methods that need them take the same `blocks` as `build`.

    Attributes:
        nodes: (leaves - 1,) records of the nodes with two children, depth first: level, threshold, and left and right
            child, which is the index of a node, or ~k for leaf k.
        starts: (leaves + 1,) int32, start of each leaf's members in `members`.
        members: (n,) int32 positions, leaf by leaf, ascending within each.
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
        """Build a tree; needs 12 bytes per window of temporary memory.

        Args:
            blocks: (⌈n/32⌉, b, 32) float32, standardised coefficient l of window i at [i // 32, l, i % 32].
            n: number of windows.
            splits: "sign" as in the paper, or "median" of the node's windows for a balanced tree. Windows with
                coefficients equal to the threshold go right. Splits with an empty side are omitted.

        Raises:
            MotionError: `blocks` doesn't match `n` or isn't finite, or unknown `splits`.
        """
        if splits not in SPLITS:
            raise MotionError(f'splits must be "sign" or "median", got {splits!r}')
        n = checked_whole(n, "n", 1, 2**31 - 1)
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
        """Number of non-empty leaves, of the 2ᵇ possible."""
        return len(self.starts) - 1

    @property
    def sizes(self) -> np.ndarray:
        """Number of windows (leaves,) in each leaf."""
        return np.diff(self.starts)

    @cached_property
    def largest(self) -> int:
        """Number of windows in the largest leaf, which is the size of the scratch memory of `tree_kernels.draw`."""
        return int(self.sizes.max())

    @cached_property
    def _leaves(self) -> np.ndarray:
        """Leaf (n,) of each position."""
        leaves = np.empty(len(self), np.int32)
        leaves[self.members] = np.repeat(np.arange(self.n_leaves, dtype=np.int32), self.sizes)
        return leaves

    def leaf_of(self, positions) -> np.ndarray:
        """Indices (...) of the leaves of the windows at `positions` (...), from left to right.

        Raises:
            MotionError: positions that aren't whole numbers from 0 to n - 1.
        """
        return self._leaves[self._checked_positions(positions)]

    def draw(
        self, probes, count: int, beta: float, key: int, leaf: str, blocks, *, first: int = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw windows by the paper's search.

        The normal distribution in eq. 7 has errors up to 1e-10, except that a branch further than 8√β from the probe is
        never taken. Draw j for probe k depends only on the key, j, k and the probe.

        Args:
            probes: (B, b) standardised coefficients c / σ.
            count: draws for each probe.
            beta: temperature, above 0.
            key: seed of the random numbers, a whole number from 0 to 2⁶⁴ - 1.
            leaf: choice within the leaf, "uniform" or "kernel" (by p(cᵢ | cₜ)).
            blocks: the coefficients from which the tree was built.
            first: index of the first probe, for drawing a batch in parts.

        Returns:
            Positions (B, count) int32, and log-probabilities (B, count) float64 of these draws: those of the branches
            and of the choice within the leaf.

        Raises:
            MotionError: an argument out of range, or probes that aren't finite.
        """
        probes, beta, blocks = self._checked(probes, beta, leaf, blocks)
        count = checked_whole(count, "count", 1, 2**31 - 1)
        key = checked_whole(key, "key", 0, 2**64 - 1)
        first = checked_whole(first, "first", 0, 2**63 - 1)
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

    def _checked(self, probes, beta, leaf, blocks) -> tuple[np.ndarray, float, np.ndarray]:
        if leaf not in LEAVES:
            raise MotionError(f'leaf must be "uniform" or "kernel", got {leaf!r}')
        beta = checked_number(beta, "beta (temperature)", above=0)
        blocks = _checked_blocks(blocks, len(self))
        if blocks.shape[1] != self.depth:
            raise MotionError(f"blocks must hold the {self.depth} coefficients of the tree, got {blocks.shape[1]}")
        return self._checked_probes(probes), beta, blocks

    def _checked_probes(self, probes) -> np.ndarray:
        try:
            with np.errstate(over="ignore"):  # numbers that overflow become infinite and are refused below
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
    """A read-only view; kernels are compiled for read-only arrays only."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view
