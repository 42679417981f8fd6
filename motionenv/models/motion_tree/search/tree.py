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
from motionenv.models.motion_tree.search import tree_kernels as kernels

#: Splits of nodes: by the sign of the coefficient, or at its median over the windows of the node.
SPLITS = ("sign", "median")
#: How windows are drawn: by this tree, or from p(cᵢ | cₜ) itself.
METHODS = ("tree", "exact")
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

    def __post_init__(self) -> None:
        for name in ("nodes", "starts", "members"):
            object.__setattr__(self, name, _read_only(getattr(self, name)))

    @classmethod
    def build(cls, blocks: np.ndarray, n: int, splits: str) -> "CoefficientTree":
        """Build a tree; needs 12 bytes per window of temporary memory.

        Args:
            blocks: (⌈n/32⌉, b, 32) float32, standardised coefficient l of window i at [i // 32, l, i % 32], all finite.
            n: number of windows.
            splits: "sign" as in the paper, or "median" of the node's windows for a balanced tree. Windows with
                coefficients equal to the threshold go right. Splits with an empty side are omitted.
        """
        most = min(n, 2 ** min(blocks.shape[1], 31))
        nodes, starts = np.empty(most - 1, kernels.NODE), np.empty(most + 1, np.int32)
        members = np.empty(n, np.int32)
        used = kernels.build(_read_only(blocks), splits == "median", nodes, starts, members)
        return cls(nodes[:used].copy(), starts[: used + 2].copy(), members, blocks.shape[1])

    def __len__(self) -> int:
        """Number of windows n."""
        return len(self.members)

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
        leaves[self.members] = np.repeat(np.arange(len(self.sizes), dtype=np.int32), self.sizes)
        return leaves

    def leaf_of(self, positions: np.ndarray) -> np.ndarray:
        """Indices (...) of the leaves of the windows at `positions` (...), from left to right."""
        return self._leaves[positions]

    def draw(
        self, probes: np.ndarray, count: int, beta: float, key: int, leaf: str, blocks: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw windows by the paper's search.

        The normal distribution in eq. 7 has errors up to 1e-10, except that a branch further than 8√β from the probe is
        never taken. Draw j for probe k depends only on the key, j, k and the probe. `MotionTree.draw` checks arguments.

        Args:
            probes: (B, b) float32, standardised coefficients c / σ.
            count: draws for each probe.
            beta: temperature, above 0.
            key: seed of the random numbers, a whole number from 0 to 2⁶⁴ - 1.
            leaf: choice within the leaf, "uniform" or "kernel" (by p(cᵢ | cₜ)).
            blocks: the coefficients from which the tree was built.

        Returns:
            Positions (B, count) int32, and log-probabilities (B, count) float64 of these draws: those of the branches
            and of the choice within the leaf.
        """
        probes, blocks = _read_only(probes), _read_only(blocks)
        positions = np.empty((len(probes), count), np.int32)
        log_probability = np.empty((len(probes), count))

        def work(start, stop):
            kernels.draw_all(
                self.nodes, self.starts, self.members, blocks, probes[start:stop], beta, leaf == "kernel",
                np.uint64(key), np.uint64(start), self.largest, positions[start:stop], log_probability[start:stop],
            )  # fmt: skip

        in_chunks(work, len(probes))
        return positions, log_probability


def _read_only(array: np.ndarray) -> np.ndarray:
    """A read-only view; kernels are compiled for read-only arrays only."""
    view = array.view()
    view.flags.writeable = False
    return view
