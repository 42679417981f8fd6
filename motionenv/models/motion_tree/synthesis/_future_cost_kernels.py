"""Compiled loops of `future_cost`: the future cost of each window of a database."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.models.motion_tree.search.kernel_index_kernels import (
    BLOCK,
    FAN,
    box_distances,
    first_groups,
    leaf_distances,
    push,
    scratch,
)

_HOPELESS = 1e3  # cost of a dead end


@kernel
def future_cost(starts, frames, place, tails, exits, distances, toll, discount, sweeps, cost, way_out):
    """Write the future cost (n,) of windows by position, and the best exit of each window near a sequence's end.

    `starts` (sequences + 1,) are the sequences' first frames; `frames` and `place` map positions to frames and back.
    `tails` (m,) are the positions of the windows near the end of their sequences, the last of each first; `exits` and
    squared `distances` (m, k) are similar windows elsewhere, infinitely far if there are fewer. `toll` (n,) is the
    immediate cost of each window, `discount` is γ per frame, and `sweeps` the greatest number of value iterations.
    """
    for _ in range(sweeps):
        changed = 0.0
        for t in range(len(tails)):
            i = tails[t]
            after = place[frames[i] + 1]
            leaving, way_out[i] = _leave(exits[t], distances[t], discount, cost)
            best = toll[i] + min(leaving, discount * cost[after] if after >= 0 else np.inf, _HOPELESS)
            changed = max(changed, abs(best - cost[i]))
            cost[i] = best
        _carry_back(starts, place, way_out, toll, discount, cost)
        if changed < 1e-6:
            return


@kernel
def _leave(exits, distances, discount, cost):
    """Lowest cost of an exit and its window; infinite and -1 without exits."""
    best, way = np.inf, -1
    for k in range(len(exits)):
        if distances[k] + discount * cost[exits[k]] < best:
            best, way = distances[k] + discount * cost[exits[k]], exits[k]
    return best, way


@kernel
def _carry_back(starts, place, way_out, toll, discount, cost):
    """Propagate costs from the tails of sequences back to their beginnings."""
    for s in range(len(starts) - 1):
        for f in range(starts[s + 1] - 3, starts[s] + 8, -1):
            if way_out[place[f]] < 0:
                cost[place[f]] = toll[place[f]] + discount * cost[place[f + 1]]


@kernel
def nearest_elsewhere(blocks, boxes, n, frames, asked, apart, found, distances):
    """Find the nearest windows elsewhere for each of the positions `asked` (m,): `found` (m, k), nearest first.

    Windows elsewhere are more than `apart` frames away. Of windows within `apart` frames of each other, only the
    nearest is kept. `distances` (m, k) are squared, and infinite if there are fewer than k.
    """
    work = scratch(n, boxes.shape[3])
    for a in range(len(asked)):
        found[a], distances[a] = 0, np.inf
        _search(blocks, boxes, n, frames, asked[a], apart, found[a], distances[a], work)


@kernel
def _search(blocks, boxes, n, frames, here, apart, found, distances, work):
    probe, row, stack, bounds = work[:4]
    away = work[5][0]
    levels, first = first_groups(n)
    probe[: blocks.shape[1]] = blocks[here // BLOCK, :, here % BLOCK]
    stack[0, 0], stack[0, 1] = levels - 1, 0
    top = 1
    while top > 0:
        top -= 1
        level, node = stack[top]
        if level < 0:
            leaf_distances(blocks, node, probe, away)
            _take(FAN * node, n, away, frames, here, apart, found, distances)
        else:
            box_distances(boxes, first[level] + node, probe, row)
            top = push(row, level, node, distances[-1], stack, bounds, top)


@kernel
def _take(first, n, away, frames, here, apart, found, distances):
    """Insert the points of a leaf from position `first` on, at squared distances `away` (16,), that are near enough."""
    for i in range(min(FAN, n - first)):
        if away[i] < distances[-1] and abs(frames[first + i] - frames[here]) > apart:
            _insert(first + i, away[i], frames, apart, found, distances)


@kernel
def _insert(position, distance, frames, apart, found, distances):
    """Insert a window into the sorted nearest ones, replacing one within `apart` frames of it, or else the last."""
    k = len(found) - 1
    for other in range(len(found)):
        if distances[other] < np.inf and abs(frames[found[other]] - frames[position]) <= apart:
            if distances[other] <= distance:
                return
            k = other
            break
    while k > 0 and distances[k - 1] > distance:
        found[k], distances[k] = found[k - 1], distances[k - 1]
        k -= 1
    found[k], distances[k] = position, distance
