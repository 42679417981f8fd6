"""Compiled loops of the exact sampler (`kernel_index.KernelIndex`): its tree of boxes, draws, and sums of kernels.

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
_HIGHEST = 60.0  # kernels are at most e⁶⁰ times the reference's: sums of 10⁷ don't overflow in single precision
_LOWEST = np.float32(-87.0)  # kernels below e⁻⁸⁷ count as zero
_STEEPEST = 1e30  # greatest 1/2β; greater values have the same effect
_FAR = 200.0  # distance² / 2β above which single precision is too coarse
_SLACK = np.float32(1.0 - 4e-6)  # factor on boxes' distances, so that rounding can't make them too far
_SAMPLE = 256  # points from which the axis of a split is chosen
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_LOG2E, _LN2, _LN2_REST = np.float32(1.4426950408889634), np.float32(0.693359375), np.float32(-2.12194440e-4)


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
    """Scratch memory of draws, for n points and boxes of `width`. Draws touch only the entries of nodes they open.

    Returns:
        mass and child (entries, 16), float32 and int32, with an entry for each group and leaf; the probe (width,) and
        a row (16,) float32; another row and its memory as int32; stack (128, 2) int64 and its bounds (128,) float32;
        path (8, 2) int64.
    """
    levels, first = first_groups(n)
    entries = first[levels] + (n + FAN - 1) // FAN
    powers = np.empty(FAN, np.float32)
    return (
        np.empty((entries, FAN), np.float32), np.empty((entries, FAN), np.int32), np.zeros(width, np.float32),
        np.empty(FAN, np.float32), powers, powers.view(np.int32), np.empty((_LEVELS * FAN, 2), np.int64),
        np.empty(_LEVELS * FAN, np.float32), np.empty((_LEVELS, 2), np.int64),
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
def _near_excess(blocks, leaf, probe, reference, out):
    """Squared distances (16,) of a probe to the points of a leaf, less `reference`."""
    block, half, b = blocks[leaf // 2], leaf % 2 * FAN, blocks.shape[1]
    for i in range(FAN):
        out[i] = -reference
    for k in range(b // 4):
        d = 4 * k
        for i in range(FAN):
            p, q = block[d, half + i] - probe[d], block[d + 1, half + i] - probe[d + 1]
            r, s = block[d + 2, half + i] - probe[d + 2], block[d + 3, half + i] - probe[d + 3]
            out[i] += (p * p + q * q) + (r * r + s * s)
    for d in range(b // 4 * 4, b):
        for i in range(FAN):
            p = block[d, half + i] - probe[d]
            out[i] += p * p


@kernel
def leaf_excess(blocks, leaf, probe, reference, far, out):
    """Squared distances (16,) of a probe to the points of a leaf, less `reference`; if `far`, in double precision."""
    if far:
        for i in range(FAN):
            out[i] = np.float32(_far_distance(blocks, leaf, i, probe) - reference)
    else:
        _near_excess(blocks, leaf, probe, np.float32(reference), out)


@_simd
def kernels(excess, steepness, count, powers, bits, mass, entry):
    """Write count · exp(-steepness · excess) (16,) to `mass[entry]`, at most count · e⁶⁰, 0 below count · e⁻⁸⁷.

    The exponential is 2ᵏ eᶠ with a polynomial of degree 7 for |f| <= ln 2 / 2 (Cephes' expf), with a relative error
    below 4e-7. `powers` (16,) float32 is scratch memory; `bits` is the same memory as int32, into which the exponent of
    2ᵏ is written.
    """
    for i in range(FAN):
        x = -excess[i] * steepness
        x = x if x < np.float32(_HIGHEST) else np.float32(_HIGHEST)
        below = x < _LOWEST
        x = _LOWEST if below else x
        k = np.float32(np.rint(x * _LOG2E))
        f = (x - k * _LN2) - k * _LN2_REST
        p = np.float32(1.9875691500e-4)
        p = p * f + np.float32(1.3981999507e-3)
        p = p * f + np.float32(8.3334519073e-3)
        p = p * f + np.float32(4.1665795894e-2)
        p = p * f + np.float32(1.6666665459e-1)
        p = p * f + np.float32(0.5)
        excess[i] = _ZERO if below else (p * f * f + f + _ONE) * count
        bits[i] = (np.int32(k) + np.int32(127)) << np.int32(23)
    whole = _ZERO
    for i in range(FAN):
        kernel = excess[i] * powers[i]
        mass[entry, i] = kernel
        whole += kernel
    return whole


@_simd
def _total(mass, entry):
    whole = _ZERO
    for i in range(FAN):
        whole += mass[entry, i]
    return whole


@_simd
def _least(row):
    best = 0
    for i in range(1, FAN):
        if row[i] < row[best]:
            best = i
    return best


@kernel
def _descend(blocks, boxes, levels, first, probe, far, row):
    """Squared distance of the nearest point in the leaf reached by always taking the nearest box."""
    node = 0
    for level in range(levels - 1, -1, -1):
        box_distances(boxes, first[level] + node, probe, row)
        node = FAN * node + _least(row)
    return _leaf_least(blocks, node, probe, far, row)


@kernel
def _leaf_least(blocks, leaf, probe, far, row):
    """The least squared distance of a leaf's points; if `far`, in double precision, so that its own excess is 0."""
    if not far:
        _near_excess(blocks, leaf, probe, _ZERO, row)
        return np.float64(row[_least(row)])
    best = np.inf
    for i in range(FAN):
        best = min(best, _far_distance(blocks, leaf, i, probe))
    return best


@kernel
def _far_distance(blocks, leaf, i, probe):
    """Squared distance of a probe to point `i` of a leaf, in double precision."""
    whole = 0.0
    for d in range(blocks.shape[1]):
        away = np.float64(blocks[leaf // 2, d, leaf % 2 * FAN + i]) - np.float64(probe[d])
        whole += away * away
    return whole


@kernel
def _search(blocks, boxes, levels, first, probe, best, margin, far, row, stack, bounds):
    """The least squared distance of a point up to `margin`, by branch and bound from the initial value `best`."""
    stack[0, 0], stack[0, 1], bounds[0] = levels - 1, 0, 0.0
    top = 1
    while top > 0:
        top -= 1
        level, node = stack[top]
        if bounds[top] > best - margin:
            continue
        if level < 0:
            best = min(best, _leaf_least(blocks, node, probe, far, row))
            continue
        box_distances(boxes, first[level] + node, probe, row)
        top = _push(row, level, node, best - margin, stack, bounds, top)
    return best


@kernel
def _push(row, level, node, limit, stack, bounds, top):
    """Push the children of a group with squared distances `row` below `limit`, the nearest last."""
    nearest = _least(row)
    for i in range(FAN + 1):
        k = nearest if i == FAN else i
        if (i == FAN or i != nearest) and row[k] < limit:
            stack[top, 0], stack[top, 1], bounds[top] = level - 1, FAN * node + k, row[k]
            top += 1
    return top


@kernel
def reference(blocks, boxes, levels, first, probe, steepness, row, stack, bounds):
    """A reference squared distance, relative to which no kernel exceeds e⁶⁰, and whether to use double precision."""
    best = _descend(blocks, boxes, levels, first, probe, False, row)
    far = best * steepness > _FAR
    if far:
        best = _descend(blocks, boxes, levels, first, probe, True, row)
    if best * steepness > _HIGHEST:
        best = _search(blocks, boxes, levels, first, probe, best, _HIGHEST / steepness, far, row, stack, bounds)
    return best, far


@kernel
def steepness_of(beta):
    """1 / 2β, clipped to the range of single precision."""
    return min(max(0.5 / beta, 1.0 / _STEEPEST), _STEEPEST)


@kernel
def draw(blocks, boxes, n, probe, beta, state, work, out):
    """Draw positions `out` (count,) int32 with probabilities proportional to exp(-|z_i - probe|² / 2β), exactly.

    The algorithm is described in `kernel_index`, whose attributes `blocks`, `boxes` and `n` are. Nodes stay open for
    all draws of a call. `probe` (b,) is float32, and both it and `beta`, above 0, are finite; `state` is a stream of
    `motionenv._core.random`, which is advanced; `work` is from `scratch(n, boxes.shape[3])`, and needs no clearing.
    """
    mass, child, wide, row, powers, bits, stack, bounds, path = work  # unpacked once, as this counts references
    levels, first = first_groups(n)
    wide[: len(probe)] = probe
    s = steepness_of(beta)
    best, far = reference(blocks, boxes, levels, first, wide, s, row, stack, bounds)
    _open(boxes, 0, wide, best, s, FAN**levels, row, powers, bits, mass, child, 0)
    entries = 1
    for i in range(len(out)):
        out[i] = -1
        while out[i] < 0:
            out[i], entries = _throw(
                blocks, boxes, levels, first, wide, best, far, s, state, entries, mass, child, row, powers, bits, path
            )


@kernel
def _throw(blocks, boxes, levels, first, probe, best, far, s, state, entries, mass, child, row, powers, bits, path):
    """One rejection step: the position drawn or -1, and the new number of entries."""
    u = uniform(state) * np.float64(_total(mass, 0))
    entry, node = 0, 0
    for depth in range(levels + 1):
        k = 0
        while k < FAN and u >= mass[entry, k]:
            u -= mass[entry, k]
            k += 1
        if k == FAN:
            return -1, entries
        node = FAN * node + k
        if depth == levels:
            break
        path[depth, 0], path[depth, 1] = entry, k
        following = child[entry, k]
        if following < 0:
            following = entries
            entries += 1
            child[entry, k] = following
            level = levels - 2 - depth
            if level < 0:
                leaf_excess(blocks, node, probe, best, far, row)
                whole = kernels(row, np.float32(s), _ONE, powers, bits, mass, following)
            else:
                group, size = first[level] + node, FAN ** (level + 1)
                whole = _open(boxes, group, probe, best, s, size, row, powers, bits, mass, child, following)
            _tighten(mass, path, depth, whole)
            if u >= whole:
                return -1, entries
        entry = following
    return node, entries


@kernel
def _tighten(mass, path, depth, whole):
    """Update the bounds along the path after its last node was opened and has the bound `whole`."""
    for j in range(depth, -1, -1):
        mass[path[j, 0], path[j, 1]] = whole
        whole = _total(mass, path[j, 0])


@_simd
def _open(boxes, group, probe, best, s, size, row, powers, bits, mass, child, entry):
    """Write upper bounds (16,) of the kernel mass of a group's unopened children of `size` points; return the sum."""
    near = np.float32(best)
    box_distances(boxes, group, probe, row)
    for i in range(FAN):
        row[i] -= near
        child[entry, i] = -1
    return kernels(row, np.float32(s), np.float32(size), powers, bits, mass, entry)


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
    """Write log Σᵢ exp(-|z_i - probe|² / 2β) of probes (probes, b) to `out`, underestimated by at most `tolerance`.

    Visits the nearest children first, and skips those whose kernels can't exceed their share of the tolerance.
    """
    mass, _, wide, row, powers, bits, stack, bounds, _ = scratch(n, boxes.shape[3])
    levels, first = first_groups(n)
    s = steepness_of(beta)
    for i in range(len(probes)):
        wide[: probes.shape[1]] = probes[i]
        best, far = reference(blocks, boxes, levels, first, wide, s, row, stack, bounds)
        whole = _sum(
            blocks, boxes, levels, first, n, wide, best, far, s, tolerance, mass, row, powers, bits, stack, bounds
        )
        out[i] = np.log(whole) - best * s


@kernel
def _sum(blocks, boxes, levels, first, n, probe, best, far, s, tolerance, mass, row, powers, bits, stack, bounds):
    """Sum of the kernels of all n points relative to that at squared distance `best`; relative error `tolerance`."""
    whole, limit = 0.0, np.inf
    stack[0, 0], stack[0, 1], bounds[0] = levels - 1, 0, 0.0
    top = 1
    while top > 0:
        top -= 1
        level, node = stack[top]
        if bounds[top] > limit:
            continue
        if level < 0:
            leaf_excess(blocks, node, probe, best, far, row)
            whole += kernels(row, np.float32(s), _ONE, powers, bits, mass, 0)
            if whole > 0.0:
                limit = best + np.log(n / (tolerance * whole)) / s
            continue
        box_distances(boxes, first[level] + node, probe, row)
        top = _push(row, level, node, limit, stack, bounds, top)
    return whole


@kernel
def arrange(rows, order, start, stop, unit):
    """Sort points `start` to `stop` of `rows` (n, b) and `order` (n,) into the tree's order, in place.

    Splits a range of several units (16ᵐ points) between units, so that only its last group is not full.
    """
    while stop - start > FAN:
        while unit >= stop - start:
            unit //= FAN
        middle = start + ((stop - start + unit - 1) // unit + 1) // 2 * unit
        _select(rows, order, start, stop, middle, _widest(rows, start, stop))
        arrange(rows, order, start, middle, unit)
        start = middle


@_simd
def _widest(rows, start, stop):
    """The coordinate of largest mean absolute deviation, which is robust to outliers, in a sample of the points."""
    step = max(1, (stop - start) // _SAMPLE)
    best, widest = _ZERO, 0
    for d in range(rows.shape[1]):
        mean, spread, count = _ZERO, _ZERO, 0
        for i in range(start, stop, step):
            mean += rows[i, d]
            count += 1
        mean /= np.float32(count)
        for i in range(start, stop, step):
            spread += abs(rows[i, d] - mean)
        if spread > best:
            best, widest = spread, d
    return widest


@kernel
def _select(rows, order, start, stop, middle, d):
    """Reorder points `start` to `stop` so that none from `middle` on precedes an earlier one in coordinate `d`."""
    stop -= 1
    while start < stop:
        i, j = _partition(rows, order, start, stop, rows[middle, d], d)
        if j < middle:
            start = i
        if i > middle:
            stop = j


@kernel
def _partition(rows, order, i, j, pivot, d):
    """Partition points `i` to `j` by coordinate `d` at `pivot` (Hoare); return where the two parts meet."""
    while i <= j:
        while rows[i, d] < pivot:
            i += 1
        while rows[j, d] > pivot:
            j -= 1
        if i <= j:
            for k in range(rows.shape[1]):
                rows[i, k], rows[j, k] = rows[j, k], rows[i, k]
            order[i], order[j] = order[j], order[i]
            i += 1
            j -= 1
    return i, j


@kernel
def to_blocks(rows, n):
    """Transpose rows (blocks * 32, b) in place into blocks (b, 32); rows after the n points become +inf."""
    b = rows.shape[1]
    rows[n:] = np.inf
    flat, block = rows.reshape(-1), np.empty((BLOCK, b), np.float32)
    for start in range(0, len(rows), BLOCK):
        block[:] = rows[start : start + BLOCK]
        for d in range(b):
            for i in range(BLOCK):
                flat[start * b + d * BLOCK + i] = block[i, d]


@kernel
def make_boxes(blocks, n, width):
    """The boxes (groups, 2, 16, width) of n points in blocks (blocks, b, 32)."""
    levels, first = first_groups(n)
    b = blocks.shape[1]
    boxes = np.zeros((first[levels], 2, FAN, width), np.float32)
    boxes[:, :, :, :b] = np.inf
    for leaf in range((n + FAN - 1) // FAN):
        points = blocks[leaf // 2, :, leaf % 2 * FAN : leaf % 2 * FAN + min(FAN, n - FAN * leaf)]
        group = boxes[first[0] + leaf // FAN]
        for d in range(b):
            group[0, leaf % FAN, d], group[1, leaf % FAN, d] = points[d].min(), points[d].max()
    for level in range(1, levels):
        end = first[level - 2] if level > 1 else first[levels]
        for node in range(end - first[level - 1]):
            group, above = boxes[first[level - 1] + node], boxes[first[level] + node // FAN]
            for d in range(b):
                highest = group[1, 0, d]
                for k in range(1, FAN):
                    if group[1, k, d] < np.inf:
                        highest = max(highest, group[1, k, d])
                above[0, node % FAN, d], above[1, node % FAN, d] = group[0, :, d].min(), highest
    return boxes
