"""Compiled loops of `tree`: build the binary tree of paper C, search it at random, and compute log-probabilities.

Element (i, l), the coefficient l of the window at position i, is blocks[i >> 5, l, i & 31].
"""

import math

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.random import key_of, restart, uniform

#: A node: the level l of its coefficient, its threshold θ, and its children for coefficients below θ (left) and from θ
#: on (right): the index of a node, or ~k for leaf k. It has 16 bytes, so that a step touches one cache line.
NODE = np.dtype([("level", np.int32), ("threshold", np.float32), ("left", np.int32), ("right", np.int32)])

_CERTAIN = 8.0  # standard deviations from which a branch is certain; the tail beyond is 6e-16, five steps of `uniform`
_STEPS = 64  # per standard deviation
_LANES = 16  # draws that descend the tree concurrently
_SMALL = 1e-200  # below this, the next factor might make a product of probabilities underflow


def _tail_table() -> np.ndarray:
    """Coefficients (512, 4) of the cubics through the values and slopes of Φ(-x), x = 0, 1/64, ... 8."""
    x = np.arange(int(_CERTAIN) * _STEPS + 1) / _STEPS
    value = np.array([0.5 * math.erfc(v / math.sqrt(2)) for v in x])
    slope = -np.exp(-0.5 * x**2) / math.sqrt(2 * math.pi) / _STEPS
    rise = np.diff(value)
    return np.stack(
        [value[:-1], slope[:-1], 3 * rise - 2 * slope[:-1] - slope[1:], slope[:-1] + slope[1:] - 2 * rise], 1
    )


_TAIL = _tail_table()


@kernel
def tail(x):
    """Φ(-x) for x >= 0, with an absolute error of 1e-10 and a relative error of 1e-6; 0 from 8 on."""
    if not x < _CERTAIN:
        return 0.0
    x *= _STEPS
    k = int(x)
    x -= k
    return _TAIL[k, 0] + x * (_TAIL[k, 1] + x * (_TAIL[k, 2] + x * _TAIL[k, 3]))


@kernel
def is_whole(nodes, starts, members, depth):
    """Whether a tree is valid: every path ends in a non-empty leaf, and all indices are in range."""
    n, leaves = len(members), len(starts) - 1
    whole = starts[0] == 0 and starts[leaves] == n
    for k in range(leaves):
        whole &= starts[k] < starts[k + 1]
    for k in range(len(nodes)):
        whole &= 0 <= nodes[k].level < depth
        for child in (nodes[k].left, nodes[k].right):  # depth first: children come after their parents
            whole &= k < child < len(nodes) if child >= 0 else ~child < leaves
    for j in range(n):
        whole &= 0 <= members[j] < n
    return whole


@kernel
def build(blocks, median, nodes, starts, members):
    """Write a tree of the coefficients `blocks`, depth first, left before right; returns the number of `nodes`.

    A node is split at the median of its windows if `median`, else at 0. There is one more leaf than nodes: `starts` are
    where each leaf's members start, then the number of members; `members` (n,) are positions, leaf by leaf, ascending
    within each.
    """
    n, node, leaf, top = len(members), 0, 0, 1
    values, aside = np.empty(n, np.float32), np.empty(n, np.int32)
    stack = np.empty((blocks.shape[1] + 2, 5), np.int64)  # first and last member, level, parent, whether on its right
    stack[0] = 0, n, 0, -1, 0
    for i in range(n):
        members[i] = i
    while top > 0:
        top -= 1
        first, last, level, parent, right = stack[top]
        level, threshold, middle = _split(blocks, median, level, members[first:last], values, aside)
        middle += first
        if middle < last:
            place = node
            nodes[node].level, nodes[node].threshold = level, threshold
            stack[top] = middle, last, level + 1, node, 1
            stack[top + 1] = first, middle, level + 1, node, 0
            top += 2
            node += 1
        else:
            place = ~leaf
            starts[leaf] = first
            leaf += 1
        if parent >= 0 and right:
            nodes[parent].right = place
        elif parent >= 0:
            nodes[parent].left = place
    starts[leaf] = n
    return node


@kernel
def _split(blocks, median, level, members, values, aside):
    """The first level from `level` on that splits `members`, its threshold, and the number of members below it.

    If no level splits them, the number is that of all members.
    """
    m, threshold = len(members), np.float32(0)
    while level < blocks.shape[1] and m > 1:
        for j in range(m):
            values[j] = blocks[members[j] >> 5, level, members[j] & 31]
        if median:
            threshold = np.float32(np.median(values[:m]))
        below = _part(members, values, threshold, aside)
        if 0 < below < m:
            return level, threshold, below
        level += 1
    return level, threshold, m


@kernel
def _part(members, values, threshold, aside):
    """Stable partition of members: those with values below the threshold come first. Returns their number."""
    below, above = 0, 0
    for j in range(len(members)):
        i, less = members[j], values[j] < threshold
        members[below], aside[above] = i, i
        below += less
        above += not less
    members[below:] = aside[:above]
    return below


@kernel
def _step(node, probe, sharpness, state):
    """Take a branch at random (eq. 7 and 8); return the child and the branch's probability."""
    x = (np.float64(probe[node.level]) - node.threshold) * sharpness
    against = tail(abs(x))
    turns = uniform(state) < against
    return node.right if (x >= 0.0) != turns else node.left, against if turns else 1.0 - against


@kernel
def draw(nodes, starts, members, blocks, probe, beta, kernel, state, weights):
    """One draw for one probe (b,) of standardised coefficients, float32: a window's position, and its log-probability.

    `nodes`, `starts`, `members` and `blocks` are those of `build`, `beta` is the temperature, and `state` the stream of
    random numbers. Within the leaf, `kernel` chooses by p(cᵢ | cₜ) rather than uniformly; `weights` is scratch memory
    of the size of the largest leaf.
    """
    sharpness, place, log_probability = 1.0 / math.sqrt(beta), 0 if len(nodes) else -1, 0.0
    while place >= 0:
        place, probability = _step(nodes[place], probe, sharpness, state)
        log_probability += math.log(probability)
    position, share = _choose(starts, members, blocks, ~place, probe, beta, kernel, state, weights)
    return position, log_probability + math.log(share)


@kernel
def _choose(starts, members, blocks, leaf, probe, beta, kernel, state, weights):
    """Pick a window of a leaf at random; return its position and probability."""
    first, size = starts[leaf], starts[leaf + 1] - starts[leaf]
    if size == 1:
        return members[first], 1.0
    if not kernel:
        return members[first + int(uniform(state) * size)], 1.0 / size
    total = weigh(blocks, members[first : first + size], probe, beta, weights)
    aim, j, reached = uniform(state) * total, 0, weights[0]
    while reached <= aim:  # terminates: aim is below the total, which is this same sum
        j += 1
        reached += weights[j]
    return members[first + j], weights[j] / total


@kernel
def weigh(blocks, among, probe, beta, weights):
    """Write exp(-|z_i - z|² / 2β) of the windows at positions `among`, relative to the largest; return the sum."""
    least, total = np.inf, 0.0
    for j in range(len(among)):
        square = 0.0
        for level in range(len(probe)):
            away = np.float64(blocks[among[j] >> 5, level, among[j] & 31]) - probe[level]
            square += away * away
        weights[j] = square
        least = min(least, square)
    for j in range(len(among)):
        weights[j] = math.exp((least - weights[j]) / (2.0 * beta))
        total += weights[j]
    return total


@kernel
def draw_all(nodes, starts, members, blocks, probes, beta, kernel, key, number, size, positions, log_probability):
    """Fill positions, log_probability (B, count) for probes (B, b), the first of which has the index `number`.

    Draw j for probe k equals `draw` with stream `number` + k of `key_of(key, j)`. Several draws descend concurrently,
    so that memory latency of one overlaps with steps of the others.
    """
    count, sharpness, weights = positions.shape[1], 1.0 / math.sqrt(beta), np.empty(size)
    top, begun, left = 0 if len(nodes) else -1, 0, positions.size
    who, place, states = np.full((_LANES, 2), -1), np.full(_LANES, -1), np.empty((_LANES, 1), np.uint64)
    product, sum_ = np.empty(_LANES), np.empty(_LANES)
    while left > 0:
        for g in range(_LANES):
            k, j = who[g]
            if place[g] >= 0:
                place[g], probability = _step(nodes[place[g]], probes[k], sharpness, states[g])
                product[g] *= probability
                if product[g] < _SMALL:
                    sum_[g], product[g] = sum_[g] + math.log(product[g]), 1.0
                continue
            if k >= 0:
                positions[k, j], share = _choose(
                    starts, members, blocks, ~place[g], probes[k], beta, kernel, states[g], weights
                )
                log_probability[k, j] = sum_[g] + math.log(product[g]) + math.log(share)
                who[g, 0], left = -1, left - 1
            if begun < positions.size:
                k, j = begun // count, begun % count
                restart(states[g], key_of(key, j), number + np.uint64(k))
                who[g, 0], who[g, 1], place[g], begun = k, j, top, begun + 1
                product[g], sum_[g] = 1.0, 0.0
