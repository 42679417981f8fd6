"""Compiled loop of `generator`, frame by frame."""

from collections import namedtuple

import numpy as np

from motionenv._core.compilation import kernel
from motionenv._core.random import gaussian, restart, uniform
from motionenv.models.motion_tree.feature_kernels import (
    MIDDLE,
    frame_parameters,
    local_pose,
    placed_pose,
    turned_towards,
)
from motionenv.models.motion_tree.search import exact, tree_kernels
from motionenv.models.motion_tree.synthesis._footing_kernels import keep_footing

#: A tree as input of the loop. blocks, kernels, sums: points and scratch of exact draws. nodes, leaves, members,
#: leaf_weights: the paper's search. Windows by position: frames, turn, speed, activity (n,), ground (n, 3), and cost
#: and way_out (courses, n), of which those of `_course` count, see `future_cost.FutureCost`; place (frames,): position
#: of the window that ends at a frame, or -1. Projection: channels (p,), weights (10, p, b), offset (b,). owns (25,):
#: mask of the pose entries that the tree predicts.
Source = namedtuple(
    "Source",
    ["blocks", "kernels", "sums", "nodes", "leaves", "members", "leaf_weights", "frames", "cost", "turn", "speed",
     "activity", "way_out", "ground", "place", "channels", "weights", "offset", "owns"],
)  # fmt: skip

#: State that the loop updates. rows (11, 25): local poses before foot contact is enforced, the last first; difference,
#: drift (25,): generated minus database pose, and its rate; pose (25,): the last generated pose; windows (trees,):
#: positions of the last draws; count (1,): frames generated; footing: state of `_footing_kernels`.
State = namedtuple("State", ["rows", "difference", "drift", "pose", "windows", "count", "footing"])

#: temperature β; paper: whether to use the paper's search; stay: probability of continuing the last draw's clip;
#: candidates: number of draws; quickness y of blending [1/s]; future, contact: switches; noise (25,): standard
#: deviations; activity (-1 for any), heading and pace (NaN for any): the target.
Settings = namedtuple(
    "Settings",
    ["temperature", "paper", "stay", "candidates", "quickness", "future", "contact", "noise", "activity", "heading",
     "pace"],
)  # fmt: skip

FPS = 30.0
HERE = 15  # windows within this number of frames count as the same place of a sequence
_OFF_ACTIVITY = 4.0  # penalty on the log weight of another activity
_TURN_SPREAD, _SHARPEST = 0.25, 1.2  # [rad] standard deviation and limit of the turn wanted within a second
_OFF_COURSE = 0.3  # [rad] from the wanted heading, beyond which the future should turn
_PACE_SPREAD = 0.15  # standard deviation of the wanted speed [m/s]


@kernel
def grow(sources, settings, state, poses, stands, offsets, height, key, out):
    """Write the next poses to `out` (frames, 25), and advance `state`.

    `sources` begin with that of the legs. `poses` (frames, 25) and stance flags `stands` (frames, 2) are the
    database's, `offsets` and `height` the body's; `key` is that of the random numbers.
    """
    random = np.empty(1, dtype=np.uint64)
    step, shown = np.empty(25), np.empty((1, 25))
    for k in range(len(out)):
        if not np.isfinite(state.rows).all():  # with a damaged database, rejection sampling would never end
            out[k:] = np.nan
            return
        restart(random, key, state.count[0])
        for s in range(len(sources)):
            _follow(sources, s, settings, state, poses, random, step)
        _blend(settings.quickness, state, step)
        for c in range(25):
            if settings.noise[c] > 0:
                step[c] += settings.noise[c] * gaussian(random)
        _remember(step, state)
        placed_pose(state.pose, step, shown[0])
        if settings.contact:
            i = state.windows[0]
            standing = stands[sources[0].frames[i] + 1]
            keep_footing(shown, standing, sources[0].ground[i], state.footing, offsets, height)
        state.pose[:] = shown[0]
        out[k] = shown[0]
        state.count[0] += 1


@kernel
def _follow(sources, s, settings, state, poses, random, step):
    """Draw a window, and write the entries that the tree predicts of the pose after it to `step`."""
    source = sources[s]
    i = _choose(sources, s, settings, state, random)
    frame = source.frames[i]
    now, after = np.empty(50), np.empty(25)
    if not _goes_on(source, state.windows[s], i):
        frame_parameters(poses, 0, frame, FPS, after, now)
        _begin_blend(source.owns, now, state)
    state.windows[s] = i
    local_pose(poses[frame], poses[frame + 1], after)
    for c in range(25):
        if source.owns[c]:
            step[c] = after[c]


@kernel
def _goes_on(source, last, i):
    return last >= 0 and source.frames[i] == source.frames[last] + 1


@kernel
def _is_angle(c):
    return not np.isnan(MIDDLE[c])


@kernel
def _plainly(value, c):
    """Entry c of a local pose, wrapped like the parameters of frames."""
    return turned_towards(value, MIDDLE[c]) if _is_angle(c) else value


@kernel
def coefficients(source, rows, out):
    """Write to `out` (b,) the standardised coefficients of the ten latest of `rows` (11, 25), the latest first."""
    p = len(source.channels)
    for i in range(len(out)):
        out[i] = -source.offset[i]
    for lag in range(10):
        for j in range(p):
            c = source.channels[j]
            f = _plainly(rows[lag, c], c) if c < 25 else (rows[lag, c - 25] - rows[lag + 1, c - 25]) * FPS
            for i in range(len(out)):
                out[i] += f * source.weights[lag, j, i]


@kernel
def _choose(sources, s, settings, state, random):
    """Position of the window after which the next frame comes.

    The last window's successor has the probability `stay`, and draws from p(i | t) share the rest. Draws from the same
    place as the last window count as its successor. Near the end of a sequence, the best exit is a candidate too,
    weighted by its kernel. The choice among weighted candidates is sampling importance resampling. It is approximate,
    since candidates are few, and the exit's kernel isn't normalised.
    """
    source, last = sources[s], state.windows[s]
    offered = np.empty(settings.candidates + 2, dtype=np.int32)  # draws, way out, successor
    drawn, probe = offered[:-2], np.empty(source.weights.shape[2])
    coefficients(source, state.rows, probe)
    _draw(source, settings, probe.astype(np.float32), random, drawn)
    here = source.frames[last] if last >= 0 else np.int64(-1000000)
    after = source.place[here + 1] if last >= 0 else np.int64(-1)
    present = np.empty(sources[0].weights.shape[2])
    coefficients(sources[0], state.rows, present)
    weight = np.full(len(offered), -np.inf)
    away, each = 0, (1.0 - settings.stay) / len(drawn)
    for k in range(len(drawn)):
        if abs(source.frames[drawn[k]] - here) > HERE:
            away += 1
            weight[k] = np.log(each) + _log_weight(sources, s, drawn[k], present, settings, state)
    offered[-1], offered[-2] = after, _way_out(source, _course(settings, state), last, after)
    if after >= 0:
        share = settings.stay + each * (len(drawn) - away)
        weight[-1] = np.log(share) + _log_weight(sources, s, after, present, settings, state)
    elif away == 0:
        return offered[-2] if offered[-2] >= 0 else drawn[0]
    if settings.future and offered[-2] >= 0:
        kernel = -_apart(source, source.frames[offered[-2]], probe) / (2.0 * settings.temperature)
        share = max(1.0 - settings.stay, 1e-9)
        weight[-2] = np.log(share) + kernel + _log_weight(sources, s, offered[-2], present, settings, state)
    return offered[_pick(weight, random)]


@kernel
def _way_out(source, course, last, after):
    """The best exit from the window `after`; without such a window, the successor of the last window's exit."""
    way_out = source.way_out[course]
    if after >= 0 or last < 0 or way_out[last] < 0:
        return way_out[after] if after >= 0 else np.int32(-1)
    following = source.place[source.frames[way_out[last]] + 1]
    return following if following >= 0 else way_out[last]


@kernel
def _course(settings, state):
    """Wanted future: 0 any, or straight on; 1 and 2 turns to the left and to the right."""
    if not settings.heading == settings.heading or abs(_asked(settings, state)) < _OFF_COURSE:
        return 0
    return 1 if _asked(settings, state) > 0.0 else 2


@kernel
def _asked(settings, state):
    """The turn [rad] to the wanted heading, the shorter way round."""
    asked = settings.heading - state.pose[5]
    return asked - 2 * np.pi * np.round(asked / (2 * np.pi))


@kernel
def _draw(source, settings, probe, random, drawn):
    """Draw windows from p(i | t), exactly or by the paper's search with the kernel in the leaf."""
    if not settings.paper:
        exact.draw(
            source.blocks, probe, settings.temperature, random, source.kernels, source.sums, drawn, np.empty(len(drawn))
        )
        return
    for k in range(len(drawn)):
        drawn[k], _ = tree_kernels.draw(
            source.nodes, source.leaves, source.members, source.blocks, probe, settings.temperature, True, random,
            source.leaf_weights,
        )  # fmt: skip


@kernel
def _pick(log_weight, random):
    """Draw an index with probabilities proportional to exp(log_weight), of which at least one is finite."""
    best, total = log_weight.max(), 0.0
    for k in range(len(log_weight)):
        total += np.exp(log_weight[k] - best)
    left = uniform(random) * total
    for k in range(len(log_weight)):
        left -= np.exp(log_weight[k] - best)
        if left < 0:
            return k
    return log_weight.argmax()


@kernel
def _log_weight(sources, s, i, present, settings, state):
    """Log weight of a window by future cost, activity, heading, speed and, for the upper body, match with the legs.

    `present` (b,) are the current coefficients of the first tree, that of the legs.
    """
    source, w = sources[s], 0.0
    if s > 0:
        w -= _apart(sources[0], source.frames[i], present) / (2.0 * settings.temperature)
    if settings.future:
        following = source.place[source.frames[i] + 1]
        cost = source.cost[_course(settings, state)]
        w -= cost[following if following >= 0 else i] / (2.0 * settings.temperature)
    if settings.activity >= 0 and source.activity[i] != settings.activity:
        w -= _OFF_ACTIVITY
    if settings.heading == settings.heading:
        asked = min(max(_asked(settings, state), -_SHARPEST), _SHARPEST)
        w -= 0.5 * ((source.turn[i] - asked) / _TURN_SPREAD) ** 2
    if settings.pace == settings.pace:
        w -= 0.5 * ((source.speed[i] - settings.pace) / _PACE_SPREAD) ** 2
    return w


@kernel
def _apart(source, frame, present):
    i, square = source.place[frame], 0.0
    for j in range(len(present)):
        square += (source.blocks[i >> 5, j, i & 31] - present[j]) ** 2
    return square


@kernel
def _begin_blend(owns, row, state):
    """Store the difference of the generated pose from the database frame `row` (50,), and the difference's rate."""
    for c in range(25):
        if owns[c]:
            away = state.rows[0, c] - row[c]
            state.difference[c] = turned_towards(away, 0.0) if _is_angle(c) else away
            state.drift[c] = (state.rows[0, c] - state.rows[1, c]) * FPS - row[25 + c]


@kernel
def _blend(quickness, state, step):
    """Decay differences over a frame, x(t) = (x₀ + (v₀ + y x₀) t) exp(-y t) (Bollo 2018), and add them to `step`."""
    if not quickness < np.inf:
        return
    fades = np.exp(-quickness / FPS)
    for c in range(25):
        x, v = state.difference[c], state.drift[c]
        push = v + quickness * x
        state.difference[c] = (x + push / FPS) * fades
        state.drift[c] = (v - quickness * push / FPS) * fades
        step[c] += state.difference[c]


@kernel
def _remember(step, state):
    """Push the new local pose to the history, with angles unwrapped relative to the previous pose."""
    for k in range(len(state.rows) - 1, 0, -1):
        for c in range(25):
            state.rows[k, c] = state.rows[k - 1, c]
    for c in range(25):
        if _is_angle(c):
            step[c] = turned_towards(step[c], state.rows[1, c])
        state.rows[0, c] = step[c]
