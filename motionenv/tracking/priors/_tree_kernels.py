"""Compiled loops of the tree prior: coefficients of histories, one step forward, and window distances."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.models.motion_tree.feature_kernels import local_pose, turned_towards


@kernel
def coefficients_of(history, weights, offset, out) -> None:
    """Write standardised coefficients to `out` (N, b), of histories (N, frames, c) of local parameters, oldest first.

    `weights` is (frames, c, b), `offset` (b,).
    """
    frames, width, b = weights.shape
    for i in range(len(history)):
        row = out[i]
        for k in range(b):
            row[k] = -offset[k]
        for t in range(frames):
            for j in range(width):
                value = history[i, t, j]
                for k in range(b):
                    row[k] += value * weights[t, j, k]


@kernel
def advance_histories(history, entries, now, after, pose, velocity, fps, out) -> None:
    """Write the histories (N, frames, c) one frame later to `out`, by `Forecast.carried`.

    Args:
        history: local parameters, oldest first.
        entries: (c,) their indices in the pose.
        now: (N, 50) parameters of the windows' last frames.
        after: (N, 25) local parameters of the frames after them.
        pose, velocity: (25,) fractions of the difference from the window that are carried over.
        fps: frame rate [Hz].
        out: (N, frames, c), output.
    """
    last = history.shape[1] - 1
    for i in range(len(history)):
        for t in range(last):
            for j in range(len(entries)):
                out[i, t, j] = history[i, t + 1, j]
        for j in range(len(entries)):
            e = entries[j]
            here = history[i, last, j]
            speed = (here - history[i, last - 1, j]) * fps
            off = here - now[i, e] if e < 3 else turned_towards(here - now[i, e], 0.0)
            value = after[i, e] + pose[e] * off + velocity[e] * (speed - now[i, 25 + e]) / fps
            out[i, last, j] = value if e < 3 else turned_towards(value, here)


@kernel
def next_poses(poses, history, rest, entries, noise, scale, out) -> None:
    """Write to `out` (N, 25) the successors of `poses`, given by the last frame of `history` plus `rest`.

    Args:
        poses: (N, 25).
        history: (N, frames, c), lengths times `scale`.
        rest: (N, c) deviation from the history, lengths times `scale`; 0 for steps and turns.
        entries: (c,) their indices in the pose; the other entries are unchanged.
        noise: (N, c) to add to steps and turns, lengths times `scale`.
        scale: of lengths.
        out: (N, 25), output.
    """
    last = history.shape[1] - 1
    step = np.zeros(25)
    for i in range(len(poses)):
        for j in range(25):
            out[i, j] = poses[i, j]
        for j in range(len(entries)):
            e = entries[j]
            step[e] = history[i, last, j] + rest[i, j]
            if e < 2 or e == 5:
                step[e] += noise[i, j]
            elif e == 2:
                out[i, e] = step[e] / scale
            else:
                out[i, e] = turned_towards(step[e], poses[i, e])
        c, s = np.cos(poses[i, 5]), np.sin(poses[i, 5])
        out[i, 0] += (c * step[0] - s * step[1]) / scale
        out[i, 1] += (s * step[0] + c * step[1]) / scale
        out[i, 5] += step[5]


@kernel
def misfits(poses, windows, entries, wanted, precision, out) -> None:
    """Write the squared, standardised distance (n,) of each window's last frame from a given frame to `out`.

    Args:
        poses: (frames, 25) of a database.
        windows: (n,) last frame of each window.
        entries: (c,) indices of the compared pose entries.
        wanted: (2, c) local parameters, and their change since the frame before.
        precision: (2, c) 1 / variance of each; 0 if unknown.
        out: (n,), output.
    """
    local = np.empty(25)
    for i in range(len(windows)):
        t = windows[i]
        local_pose(poses[t - 1], poses[t], local)
        total = 0.0
        for j in range(len(entries)):
            e = entries[j]
            off, step = local[e] - wanted[0, j], local[e] - poses[t - 1, e] - wanted[1, j]
            if e > 2:
                off, step = turned_towards(off, 0.0), turned_towards(step, 0.0)
            total += precision[0, j] * off * off + precision[1, j] * step * step
        out[i] = total
