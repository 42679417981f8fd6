"""Compiled: what comes after each window of a database."""

import numpy as np
from numba import njit

from motionenv.models.tree._exact_kernels import BLOCK, FAN, box_distances, first_groups, leaf_excess, scratch

_jit = njit(nogil=True, cache=True, error_model="numpy")

_HOPELESS = 1e3  # cost where there is no way out


@_jit
def future_cost(starts, frames, place, tails, exits, distances, toll, discount, sweeps, cost, way_out):
    """Write the future cost (n,) of windows by position, and where to leave a sequence from each of its tail.

    Args:
        starts: (sequences + 1,) of the sequences.
        frames, place: of positions, and back.
        tails: (m,) positions of the windows near the end of their sequences, the last of each first.
        exits, distances: (m, k) windows elsewhere, and the squared distances to them, infinite where there are fewer.
        toll: (n,) what each window costs by itself.
        discount: γ, per frame.
        sweeps: value iterations at most.
        cost, way_out: written.
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


@_jit
def _leave(exits, distances, discount, cost):
    """Lowest cost of leaving for one of `exits`, and for which; infinite and -1 where there is none."""
    best, way = np.inf, -1
    for k in range(len(exits)):
        if distances[k] + discount * cost[exits[k]] < best:
            best, way = distances[k] + discount * cost[exits[k]], exits[k]
    return best, way


@_jit
def _carry_back(starts, place, way_out, toll, discount, cost):
    """Carry costs from the tails of sequences back to their beginnings; windows of tails have a way out or nothing."""
    for s in range(len(starts) - 1):
        for f in range(starts[s + 1] - 3, starts[s] + 8, -1):
            if way_out[place[f]] < 0:
                cost[place[f]] = toll[place[f]] + discount * cost[place[f + 1]]


@_jit
def ahead(poses, starts, frames, horizon, fps, turn, speed):
    """Write turn (n,) [rad] and mean speed (n,) [m/s] over the next `horizon` frames, or as many as there are."""
    for i in range(len(frames)):
        f = frames[i]
        g = min(f + horizon, starts[np.searchsorted(starts, f, side="right")] - 1)
        turn[i] = poses[g, 5] - poses[f, 5]
        speed[i] = np.hypot(poses[g, 0] - poses[f, 0], poses[g, 1] - poses[f, 1]) * fps / (g - f)


@_jit
def nearest_elsewhere(blocks, boxes, n, frames, asked, apart, found, distances):
    """Write the nearest windows of other places to each of the positions `asked` (m,): `found` (m, k), nearest first.

    Another place is more than `apart` frames away; of each place only the nearest window is taken. `distances` (m, k)
    are squared; infinite where there are fewer.
    """
    work = scratch(n, boxes.shape[3])
    for a in range(len(asked)):
        found[a], distances[a] = 0, np.inf
        _search(blocks, boxes, n, frames, asked[a], apart, found[a], distances[a], work)


@_jit
def _search(blocks, boxes, n, frames, here, apart, found, distances, work):
    probe, row, stack = work[2], work[3], work[6]
    levels, first = first_groups(n)
    probe[: blocks.shape[1]] = blocks[here // BLOCK, :, here % BLOCK]
    stack[0, 0], stack[0, 1] = levels - 1, 0
    top = 1
    while top > 0:
        top -= 1
        level, node = stack[top]
        if level < 0:
            leaf_excess(blocks, node, probe, 0.0, False, row)
            _take(FAN * node, n, row, frames, here, apart, found, distances)
            continue
        box_distances(boxes, first[level] + node, probe, row)
        nearest = row.argmin()
        for i in range(FAN + 1):  # the nearest child last, so that it is looked at first
            k = nearest if i == FAN else i
            if (i == FAN or i != nearest) and row[k] < distances[-1]:
                stack[top, 0], stack[top, 1] = level - 1, FAN * node + k
                top += 1


@_jit
def _take(first, n, row, frames, here, apart, found, distances):
    """Keep what is near enough of the points of a leaf, from position `first` on, at squared distances `row` (16,)."""
    for i in range(min(FAN, n - first)):
        if row[i] < distances[-1] and abs(frames[first + i] - frames[here]) > apart:
            _insert(first + i, row[i], frames, apart, found, distances)


@_jit
def _insert(position, distance, frames, apart, found, distances):
    """Keep a window among the nearest, which are in order, in the stead of one of the same place or of the last."""
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
