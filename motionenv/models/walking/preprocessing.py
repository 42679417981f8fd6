"""Turn captured walks into aligned, closed cycles from which a model can learn."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionenv.body.kinematics import forward
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.cycles import Alignment, align, estimate_period, periodic_basis, to_reference
from motionenv.errors import MotionError
from motionenv.models.walking.tables import CHANNELS
from motionenv.types import Cycles, Motion

__all__ = [
    "CHANNELS", "STRAIGHT", "FoundCycles", "closed", "find_cycles", "forward_speed", "gait_channels", "leading_phase",
    "straightness", "walking_cycles",
]  # fmt: skip

#: Least `straightness` of the walks that models learn from.
STRAIGHT = 0.9
_ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]


def gait_channels(motion: Motion) -> np.ndarray:
    """The `CHANNELS` (frames, 24) of a straight walk, `motion` (frames, 25), independent of its place and direction.

    Heading is relative to the direction of travel. Ankle heights are shifted so that the stance foot is at
    `ANKLE_HEIGHT`, which makes trials with different floor heights comparable; if the capture shows one leg only, that
    foot stands. Channels of limbs that it doesn't show are NaN.

    Raises:
        MotionError: more than one sequence.
    """
    if motion.poses.ndim != 2:
        raise MotionError(f"one walk (frames, 25) at a time, got poses of shape {motion.poses.shape}")
    way = _travel(motion)
    height = motion.skeleton.height
    ankles = forward(motion.poses, motion.skeleton)[0][:, _ANKLES, 2] / height
    both, one = np.isfinite(ankles).all(1), np.isfinite(ankles).any(1)
    known = ankles[both if both.any() else one]
    floor = np.percentile(np.nanmin(known, axis=1), 10) - ANKLE_HEIGHT if len(known) else 0.0
    turned = motion.poses[:, 5] - np.arctan2(way[1], way[0])
    mean = np.angle(np.nanmean(np.exp(1j * turned)))
    turned = turned - 2 * np.pi * np.round((np.nanmean(turned) - mean) / (2 * np.pi))
    return np.column_stack([motion.poses[:, 6:], motion.poses[:, 3:5], turned, ankles - floor])


def walking_cycles(channels: Sequence[np.ndarray], fps: Sequence[float], subjects: Sequence) -> Cycles:
    """Cycles of walks. At phase 0 the left leg is furthest ahead of the right, or of where it is half a cycle later.

    Of each walk there are its `channels` (frames, 24), as in `CHANNELS`, of which the 19 angles determine period and
    offset, `fps`, and the person's label in `subjects`.

    Raises:
        MotionError: a walk without a period.
    """
    angles = [c[:, :19] for c in channels]
    periods = [estimate_period(a, f).frames for a, f in zip(angles, fps, strict=True)]
    in_phase = _in_phase(align(angles, periods))
    return closed(to_reference(channels, in_phase, fps, channels=CHANNELS, subjects=subjects))


@dataclass(frozen=True, eq=False)
class FoundCycles:
    """The cycles of one walk, all of one duration (paper A, section 3).

    Attributes:
        seconds: duration of a cycle, which is one stride [s].
        starts: (n,) times in the walk at which the left leg is furthest ahead of the right [s].
    """

    seconds: float
    starts: np.ndarray


def find_cycles(motion: Motion) -> FoundCycles:
    """Find the cycles of a straight walk, `motion` (frames, 25).

    Raises:
        MotionError: more than one sequence, or no period.
    """
    angles = gait_channels(motion)[:, :19]
    period = estimate_period(angles, motion.fps).frames
    first = np.mod(_in_phase(align([angles], [period])).offsets[0], period)
    return FoundCycles(period / motion.fps, np.arange(first, len(angles), period) / motion.fps)


def _in_phase(found: Alignment) -> Alignment:
    """The alignment shifted so that the left leg is furthest ahead of the right at phase 0."""
    shift = leading_phase(periodic_basis(np.arange(256) / 256) @ found.reference)
    return replace(found, offsets=found.offsets + shift * found.periods)


def leading_phase(cycle: np.ndarray) -> float:
    """Phase [cycles] at which the left leg is furthest ahead of the right in a `cycle` (samples, channels).

    It is that of the fundamental of the hips' flexion. The first channels are the 19 angles.
    """
    hips = cycle[:, [CHANNELS.index("left_hip_flexion"), CHANNELS.index("right_hip_flexion")]]
    known = np.isfinite(hips)
    mean = np.where(known, hips, 0.0).sum(0) / np.maximum(known.sum(0), 1)
    ahead = np.where(known, hips - mean, 0.0) @ [1.0, -1.0]
    return float(-np.angle((ahead * np.exp(-2j * np.pi * np.arange(len(cycle)) / len(cycle))).sum()) / (2 * np.pi))


def closed(cycles: Cycles) -> Cycles:
    """Remove the linear drift of each channel of `cycles`, so that the end of each cycle meets its beginning.

    Without this, repeated cycles jump where they meet: hips by ten degrees within two frames. The drift is kept.
    """
    values = cycles.values.copy()
    drift = np.nan_to_num(2 * values[:, -1] - values[:, -2] - values[:, 0])
    share = (np.arange(values.shape[1]) + 0.5) / values.shape[1] - 0.5
    return replace(cycles, values=values - share[:, None] * drift[:, None], drift=drift)


def forward_speed(motion: Motion) -> float:
    """Mean speed [m/s] along the straight line of a walk, `motion` (frames, 25)."""
    return float(np.linalg.norm(_travel(motion)) * motion.fps)


def straightness(motion: Motion) -> float:
    """Ratio of the root's net displacement in `motion` (frames, 25) to the length of its path, between half seconds."""
    path = motion.poses[:: max(1, round(motion.fps / 2)), :2]
    path = path[np.isfinite(path).all(1)]
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    return float(np.linalg.norm(path[-1] - path[0]) / max(length, 1e-9)) if len(path) > 1 else 0.0


def _travel(motion: Motion) -> np.ndarray:
    """Mean displacement per frame (2,) [m] by least squares on the frames in which the root is known."""
    known = np.isfinite(motion.poses[:, :2]).all(1)
    if known.sum() < 2:
        raise MotionError("the root is never seen; leave this walk out")
    time = np.flatnonzero(known)
    return np.polyfit(time, motion.poses[known, :2], 1)[0]
