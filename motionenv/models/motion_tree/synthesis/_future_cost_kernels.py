"""Compiled loops of `future_cost`: the future cost of each window of a database."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.models.motion_tree.search.exact import BLOCK, squared_distances

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
def nearest_elsewhere(blocks, frames, asked, apart, found, distances):
    """Find the nearest windows elsewhere for each of the positions `asked` (m,): `found` (m, k), nearest first.

    Windows elsewhere are more than `apart` frames away. Of windows within `apart` frames of each other, only the
    nearest is kept. `distances` (m, k) are squared, and infinite if there are fewer than k.
    """
    away, probe = np.empty(BLOCK, np.float32), np.empty(blocks.shape[1], np.float32)
    for a in range(len(asked)):
        here = asked[a]
        found[a], distances[a] = 0, np.inf
        probe[:] = blocks[here // BLOCK, :, here % BLOCK]
        for j in range(len(blocks)):
            if squared_distances(blocks[j], probe, away) >= distances[a, -1]:
                continue
            for i in range(BLOCK):
                if away[i] < distances[a, -1] and abs(frames[BLOCK * j + i] - frames[here]) > apart:
                    _insert(BLOCK * j + i, away[i], frames, apart, found[a], distances[a])


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
