"""Compiled loops of the exact sampler (`kernel_index.KernelIndex`): draws, and sums of kernels, over its tree of boxes.

Layout, for n points of b coordinates: points are stored in blocks (blocks, b, 32), the last padded with +inf. A leaf is
half a block: points 16 j to 16 j + 15. Sixteen leaves make a group, sixteen groups a group of the next level, up to one
root. `boxes` (groups, 2, 16, width) holds the lowest and highest coordinates of each group's 16 children: +inf for
missing children, and zeros from b to `width`, which is b rounded up to a multiple of 8. Groups are numbered from the
root down, level by level.
"""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.random import restart, uniform

_simd = kernel(fastmath={"contract", "nnan", "nsz", "reassoc"})

BLOCK = 32  # points in a block of memory
FAN = 16  # children of a group and points of a leaf: the width of one vector instruction
_LEVELS = 8  # more than 16⁸ points don't fit in memory
_STEEPEST = 1e30  # greatest 1/2β; greater values have the same effect
_SLACK = np.float32(1.0 - 4e-6)  # factor on boxes' distances, so that rounding can't make them too far
_EXACT = 1e-6  # share of the sum of kernels that draws leave out
_ZERO = np.float32(0.0)


@kernel
def first_groups(n):
    """Number of levels of groups for n points, and the first group of each level; level 0 is that above the leaves."""
    first, counts = np.zeros(_LEVELS + 1, np.int64), np.zeros(_LEVELS + 1, np.int64)
    nodes, levels = (n + FAN - 1) // FAN, 0
    while levels == 0 or nodes > 1:
        nodes = (nodes + FAN - 1) // FAN
        counts[levels] = nodes
        levels += 1
    for level in range(levels - 2, -1, -1):
        first[level] = first[level + 1] + counts[level + 1]
    first[levels] = first[0] + counts[0]
    return levels, first


@kernel
def scratch(n, width):
    """Scratch memory of `gather` and `draw`, for n points and boxes of `width`; it needs no clearing.

    Returns:
        the probe (width,) and a row (16,) float32; stack (128, 2) int64 and its bounds (128,) float32; of the leaves
        near the probe their numbers (leaves,) int32, kernels (leaves, 16), and the running sum (leaves,) of these.
    """
    leaves = (n + FAN - 1) // FAN
    return (
        np.zeros(width, np.float32), np.empty(FAN, np.float32), np.empty((_LEVELS * FAN, 2), np.int64),
        np.empty(_LEVELS * FAN, np.float32), np.empty(leaves, np.int32), np.empty((leaves, FAN)), np.empty(leaves),
    )  # fmt: skip


@_simd
def box_distances(boxes, group, probe, out):
    """Squared distances (16,) of a probe (width,) to the boxes of the children of a group."""
    for i in range(FAN):
        whole = _ZERO
        for d in range(len(probe)):
            below, above = boxes[group, 0, i, d] - probe[d], probe[d] - boxes[group, 1, i, d]
            away = below if below > above else above
            away = away if away > _ZERO else _ZERO
            whole += away * away
        out[i] = whole * _SLACK


@_simd
def leaf_distances(blocks, leaf, probe, out):
    """Squared distances (16,) of a probe to the points of a leaf, in double precision."""
    block, half = blocks[leaf // 2], leaf % 2 * FAN
    for i in range(FAN):
        out[i] = 0.0
    for d in range(blocks.shape[1]):
        for i in range(FAN):
            away = np.float64(block[d, half + i]) - np.float64(probe[d])
            out[i] += away * away


@kernel
def push(row, level, node, limit, stack, bounds, top):
    """Push the children of a group with squared distances `row` below `limit`, the nearest last; the stack's new top.

    They are visited in turn, the last first; what is on a stack below level 0 are leaves.
    """
    nearest = row.argmin()
    for i in range(FAN + 1):
        k = nearest if i == FAN else i
        if (i == FAN or i != nearest) and row[k] < limit:
            stack[top, 0], stack[top, 1], bounds[top] = level - 1, FAN * node + k, row[k]
            top += 1
    return top


@kernel
def gather(blocks, boxes, n, probe, steepness, tolerance, work):
    """Gather the leaves of which the kernels' sum consists, but for a share of at most `tolerance`.

    Branch and bound, nearest boxes first: points further than `reach` beyond the nearest have kernels below
    tolerance / n of its kernel. Writes these leaves to `work`, with their kernels relative to that of the nearest
    point. Returns the number of leaves and the least squared distance.
    """
    wide, row, stack, bounds, leaves, weights, sums = work
    levels, first = first_groups(n)
    wide[: len(probe)] = probe
    reach, best, found, top = np.log(n / tolerance) / steepness, np.inf, 0, 1
    stack[0, 0], stack[0, 1], bounds[0] = levels - 1, 0, 0.0
    while top > 0:
        top -= 1
        level, node = stack[top]
        if bounds[top] > best + reach:
            continue
        if level < 0:
            leaf_distances(blocks, node, wide, weights[found])
            best = min(best, weights[found].min())
            leaves[found] = node
            found += 1
        else:
            box_distances(boxes, first[level] + node, wide, row)
            top = push(row, level, node, best + reach, stack, bounds, top)
    whole = 0.0
    for j in range(found):
        for i in range(FAN):
            beyond = weights[j, i] - best
            weights[j, i] = np.exp(-beyond * steepness) if beyond < reach else 0.0
            whole += weights[j, i]
        sums[j] = whole
    return found, best


@kernel
def _steepness(beta):
    """1 / 2β, within what its products with distances can be."""
    return min(max(0.5 / beta, 1.0 / _STEEPEST), _STEEPEST)


@kernel
def draw(blocks, boxes, n, probe, beta, state, work, out):
    """Draw positions `out` (count,) int32 with probabilities proportional to exp(-|z_i - probe|² / 2β).

    `blocks`, `boxes` and `n` are attributes of `KernelIndex`. `probe` (b,) is float32, and both it and `beta`, above 0,
    are finite; `state` is a stream of `motionenv._core.random`, which is advanced; `work` is from
    `scratch(n, boxes.shape[3])`.
    """
    steepness = _steepness(beta)
    found = gather(blocks, boxes, n, probe, steepness, _EXACT, work)[0]
    leaves, weights, sums = work[-3:]
    for i in range(len(out)):
        u = uniform(state) * sums[found - 1]
        j = min(np.searchsorted(sums[:found], u, side="right"), found - 1)
        u -= sums[j - 1] if j else 0.0
        for k in range(FAN):
            if weights[j, k] > 0.0:
                out[i] = FAN * leaves[j] + k
            if u < weights[j, k]:
                break
            u -= weights[j, k]


@kernel
def draw_all(blocks, boxes, n, probes, beta, key, start, out):
    """Draw `out` (probes, count) for probes (probes, b); the first has the index `start` in the batch."""
    work = scratch(n, boxes.shape[3])
    state = np.empty(1, np.uint64)
    for i in range(len(probes)):
        restart(state, key, start + i)
        draw(blocks, boxes, n, probes[i], beta, state, work, out[i])


@kernel
def log_sums(blocks, boxes, n, probes, beta, tolerance, out):
    """Write log Σᵢ exp(-|z_i - probe|² / 2β) of probes (probes, b) to `out`, underestimated by at most `tolerance`."""
    work = scratch(n, boxes.shape[3])
    steepness = _steepness(beta)
    for i in range(len(probes)):
        found, best = gather(blocks, boxes, n, probes[i], steepness, tolerance, work)
        out[i] = np.log(work[-1][found - 1]) - best * steepness
