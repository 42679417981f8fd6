"""Probabilities with which the tree of paper C draws each window: what its draws are checked against."""

import math

import numpy as np
from numba import njit

from motionenv.models.motion_tree.search.tree import CoefficientTree
from motionenv.models.motion_tree.search.tree_kernels import tail, weigh


def log_prob(tree: CoefficientTree, probes, positions, beta: float, leaf: str, blocks) -> np.ndarray:
    """Log-probabilities (B, k) with which `tree` draws the windows at `positions` (B, k); -inf if it never does."""
    probes, positions = np.asarray(probes, dtype=np.float32), np.asarray(positions, dtype=np.int32)
    out = np.empty(positions.shape)
    log_probability_of_all(
        tree.nodes, tree.starts, tree.members, blocks, probes, positions, beta, leaf == "kernel", tree.largest, out
    )
    return out


@njit
def path_of(nodes, blocks, position, probe, sharpness):
    """The leaf of the window at `position`, and the log-probability that the search reaches it."""
    place, log_probability = 0 if len(nodes) else -1, 0.0
    while place >= 0:
        node = nodes[place]
        x = (np.float64(probe[node.level]) - node.threshold) * sharpness
        against = tail(abs(x))
        right = blocks[position >> 5, node.level, position & 31] >= node.threshold
        log_probability += math.log(1.0 - against if right == (x >= 0.0) else against)
        place = node.right if right else node.left
    return ~place, log_probability


@njit
def log_probability_of(nodes, starts, members, blocks, probe, position, beta, kernel, weights):
    """Log-probability of the window at `position`; `tree_kernels.draw` describes the other arguments."""
    leaf, log_probability = path_of(nodes, blocks, position, probe, 1.0 / math.sqrt(beta))
    first, size = starts[leaf], starts[leaf + 1] - starts[leaf]
    if size == 1:
        return log_probability
    if not kernel:
        return log_probability - math.log(size)
    among = members[first : first + size]
    total = weigh(blocks, among, probe, beta, weights)
    return log_probability + math.log(weights[np.searchsorted(among, position)] / total)


@njit
def log_probability_of_all(nodes, starts, members, blocks, probes, positions, beta, kernel, size, out):
    """Fill `out` (B, k) for probes (B, b) and positions (B, k)."""
    weights = np.empty(size)
    for k in range(len(probes)):
        for j in range(positions.shape[1]):
            out[k, j] = log_probability_of(
                nodes, starts, members, blocks, probes[k], positions[k, j], beta, kernel, weights
            )
