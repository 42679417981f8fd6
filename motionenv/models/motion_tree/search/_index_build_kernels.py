"""Compiled loops that build the kd-tree of `kernel_index.KernelIndex`; `kernel_index_kernels` describes its layout."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.models.motion_tree.search.kernel_index_kernels import BLOCK, FAN, first_groups

_simd = kernel(fastmath={"contract", "nnan", "nsz", "reassoc"})

_SAMPLE = 256  # points from which the axis of a split is chosen
_ZERO = np.float32(0.0)


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


@kernel
def split(rows, order, start, stop, unit):
    """Do the first split of `arrange` and return its position."""
    while unit >= stop - start:
        unit //= FAN
    middle = start + ((stop - start + unit - 1) // unit + 1) // 2 * unit
    _select(rows, order, start, stop, middle, _widest(rows, start, stop))
    return middle


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
