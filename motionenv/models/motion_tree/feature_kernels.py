"""Compiled loops over frames: pose vectors to the parameters of a frame, and back."""

import numpy as np

from motionenv._core.compilation import kernel
from motionenv.body.skeleton import MIDDLE

_TURN = 2 * np.pi


@kernel
def turned_towards(angle, aim):
    """`angle` less as many whole turns as bring it within half a turn of `aim`."""
    return angle - _TURN * np.round((angle - aim) / _TURN)


@kernel
def local_pose(before, now, out):
    """Write to `out` (25,) the pose `now` as seen from the heading frame of the pose `before`, one frame earlier."""
    c, s = np.cos(before[5]), np.sin(before[5])
    dx, dy = now[0] - before[0], now[1] - before[1]
    out[0] = c * dx + s * dy
    out[1] = c * dy - s * dx
    for j in range(2, 25):
        out[j] = now[j]
    out[5] = now[5] - before[5]


@kernel
def placed_pose(before, local, out):
    """Write to `out` (25,) the pose in the world that `local_pose` sees as `local` from `before`."""
    c, s = np.cos(before[5]), np.sin(before[5])
    out[0] = before[0] + c * local[0] - s * local[1]
    out[1] = before[1] + s * local[0] + c * local[1]
    heading = before[5] + local[5]
    for j in range(2, 25):
        out[j] = local[j]
    out[5] = heading


@kernel
def _rate_of_change(earlier, now, fps, out):
    """Write (now - earlier) · fps (25,) to `out`, of angles the shorter way."""
    for j in range(25):
        change = now[j] - earlier[j]
        out[j] = (change if np.isnan(MIDDLE[j]) else turned_towards(change, 0.0)) * fps


@kernel
def _plainly_told(out):
    """Turn the angles of `out` (25,) to within half a turn of the middle of their ranges."""
    for j in range(25):
        if not np.isnan(MIDDLE[j]):
            out[j] = turned_towards(out[j], MIDDLE[j])


@kernel
def frame_parameters(poses, start, t, fps, earlier, out):
    """Write the parameters (50,) of frame `t` of a sequence that begins at frame `start`; `earlier` (25,) is scratch.

    Before its first frame a sequence is taken to have moved as it does from the first to the second.
    """
    i = max(t, start + 1)
    local_pose(poses[i - 1], poses[i], out)
    if i - 2 >= start:
        local_pose(poses[i - 2], poses[i - 1], earlier)
    else:
        earlier[:] = poses[i - 1]
        earlier[0], earlier[1], earlier[5] = out[0], out[1], out[5]
    _rate_of_change(earlier, out, fps, out[25:])
    if i > t:  # the first frame: its own pose, the increments and velocities of the second
        out[2:5] = poses[t, 2:5]
        out[6:25] = poses[t, 6:]
    _plainly_told(out)


@kernel
def parameters_of(poses, starts, first, last, fps, out):
    """Write the parameters (last - first, 50) of frames `first` to `last` of sequences that begin at `starts`."""
    earlier, row = np.empty(25), np.empty(50)
    k = np.searchsorted(starts, first, side="right") - 1
    for t in range(first, last):
        while k + 1 < len(starts) and starts[k + 1] <= t:
            k += 1
        frame_parameters(poses, starts[k], t, fps, earlier, row)
        for j in range(50):
            out[t - first, j] = row[j]


@kernel
def parameters_at(poses, starts, frames, fps, out):
    """Write the parameters (n, 50) of `frames` (n,) of sequences that begin at `starts`."""
    earlier = np.empty(25)
    for i in range(len(frames)):
        start = starts[np.searchsorted(starts, frames[i], side="right") - 1]
        frame_parameters(poses, start, frames[i], fps, earlier, out[i])
