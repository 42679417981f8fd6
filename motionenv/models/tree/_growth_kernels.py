"""Compiled: the loop of `growth`, one frame after the other."""

from collections import namedtuple

import numpy as np
from numba import njit

from motionenv.models.tree import _descent_kernels, _exact_kernels
from motionenv.models.tree._footing_kernels import keep_footing
from motionenv.models.tree._frame_kernels import MIDDLE, frame_parameters, local_pose, placed_pose, turned_towards
from motionenv.models.tree._random_kernels import normal, restart, uniform

_jit = njit(nogil=True, cache=True, error_model="numpy")

#: One tree as the loop sees it. blocks, boxes, n, scratch: of the exact sampler. nodes, leaves, members, leaf_weights:
#: of the paper's search. Windows by position: frames, cost, turn, speed, activity, way_out (n,) and ground (n, 3), see
#: `outlook.Outlook`; place (frames,): position of the window that ends at a frame, or -1. Projection: channels (p,),
#: weights (10, p, b), offset (b,). owns (25,): which entries of the pose it predicts.
Source = namedtuple(
    "Source",
    ["blocks", "boxes", "n", "scratch", "nodes", "leaves", "members", "leaf_weights", "frames", "cost", "turn", "speed",
     "activity", "way_out", "ground", "place", "channels", "weights", "offset", "owns"],
)  # fmt: skip

#: What the loop changes. rows (11, 25): local poses, the last first, without what footing did; difference, drift (25,):
#: what is shown less what the database says, and its rate; pose (25,): the last one shown; windows (trees,): positions
#: drawn last; count (1,): frames made; and what footing remembers.
State = namedtuple("State", ["rows", "difference", "drift", "pose", "windows", "count", "footing"])

#: temperature β; paper: whether to draw with the paper's search; stay: chance to go on where the last draw was;
#: candidates; quickness y of blending [1/s]; future, contact: whether; noise (25,): standard deviations; activity (-1
#: any), heading and pace (NaN any): the target.
Settings = namedtuple(
    "Settings",
    ["temperature", "paper", "stay", "candidates", "quickness", "future", "contact", "noise", "activity", "heading",
     "pace"],
)  # fmt: skip

FPS = 30.0
HERE = 15  # frames: nearer than this is the same place of a sequence
_OFF_ACTIVITY = 4.0  # what another activity costs, in log weight
_TURN_SPREAD, _SHARPEST = 0.25, 1.2  # [rad] how exactly a turn is asked for, and the sharpest asked for in a second
_PACE_SPREAD = 0.15  # [m/s]


@_jit
def grow(sources, settings, state, poses, stands, offsets, height, key, out):
    """Write the next poses to `out` (frames, 25).

    Args:
        sources: a tuple of `Source`, that of the legs first.
        settings: `Settings`.
        state: `State`, which it moves on.
        poses, stands: (frames, 25) and (frames, 2) of the database.
        offsets, height: of the body.
        key: of the random numbers.
        out: written.
    """
    random = np.empty(1, dtype=np.uint64)
    step, shown = np.empty(25), np.empty((1, 25))
    for k in range(len(out)):
        if not np.isfinite(state.rows).all():  # a damaged database: no draw would ever be accepted
            out[k:] = np.nan
            return
        restart(random, key, state.count[0])
        for s in range(len(sources)):
            _follow(sources, s, settings, state, poses, random, step)
        _blend(settings.quickness, state, step)
        for c in range(25):
            if settings.noise[c] > 0:
                step[c] += settings.noise[c] * normal(random)
        _remember(step, state)
        placed_pose(state.pose, step, shown[0])
        if settings.contact:
            i = state.windows[0]
            standing = stands[sources[0].frames[i] + 1]
            keep_footing(shown, standing, sources[0].ground[i], state.footing, offsets, height)
        state.pose[:] = shown[0]
        out[k] = shown[0]
        state.count[0] += 1


@_jit
def _follow(sources, s, settings, state, poses, random, step):
    """Draw the window that the next frame follows, and write what the tree owns of the pose after it to `step`."""
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


@_jit
def _goes_on(source, last, i):
    return last >= 0 and source.frames[i] == source.frames[last] + 1


@_jit
def _is_angle(c):
    """Whether entry c of a local pose is an angle, which whole turns don't change."""
    return not np.isnan(MIDDLE[c])


@_jit
def _plainly(value, c):
    """Entry c of a local pose as the parameters of frames tell it."""
    return turned_towards(value, MIDDLE[c]) if _is_angle(c) else value


@_jit
def coefficients(source, rows, out):
    """Write to `out` (b,) the coefficients over their deviations of the last ten of `rows` (11, 25), the last first."""
    p = len(source.channels)
    for i in range(len(out)):
        out[i] = -source.offset[i]
    for lag in range(10):
        for j in range(p):
            c = source.channels[j]
            f = _plainly(rows[lag, c], c) if c < 25 else (rows[lag, c - 25] - rows[lag + 1, c - 25]) * FPS
            for i in range(len(out)):
                out[i] += f * source.weights[lag, j, i]


@_jit
def _choose(sources, s, settings, state, random):
    """Position of the window that the next frame follows.

    The last window's successor has the probability `stay`, draws from p(i | t) share the rest; draws from the place of
    the last window count as its successor. Near the end of a sequence the best way out is offered too, by its kernel.
    Then each is weighted: sampling-importance-resampling, roughly, for candidates are few, and the way out's kernel
    isn't divided by the sum that the draws are.
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
    offered[-1], offered[-2] = after, _way_out(source, last, after)
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


@_jit
def _way_out(source, last, after):
    """Where best to jump to from the window `after` that ends now; if there is none, a frame after that of the last."""
    if after >= 0 or last < 0 or source.way_out[last] < 0:
        return source.way_out[after] if after >= 0 else np.int32(-1)
    following = source.place[source.frames[source.way_out[last]] + 1]
    return following if following >= 0 else source.way_out[last]


@_jit
def _draw(source, settings, probe, random, drawn):
    """Draw windows from p(i | t), exactly or with the paper's search and the kernel in the leaf."""
    if not settings.paper:
        _exact_kernels.draw(
            source.blocks, source.boxes, source.n, probe, settings.temperature, random, source.scratch, drawn
        )
        return
    for k in range(len(drawn)):
        drawn[k], _ = _descent_kernels.draw(
            source.nodes, source.leaves, source.members, source.blocks, probe, settings.temperature, True, random,
            source.leaf_weights,
        )  # fmt: skip


@_jit
def _pick(log_weight, random):
    """An index drawn with probabilities proportional to exp(log_weight); one at least is finite."""
    best, total = log_weight.max(), 0.0
    for k in range(len(log_weight)):
        total += np.exp(log_weight[k] - best)
    left = uniform(random) * total
    for k in range(len(log_weight)):
        left -= np.exp(log_weight[k] - best)
        if left < 0:
            return k
    return log_weight.argmax()


@_jit
def _log_weight(sources, s, i, present, settings, state):
    """How much a window is wanted for what comes after it, future, activity, heading, speed, and beside the legs.

    `present` (b,) are the coefficients of the first tree, that of the legs, now.
    """
    source, w = sources[s], 0.0
    if s > 0:
        w -= _apart(sources[0], source.frames[i], present) / (2.0 * settings.temperature)
    if settings.future:
        following = source.place[source.frames[i] + 1]
        w -= source.cost[following if following >= 0 else i] / (2.0 * settings.temperature)
    if settings.activity >= 0 and source.activity[i] != settings.activity:
        w -= _OFF_ACTIVITY
    if settings.heading == settings.heading:
        asked = settings.heading - state.pose[5]
        asked -= 2 * np.pi * np.round(asked / (2 * np.pi))
        asked = min(max(asked, -_SHARPEST), _SHARPEST)
        w -= 0.5 * ((source.turn[i] - asked) / _TURN_SPREAD) ** 2
    if settings.pace == settings.pace:
        w -= 0.5 * ((source.speed[i] - settings.pace) / _PACE_SPREAD) ** 2
    return w


@_jit
def _apart(source, frame, present):
    """Squared distance of the coefficients of the window that ends at `frame` to `present` (b,)."""
    i, square = source.place[frame], 0.0
    for j in range(len(present)):
        square += (source.blocks[i >> 5, j, i & 31] - present[j]) ** 2
    return square


@_jit
def _begin_blend(owns, row, state):
    """Note what is shown less what the database says at its frame of parameters `row` (50,), and the rate of that."""
    for c in range(25):
        if owns[c]:
            away = state.rows[0, c] - row[c]
            state.difference[c] = turned_towards(away, 0.0) if _is_angle(c) else away
            state.drift[c] = (state.rows[0, c] - state.rows[1, c]) * FPS - row[25 + c]


@_jit
def _blend(quickness, state, step):
    """Let differences decay by a frame, x(t) = (x₀ + (v₀ + y x₀) t) exp(-y t) (Bollo 2018), and add them to `step`."""
    if not quickness < np.inf:
        return
    fades = np.exp(-quickness / FPS)
    for c in range(25):
        x, v = state.difference[c], state.drift[c]
        push = v + quickness * x
        state.difference[c] = (x + push / FPS) * fades
        state.drift[c] = (v - quickness * push / FPS) * fades
        step[c] += state.difference[c]


@_jit
def _remember(step, state):
    """Keep the new local pose, its angles told in the turns of the one before."""
    for k in range(len(state.rows) - 1, 0, -1):
        for c in range(25):
            state.rows[k, c] = state.rows[k - 1, c]
    for c in range(25):
        if _is_angle(c):
            step[c] = turned_towards(step[c], state.rows[1, c])
        state.rows[0, c] = step[c]
