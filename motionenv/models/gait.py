"""Captured walks as cycles that a model can learn: what is periodic in them, in step with each other."""

from dataclasses import dataclass, replace

import numpy as np

from motionenv.body.kinematics import forward
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.cycles import Alignment, align, estimate_period, periodic_basis, to_reference
from motionenv.errors import MotionError
from motionenv.types import ANGLES, Cycles, Motion

#: Channels of the cycles: the 19 angles, the root's rotations [rad], the ankles' heights [shares of body height].
CHANNELS = (*ANGLES, "root_tilt", "root_obliquity", "root_heading", "left_ankle_height", "right_ankle_height")

__all__ = [
    "CHANNELS",
    "STRAIGHT",
    "FoundCycles",
    "find_cycles",
    "forward_speed",
    "gait_channels",
    "straightness",
    "walking_cycles",
]

#: Least `straightness` of the walks that models learn from.
STRAIGHT = 0.9
_ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]


def gait_channels(motion: Motion) -> np.ndarray:
    """The `CHANNELS` (frames, 24) of a straight walk, free of where and in which direction it goes.

    Heading is about the direction of travel. Ankle heights are such that the foot on the ground stands at a stance
    foot's height, so that trials with the floor elsewhere agree.

    Args:
        motion: a straight walk (frames, 25).

    Raises:
        MotionError: not one sequence.
    """
    if motion.poses.ndim != 2:
        raise MotionError(f"one walk (frames, 25) at a time, got poses of shape {motion.poses.shape}")
    way = _travel(motion)
    height = motion.skeleton.height
    ankles = forward(motion.poses, motion.skeleton)[0][:, _ANKLES, 2] / height
    known = ankles[np.isfinite(ankles).all(1)]
    floor = np.percentile(known.min(1), 10) - ANKLE_HEIGHT if len(known) else 0.0
    turned = motion.poses[:, 5] - np.arctan2(way[1], way[0])
    mean = np.angle(np.nanmean(np.exp(1j * turned)))
    turned = turned - 2 * np.pi * np.round((np.nanmean(turned) - mean) / (2 * np.pi))
    return np.column_stack([motion.poses[:, 6:], motion.poses[:, 3:5], turned, ankles - floor])


def walking_cycles(channels, fps, subjects) -> Cycles:
    """Cycles of walks, phase 0 where the left leg is furthest ahead of the right.

    Args:
        channels: per walk the `CHANNELS` (frames, 24); the 19 angles steer period and offset.
        fps: frames per second of each.
        subjects: a label for each.

    Raises:
        MotionError: a walk without a period.
    """
    angles = [c[:, :19] for c in channels]
    periods = [estimate_period(a, f).frames for a, f in zip(angles, fps, strict=True)]
    in_phase = _in_phase(align(angles, periods))
    return _closed(to_reference(channels, in_phase, fps, channels=CHANNELS, subjects=subjects))


@dataclass(frozen=True, eq=False)
class FoundCycles:
    """The cycles of one walk, all of one length (paper A, section 3).

    Attributes:
        seconds: of a cycle: one stride [s].
        starts: (n,) times at which the left leg is furthest ahead of the right [s], within the walk.
    """

    seconds: float
    starts: np.ndarray


def find_cycles(motion: Motion) -> FoundCycles:
    """Where the cycles of a straight walk begin.

    Args:
        motion: (frames, 25).

    Raises:
        MotionError: not one sequence, or without a period.
    """
    angles = gait_channels(motion)[:, :19]
    period = estimate_period(angles, motion.fps).frames
    first = np.mod(_in_phase(align([angles], [period])).offsets[0], period)
    return FoundCycles(period / motion.fps, np.arange(first, len(angles), period) / motion.fps)


def _in_phase(found: Alignment) -> Alignment:
    """Aligned angles, now with phase 0 where the left leg is furthest ahead of the right."""
    grid = np.arange(256) / 256
    reference = periodic_basis(grid) @ found.reference
    ahead = reference[:, CHANNELS.index("left_hip_flexion")] - reference[:, CHANNELS.index("right_hip_flexion")]
    shift = -np.angle((ahead * np.exp(-2j * np.pi * grid)).sum()) / (2 * np.pi)
    return replace(found, offsets=found.offsets + shift * found.periods)


def _closed(cycles: Cycles) -> Cycles:
    """The same cycles less the straight line by which each channel ends elsewhere than it began.

    People drift while they walk. Repeated, a cycle that isn't closed would jump at its seam: hips would be thrown
    about by ten degrees within two frames.
    """
    values = cycles.values.copy()
    drift = np.nan_to_num(2 * values[:, -1] - values[:, -2] - values[:, 0])
    share = (np.arange(values.shape[1]) + 0.5) / values.shape[1] - 0.5
    return replace(cycles, values=values - share[:, None] * drift[:, None])


def forward_speed(motion: Motion) -> float:
    """Mean speed [m/s] along the straight line of a walk (frames, 25).

    Args:
        motion: a straight walk.
    """
    return float(np.linalg.norm(_travel(motion)) * motion.fps)


def straightness(motion: Motion) -> float:
    """Net displacement of the root over the length of its path, both from positions half a second apart.

    Args:
        motion: (frames, 25).
    """
    path = motion.poses[:: max(1, round(motion.fps / 2)), :2]
    path = path[np.isfinite(path).all(1)]
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    return float(np.linalg.norm(path[-1] - path[0]) / max(length, 1e-9)) if len(path) > 1 else 0.0


def _travel(motion: Motion) -> np.ndarray:
    """Mean displacement per frame (2,) [m] by least squares on what is known of the root."""
    known = np.isfinite(motion.poses[:, :2]).all(1)
    if known.sum() < 2:
        raise MotionError("the root is never seen; leave this walk out")
    time = np.flatnonzero(known)
    return np.polyfit(time, motion.poses[known, :2], 1)[0]
