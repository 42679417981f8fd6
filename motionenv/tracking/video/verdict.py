"""Decide in which frames a track follows the person, and why not in the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

#: Reasons, by number.
REASONS = (
    "followed", "not wholly in the picture", "hidden: nothing of the person is seen",
    "the outline doesn't fit the body", "the body jumps", "too little of the track holds",
)  # fmt: skip
FOLLOWED, ABSENT, HIDDEN, MISFIT, JUMP, TOO_LITTLE = range(len(REASONS))

# Chosen on the development films of `benchmarks/tracking/choosing.py`: of every 60 of them, drawn with replacement, at
# most 2 % of what is called followed is false in 95 of 100 draws. Merged outlines are judged otherwise since: 2.2 %.
_ENOUGH = 0.56  # least mean overlap over `_NEAR`
_NEAR = 0.25  # [s]
_FASTEST = 5.0  # [m/s] of the pelvis over `_NEAR`
# Most distance from detected points, in body heights: more than 95 % of the frames have in the films from CMU's walks
# of `benchmarks/tracking/detected_films.py`.
_AGREES = 0.04
_LEAST_FOLLOWED = 0.3  # share of the frames in which the person is seen


@dataclass(frozen=True)
class Lost:
    """A time in which nobody is followed, from frame `first` to `last`, for a `reason` of `REASONS`.

    `left` tells whether the person is only outside the picture, rather than lost.
    """

    first: int
    last: int
    reason: str
    left: bool


def verdict(
    poses: np.ndarray, overlap: np.ndarray, seen: np.ndarray, fps: float, off: np.ndarray | None = None
) -> np.ndarray:
    """Number of a reason in `REASONS` (T,) for each frame.

    Args:
        poses: expected poses (T, 25) [m, rad].
        overlap: (T,) of body and outline, as of `VideoTrack`.
        seen: (T,) bool, whether there is an outline.
        fps: frame rate [Hz].
        off: (T,) distance of the pose from detected points, in body heights; NaN where there are none, None for no
            detections. Where it's small the person is followed, whatever the outline.
    """
    agrees = np.zeros(len(poses), dtype=bool) if off is None else np.nan_to_num(off, nan=np.inf) < _AGREES
    near = max(1, round(_NEAR * fps))
    around = [slice(max(0, t - near // 2), t + near // 2 + 1) for t in range(len(overlap))]
    smooth = np.array([overlap[a][seen[a]].mean() if seen[a].any() else 0.0 for a in around])
    reasons = np.full(len(poses), FOLLOWED)
    step = np.linalg.norm(poses[near:, :3] - poses[:-near, :3], axis=1) * fps / near
    for t in np.flatnonzero(step > _FASTEST):
        reasons[t : t + near + 1] = JUMP
    reasons[(smooth < _ENOUGH) & ~agrees] = MISFIT
    reasons[~seen & ~agrees] = HIDDEN
    if (reasons == FOLLOWED).sum() < _LEAST_FOLLOWED * max((seen | agrees).sum(), 1):
        reasons[reasons == FOLLOWED] = TOO_LITTLE
    return reasons


def intervals(reasons: Sequence[int] | np.ndarray) -> list[slice]:
    """Runs of equal values of `reasons` (T,), in order."""
    edges = (np.flatnonzero(np.diff(reasons)) + 1).tolist()
    return [slice(a, b) for a, b in zip([0, *edges], [*edges, len(reasons)], strict=True) if b > a]


def losses(reasons: np.ndarray) -> list[Lost]:
    """The times in which nobody is followed, from the `reasons` (T,) of `verdict`."""
    return [
        Lost(run.start, run.stop - 1, REASONS[reasons[run.start]], bool(reasons[run.start] == ABSENT))
        for run in intervals(reasons)
        if reasons[run.start] != FOLLOWED
    ]
